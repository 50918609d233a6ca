"""Small samples with closed forms: a square sheet above a sphere."""

import numpy as np
import pytest
import trimesh

from muslin.garments.mesh import GarmentMesh
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.remeshed import sample_of_frames
from muslin.sim.dataset.sample import Sample

SIDE = 0.8
SPHERE_RADIUS = 0.2


def square(n: int) -> GarmentMesh:
    """A sheet of n x n vertices, cut in two panels that are sewn along the middle."""
    x = np.linspace(0, SIDE, n)
    X, Y = np.meshgrid(x, x, indexing="ij")
    grid = np.stack([X.ravel(), Y.ravel()], axis=1)
    i = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([np.c_[i, i + n, i + n + 1], np.c_[i, i + n + 1, i + 1]]).astype(np.int32)
    return GarmentMesh(
        faces=faces,
        panel_faces=faces,
        panel_vertices=grid,
        panel_to_vertex=np.arange(n * n, dtype=np.int32),
        face_panel=np.zeros(len(faces), dtype=np.int32),
        panel_names=("cloth",),
        uv=grid / SIDE,
        name="square",
        parameters={"side": SIDE},
    )


@pytest.fixture
def make_sample():
    """make_sample(id, frames, height, n, body=True): a level sheet that rises 1 cm a frame, over a sphere."""

    def make(
        sample_id: str = "sheet",
        frames: int = 1,
        height: float = 0.21,
        n: int = 9,
        body: bool = True,
        **changes,
    ) -> Sample:
        garment = square(n)
        grid = garment.panel_vertices - SIDE / 2
        flat = np.stack([grid[:, 0], np.full(len(grid), height), -grid[:, 1]], axis=1)
        rising = np.stack([flat + np.array([0, 0.01 * t, 0]) for t in range(frames)])
        ball = trimesh.creation.icosphere(3, SPHERE_RADIUS)
        values = {
            "id": sample_id,
            "kind": "sequence" if frames > 1 else "drape",
            "garment": garment,
            "positions": rising.astype(np.float32),
            "certificate": Certificate(
                cloth_cloth_intersections=0, cloth_body_intersections=0, min_distance_m=0.01, seconds=1.5
            ),
            "fps": 30.0 if frames > 1 else None,
            "obstacle_vertices": np.array(ball.vertices, dtype=np.float32)[None] if body else None,
            "obstacle_faces": np.array(ball.faces, dtype=np.int32) if body else None,
            "fabric": "gray-interlock",
            "labels": {"design": "square", "shape": "ball", "sequence": "rise" if frames > 1 else ""},
        }
        return Sample(**(values | changes)).validate()

    return make


@pytest.fixture
def remeshed_sample():
    """A level sheet over the sphere that rises 1 cm a frame, on another mesh from frame 2 on."""
    meshes = [square(n) for n in (7, 12)]
    frames = []
    for t, mesh in enumerate(chosen := [meshes[0], meshes[0], meshes[1]]):
        grid = mesh.panel_vertices - SIDE / 2
        frames.append(np.stack([grid[:, 0], np.full(len(grid), 0.21 + 0.01 * t), -grid[:, 1]], axis=1))
    ball = trimesh.creation.icosphere(3, SPHERE_RADIUS)
    return sample_of_frames(
        chosen,
        frames,
        id="remeshed",
        kind="sequence",
        certificate=Certificate(cloth_cloth_intersections=0, cloth_body_intersections=0),
        fps=30.0,
        obstacle_vertices=np.array(ball.vertices, dtype=np.float32)[None],
        obstacle_faces=np.array(ball.faces, dtype=np.int32),
        labels={"design": "square", "sequence": "rise"},
    ).validate()
