"""A sequence whose mesh is replaced every few frames, with closed forms: a sheet that sways over a ball.

Every vertex lies at a linear function of its panel-space point, so every mesh has the same surface, exactly.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from sheet_producer import RADIUS, ball

from muslin.garments import catalogue
from muslin.garments.mesh import GarmentMesh
from muslin.garments.triangulate import triangulate
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.remeshed import RemeshedSequence

EDGE_LENGTHS = (0.2, 0.11, 0.15)
FRAME_TOPOLOGY = (0, 0, 1, 1, 2, 0, 0)
FPS = 30.0
CLEARANCE, SWAY = 0.05, 0.02


@lru_cache
def sheet_at(edge_length: float) -> GarmentMesh:
    """A square of one metre, centred on the origin of its panel space."""
    return triangulate(catalogue.get("sheet").pattern(), edge_length)


def swayed(mesh: GarmentMesh, frame: int) -> np.ndarray:
    """(V, 3) float32: x = u, z = -v, and a height that rises and tilts over time."""
    point = np.zeros((mesh.num_vertices, 2))
    point[mesh.panel_to_vertex] = mesh.panel_vertices
    height = RADIUS + CLEARANCE + SWAY * (1.0 + point[:, 0] * np.sin(0.7 * frame)) + 0.01 * frame
    return np.stack([point[:, 0], height, -point[:, 1]], axis=1).astype(np.float32)


def remeshed(sample_id: str = "sway", **changes) -> RemeshedSequence:
    meshes = tuple(sheet_at(length) for length in EDGE_LENGTHS)
    vertices, faces = ball()
    values = {
        "id": sample_id,
        "kind": "sequence",
        "topologies": meshes,
        "frame_topology": np.array(FRAME_TOPOLOGY, dtype=np.int32),
        "frames": tuple(swayed(meshes[k], frame) for frame, k in enumerate(FRAME_TOPOLOGY)),
        "certificate": Certificate(cloth_cloth_intersections=0, cloth_body_intersections=0),
        "fps": FPS,
        "obstacle_vertices": vertices,
        "obstacle_faces": faces,
        "fabric": "paper",
    }
    return RemeshedSequence(**(values | changes))
