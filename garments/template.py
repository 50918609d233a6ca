"""Templates: fixed-topology meshes of a design, the same connectivity for every member of the family."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from muslin.garments import catalogue
from muslin.garments.carry import carry
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.topology import reference, topology

# Edge lengths, metres, on the reference member; the keys are near the numbers of vertices they give.
EDGE_LENGTHS = {403: 0.05123, 1400: 0.0276, 4000: 0.0163214, 17246: 0.0078844}
NAMES = {"coarse": 403, "medium": 1400, "fine": 4000, "full": 17246}


def resolution_of(resolution: int | str) -> int:
    """The resolution as a key of EDGE_LENGTHS, from that key or a name in NAMES; InputError for any other."""
    key = NAMES.get(resolution, resolution) if isinstance(resolution, str) else resolution
    if isinstance(key, str) and key.isdigit():
        key = int(key)
    if key not in EDGE_LENGTHS:
        raise InputError(
            f"template resolution = {resolution} is not known; allowed: {', '.join(map(str, EDGE_LENGTHS))} "
            f"(vertices) or {', '.join(NAMES)}"
        )
    return int(key)


def template(
    design_name: str, parameters: Mapping[str, float] | None = None, resolution: int | str = "fine"
) -> GarmentMesh:
    """Mesh of the member of a design with these parameters (metres), on the fixed connectivity of the family.

    faces, panel_faces, panel_to_vertex, face_panel and uv are the same for all members; only panel_vertices
    and parameters differ. Long members have stretched triangles: the connectivity was made for the reference
    member.
    """
    design = catalogue.get(design_name)
    pattern = design.pattern(**dict(parameters or {}))
    key = resolution_of(resolution)
    atlas = reference(design_name).atlas
    cut = topology(design_name, str(key), EDGE_LENGTHS[key])
    points, uv = [], []
    for k, panel in enumerate(pattern.panels):
        boundary = cut.sampling.points(pattern, panel.name)
        points.append(carry(cut.vertices_of(k), cut.faces_of(k), boundary))
        uv.append(atlas.place(cut.vertices_of(k), k))
    return cut.mesh(pattern, np.concatenate(points), np.concatenate(uv))


def template_of(mesh: GarmentMesh) -> int | None:
    """Resolution of the template that a mesh is, a key of EDGE_LENGTHS; None if it has other triangles."""
    for resolution in EDGE_LENGTHS:
        if abs(mesh.num_vertices - resolution) <= 0.02 * resolution and np.array_equal(
            template(mesh.name, mesh.parameters, resolution).faces, mesh.faces
        ):
            return resolution
    return None
