"""Mesh files of one frame: checked, in double precision, vertices as in the file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from muslin.eval.read.check import check_mesh
from muslin.eval.read.content import is_body, is_cloth, parsing
from muslin.eval.read.mesh_headers import check_header
from muslin.eval.read.stl import read_stl
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.obj import from_content
from muslin.garments.obj_reader import read_obj

MESH_SUFFIXES = (".obj", ".ply", ".off", ".stl", ".glb")


@dataclass(frozen=True, eq=False)
class Surface:
    """A surface in one frame, and what it lies on, where the file holds both.

    vertices   (V, 3) float64, metres; faces (F, 3)
    garment    the mesh with its panels, where known
    """

    vertices: np.ndarray
    faces: np.ndarray
    garment: GarmentMesh | None = None
    body: Surface | None = None


def read_mesh(path: Path) -> Surface:
    """The surface in a mesh file, vertices as in the file.

    STL stores no vertices, only corners: equal ones become one vertex, in the order of the file. Of the
    parts of a GLB those named as a body are `body`; the rest is the surface (only the part named cloth, if
    there is one).

    Raises InputError for what is no mesh file or a damaged one, and as `check_mesh`.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file; give a mesh ({', '.join(MESH_SUFFIXES)})")
    suffix = path.suffix.lower()
    if suffix == ".obj":
        # trimesh would split vertices along uv seams
        found = _read_obj(path)
    elif suffix == ".stl":
        found = _sewn(read_stl(path))
    elif suffix in MESH_SUFFIXES:
        check_header(path)
        found = _read_glb(path) if suffix == ".glb" else _read_other(path)
    else:
        raise InputError(f"{path}: {path.suffix!r} is no mesh format; allowed: {', '.join(MESH_SUFFIXES)}")
    check_mesh(found.vertices, found.faces, str(path))
    return found


def _read_obj(path: Path) -> Surface:
    with parsing(path, "an OBJ file"):
        content = read_obj(path)
    if content.panel_vertices is None or content.layout == "flat":
        return Surface(content.vertices, content.faces)
    try:
        with parsing(path, "a garment"):
            return Surface(content.vertices, content.faces, from_content(content)[0])
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _read_other(path: Path) -> Surface:
    with parsing(path, "a mesh"):
        mesh = trimesh.load(path, force="mesh", process=False, maintain_order=True)
        if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
            raise InputError(f"{path}: holds no triangles; give a triangle mesh")
        return _surface(mesh)


def _read_glb(path: Path) -> Surface:
    with parsing(path, "a GLB file"):
        scene = trimesh.load_scene(path, process=False, maintain_order=True)
        parts: list[tuple[str, Surface]] = []
        for node in scene.graph.nodes_geometry:
            matrix, name = scene.graph[node]
            mesh = scene.geometry[name]
            if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces):
                parts.append((f"{node} {name}", _surface(mesh.copy().apply_transform(matrix))))
    if not parts:
        raise InputError(f"{path}: holds no triangles; give a triangle mesh")
    bodies = [surface for name, surface in parts if is_body(name)]
    others = [(name, surface) for name, surface in parts if not is_body(name)]
    cloth = [surface for name, surface in others if is_cloth(name)] or [surface for _, surface in others]
    if not cloth:
        cloth, bodies = bodies, []
    together = _joined(cloth)
    return Surface(together.vertices, together.faces, body=_joined(bodies) if bodies else None)


def _surface(mesh: trimesh.Trimesh) -> Surface:
    return Surface(np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64))


def _joined(parts: list[Surface]) -> Surface:
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    return Surface(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=False)]),
    )


def _sewn(corners: np.ndarray) -> Surface:
    """Equal corners (F, 3, 3) made one vertex, numbered by their first appearance."""
    points = corners.reshape(-1, 3)
    _, first, inverse = np.unique(points, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    number = np.empty(len(order), dtype=np.int64)
    number[order] = np.arange(len(order))
    return Surface(points[first[order]], number[inverse.reshape(-1, 3)])
