"""Mesh files as the metrics want them: checked, in double precision, vertices as in the file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.obj import from_content
from muslin.garments.obj_reader import read_obj

MESH_SUFFIXES = (".obj", ".ply", ".off", ".stl", ".glb")


@dataclass(frozen=True, eq=False)
class Surface:
    """vertices (V, 3) float64, metres; faces (F, 3); garment: the mesh with its panels, where known."""

    vertices: np.ndarray
    faces: np.ndarray
    garment: GarmentMesh | None = None


def read_frames(files: Sequence[Path]) -> list[Surface]:
    """Surfaces of the mesh files of a sequence; frames that follow in one topology share its faces and
    garment."""
    frames: list[Surface] = []
    for file in files:
        now = read_mesh(file)
        before = frames[-1] if frames else now
        if np.array_equal(now.faces, before.faces) and _same_panels(now.garment, before.garment):
            now = replace(before, vertices=now.vertices)
        frames.append(now)
    return frames


def _same_panels(a: GarmentMesh | None, b: GarmentMesh | None) -> bool:
    if a is None or b is None:
        return a is b
    return np.array_equal(a.panel_faces, b.panel_faces) and np.array_equal(a.panel_vertices, b.panel_vertices)


def read_mesh(path: Path) -> Surface:
    """The surface in a mesh file, vertices as in the file. Raises InputError as `check_mesh`."""
    if not path.is_file():
        raise InputError(f"{path}: no such file; give a mesh ({', '.join(MESH_SUFFIXES)})")
    if path.suffix.lower() == ".obj":
        # trimesh would split vertices along uv seams
        found = _read_obj(path)
    elif path.suffix.lower() in MESH_SUFFIXES:
        found = _read_other(path)
    else:
        raise InputError(f"{path}: {path.suffix!r} is no mesh format; allowed: {', '.join(MESH_SUFFIXES)}")
    check_mesh(found.vertices, found.faces, str(path))
    return found


def check_mesh(vertices: np.ndarray, faces: np.ndarray, name: str) -> None:
    """Raise InputError unless a mesh has faces, finite vertices, indices in range and manifold edges.

    vertices   (V, 3), or (T, V, 3) for frames of one topology
    """
    count_vertices = vertices.shape[-2]
    if len(faces) == 0 or vertices.size == 0:
        raise InputError(f"{name}: the mesh is empty ({count_vertices} vertices, {len(faces)} faces)")
    if faces.min() < 0 or faces.max() >= count_vertices:
        raise InputError(f"{name}: a face has a vertex index outside 0 to {count_vertices - 1}")
    bad = np.flatnonzero(~np.isfinite(vertices).all(axis=-1).reshape(-1))
    if len(bad):
        raise InputError(
            f"{name}: NaN or infinity at vertex {bad[0] % count_vertices} ({len(bad)} in all); "
            "every coordinate must be finite"
        )
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    if count.max() > 2:
        a, b = unique[count.argmax()]
        raise InputError(
            f"{name}: not manifold: the edge of vertices {a} and {b} has {count.max()} faces, at most 2 are "
            "allowed; split the mesh there"
        )


def _read_obj(path: Path) -> Surface:
    content = read_obj(path)
    if content.panel_vertices is None or content.layout == "flat":
        return Surface(content.vertices, content.faces)
    try:
        return Surface(content.vertices, content.faces, from_content(content)[0])
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _read_other(path: Path) -> Surface:
    try:
        mesh = trimesh.load(path, force="mesh", process=False, maintain_order=True)
    except (ValueError, KeyError, TypeError, IndexError, NotImplementedError, OSError) as error:
        raise InputError(f"{path}: not readable as a mesh ({error})") from error
    if not isinstance(mesh, trimesh.Trimesh):
        raise InputError(f"{path}: holds no triangles; give a triangle mesh")
    return Surface(np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64))
