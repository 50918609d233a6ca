"""Several garments as one mesh, for worlds in which they meet."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from muslin.garments.mesh import GarmentMesh

OWNER = "."
"""Stands between the name of a garment and that of its panel."""


def merge_meshes(names: Sequence[str], meshes: Sequence[GarmentMesh]) -> GarmentMesh:
    """One mesh of garments called `names`, which differ, in this order: vertices, faces, panels.

    Panels are called GARMENT.PANEL and parameters GARMENT.PARAMETER; the square of uv is cut into equal
    squares, one a garment, row by row from below. A single garment stays as it is.
    """
    if len(meshes) == 1:
        return meshes[0]
    side = int(np.ceil(np.sqrt(len(meshes))))
    vertices = _before([mesh.num_vertices for mesh in meshes])
    corners = _before([len(mesh.panel_vertices) for mesh in meshes])
    panels = _before([len(mesh.panel_names) for mesh in meshes])
    tiles = [np.array([k % side, k // side]) for k in range(len(meshes))]
    return GarmentMesh(
        faces=_shifted([mesh.faces for mesh in meshes], vertices),
        panel_faces=_shifted([mesh.panel_faces for mesh in meshes], corners),
        panel_vertices=np.concatenate([mesh.panel_vertices for mesh in meshes]),
        panel_to_vertex=_shifted([mesh.panel_to_vertex for mesh in meshes], vertices),
        face_panel=_shifted([mesh.face_panel for mesh in meshes], panels),
        panel_names=tuple(
            f"{name}{OWNER}{panel}"
            for name, mesh in zip(names, meshes, strict=True)
            for panel in mesh.panel_names
        ),
        uv=np.concatenate([(mesh.uv + tile) / side for mesh, tile in zip(meshes, tiles, strict=True)]),
        # Not the name of a design, whose panels and parameters a reader would look for.
        name="+".join(names),
        parameters={
            f"{name}{OWNER}{key}": value
            for name, mesh in zip(names, meshes, strict=True)
            for key, value in mesh.parameters.items()
        },
    )


def face_owner(mesh: GarmentMesh) -> NDArray[np.int32]:
    """(F,) number of the garment of each face of a merged mesh; zeros for a single garment."""
    owners = [name.partition(OWNER)[0] if OWNER in name else "" for name in mesh.panel_names]
    order = list(dict.fromkeys(owners))
    return np.array([order.index(owner) for owner in owners], dtype=np.int32)[mesh.face_panel]


def _before(counts: Sequence[int]) -> list[int]:
    return np.cumsum([0, *counts])[:-1].tolist()


def _shifted(arrays: Sequence[NDArray[np.int32]], offsets: Sequence[int]) -> NDArray[np.int32]:
    shifted = [array + offset for array, offset in zip(arrays, offsets, strict=True)]
    return np.concatenate(shifted).astype(np.int32)
