"""Garments as Wavefront OBJ: `v` positions, `vt` uv layout, one group `g` a panel.

OBJ has no place for panel space. Comment lines carry it, which other programs skip:

    # muslin garment tee {"sleeve_length": 0.22, ...}
    # muslin layout sewn | flat
    # muslin panel_vertex x y vertex        one a `vt`, in the same order: panel space (metres), sewn vertex

layout sewn: `v` are the sewn vertices. layout flat: `v` are the panel vertices, panels side by side, z = 0.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.garments.layout import arrange
from muslin.garments.mesh import GarmentMesh, signed_areas
from muslin.garments.obj_reader import ObjContent, read_obj

FLAT_GAP = 0.05  # metres between the panels of a flat file


def write_garment(mesh: GarmentMesh, path: Path | str, positions: NDArray[np.floating] | None = None) -> None:
    """Write the garment at `positions` (V, 3), metres, or, without them, its panels laid out flat.

    The file is replaced as a whole. Numbers are written so that reading gives them back exactly.
    """
    mesh.validate()
    path = Path(path)
    if positions is None:
        layout, vertices, faces = "flat", _flat(mesh), mesh.panel_faces
    else:
        layout, vertices, faces = "sewn", np.asarray(positions, dtype=np.float64), mesh.faces
        if vertices.shape != (mesh.num_vertices, 3) or not np.isfinite(vertices).all():
            raise InputError(
                f"{path}: positions have shape {vertices.shape}; they must be finite and "
                f"({mesh.num_vertices}, 3) for this garment"
            )
    lines = [f"# muslin garment {mesh.name} {json.dumps(mesh.parameters)}", f"# muslin layout {layout}"]
    lines += _rows("v", vertices)
    lines += _rows("vt", mesh.uv)
    lines += [
        f"# muslin panel_vertex {x!r} {y!r} {vertex}"
        for (x, y), vertex in zip(mesh.panel_vertices.tolist(), mesh.panel_to_vertex.tolist(), strict=True)
    ]
    for index, name in enumerate(mesh.panel_names):
        lines.append(f"g {name}")
        chosen = mesh.face_panel == index
        for v, vt in zip((faces[chosen] + 1).tolist(), (mesh.panel_faces[chosen] + 1).tolist(), strict=True):
            lines.append(f"f {v[0]}/{vt[0]} {v[1]}/{vt[1]} {v[2]}/{vt[2]}")
    partial = path.with_name(path.name + ".partial")
    partial.write_text("\n".join(lines) + "\n", encoding="utf-8")
    os.replace(partial, path)


def read_garment(
    path: Path | str, uv_size: float | None = None
) -> tuple[GarmentMesh, NDArray[np.float64] | None]:
    """The validated garment of an OBJ file and its positions (V, 3), metres; None for a flat file.

    A file of another program needs uv on every face. Its panel space is uv times `uv_size`, metres an uv
    unit; without `uv_size`, the scale at which the panels have the area of the surface in the file. Groups
    become panels. Raises InputError for a file that is not such a mesh.
    """
    path = Path(path)
    content = read_obj(path)
    if content.texture_faces is None:
        raise InputError(
            f"{path}: faces have no uv (f v/vt); a garment needs uv, so export it with its uv map"
        )
    try:
        return from_content(content) if content.panel_vertices is not None else _from_other(content, uv_size)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def from_content(content: ObjContent) -> tuple[GarmentMesh, NDArray[np.float64] | None]:
    """Garment and positions, as `read_garment`, of a file that this project wrote, with panel vertices."""
    assert content.panel_vertices is not None
    assert content.texture_faces is not None
    if len(content.panel_vertices) != len(content.uv):
        raise InputError(
            f"{len(content.panel_vertices)} panel_vertex and {len(content.uv)} vt lines; the file is damaged"
        )
    panel_to_vertex = content.panel_vertices[:, 2].astype(np.int32)
    faces = panel_to_vertex[content.texture_faces]
    flat = content.layout == "flat"
    if not flat and not np.array_equal(faces, content.faces):
        raise InputError("panel_vertex lines do not fit the faces; the file is damaged")
    mesh = _mesh(content, faces, content.panel_vertices[:, :2], panel_to_vertex)
    return mesh, None if flat else content.vertices


def _from_other(content: ObjContent, uv_size: float | None) -> tuple[GarmentMesh, NDArray[np.float64]]:
    assert content.texture_faces is not None
    vertex_of = np.full(len(content.uv), -1, dtype=np.int32)
    vertex_of[content.texture_faces] = content.faces
    if not np.array_equal(vertex_of[content.texture_faces], content.faces):
        raise InputError(
            "a uv vertex (vt) belongs to two vertices (v); write one vt for each vertex of a panel"
        )
    if uv_size is None:
        a, b, c = (content.vertices[content.faces[:, k]] for k in range(3))
        surface = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
        chart = np.abs(signed_areas(content.uv, content.texture_faces)).sum()
        if not (chart > 0.0 and surface > 0.0):
            raise InputError(
                f"the surface has area {surface:g} m^2 and its uv {chart:g}; both must be positive"
            )
        uv_size = float(np.sqrt(surface / chart))
    if not (np.isfinite(uv_size) and uv_size > 0.0):
        raise InputError(f"uv_size = {uv_size} m; it must be a finite number greater than zero")
    mesh = _mesh(content, content.faces, content.uv * uv_size, vertex_of)
    return mesh, content.vertices


def _mesh(
    content: ObjContent,
    faces: NDArray[np.int32],
    panel_vertices: NDArray[np.float64],
    panel_to_vertex: NDArray[np.int32],
) -> GarmentMesh:
    assert content.texture_faces is not None
    mesh = GarmentMesh(
        faces=faces,
        panel_faces=content.texture_faces,
        panel_vertices=np.ascontiguousarray(panel_vertices),
        panel_to_vertex=panel_to_vertex,
        face_panel=content.face_group,
        panel_names=tuple(content.groups),
        uv=content.uv,
        name=content.name,
        parameters=content.parameters,
    )
    mesh.validate()
    return mesh


def _flat(mesh: GarmentMesh) -> NDArray[np.float64]:
    flat = np.zeros((len(mesh.panel_vertices), 3))
    panels = [np.flatnonzero(mesh.panel_vertex_panel == k) for k in range(len(mesh.panel_names))]
    low = [mesh.panel_vertices[chosen].min(axis=0) for chosen in panels]
    sizes: Sequence[NDArray[np.float64]] = [np.ptp(mesh.panel_vertices[chosen], axis=0) for chosen in panels]
    corners, _ = arrange(sizes, FLAT_GAP)
    for chosen, start, corner in zip(panels, low, corners, strict=True):
        flat[chosen, :2] = mesh.panel_vertices[chosen] - start + corner
    return flat


def _rows(keyword: str, array: NDArray[np.float64]) -> list[str]:
    return [f"{keyword} {' '.join(map(repr, row))}" for row in array.tolist()]
