"""Mesh files as the metrics want them: checked, in double precision, vertices as in the file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh

from muslin.garments.errors import InputError
from muslin.garments.obj_reader import read_obj

MESH_SUFFIXES = (".obj", ".ply", ".off", ".stl", ".glb")


def read_frames(files: Sequence[Path]) -> tuple[np.ndarray, np.ndarray]:
    """Positions (T, V, 3) float64, metres, and faces (F, 3) of mesh files that share one topology."""
    meshes = [read_mesh(file) for file in files]
    faces = meshes[0][1]
    for file, (vertices, other) in zip(files, meshes, strict=True):
        if not np.array_equal(other, faces) or len(vertices) != len(meshes[0][0]):
            raise InputError(
                f"{file}: its faces differ from those of {files[0]}; "
                "all frames of a sequence must have one topology"
            )
    return np.stack([vertices for vertices, _ in meshes]), faces


def read_mesh(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) float64 and faces (F, 3) int64 of a mesh file. Raises InputError as `check_mesh`."""
    if not path.is_file():
        raise InputError(f"{path}: no such file; give a mesh ({', '.join(MESH_SUFFIXES)})")
    if path.suffix.lower() == ".obj":
        # trimesh would split vertices along uv seams
        content = read_obj(path)
        vertices, faces = content.vertices, content.faces
    elif path.suffix.lower() in MESH_SUFFIXES:
        vertices, faces = _read_other(path)
    else:
        raise InputError(f"{path}: {path.suffix!r} is no mesh format; allowed: {', '.join(MESH_SUFFIXES)}")
    check_mesh(vertices, faces, str(path))
    return vertices, faces


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


def _read_other(path: Path) -> tuple[np.ndarray, np.ndarray]:
    try:
        mesh = trimesh.load(path, force="mesh", process=False, maintain_order=True)
    except (ValueError, KeyError, TypeError, IndexError, NotImplementedError, OSError) as error:
        raise InputError(f"{path}: not readable as a mesh ({error})") from error
    if not isinstance(mesh, trimesh.Trimesh):
        raise InputError(f"{path}: holds no triangles; give a triangle mesh")
    return np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64)
