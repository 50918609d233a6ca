"""What every surface that is scored has to be: finite, not empty, with manifold edges."""

from __future__ import annotations

import numpy as np

from muslin.eval.read.track import Track
from muslin.garments.errors import InputError


def check_mesh(vertices: np.ndarray, faces: np.ndarray, name: str) -> None:
    """Raise InputError unless a mesh has faces, finite vertices, indices in range and manifold edges.

    vertices   (V, 3), or (T, V, 3) for frames of one topology
    """
    check_faces(faces, vertices.shape[-2], name)
    check_finite(vertices, name)


def check_track(track: Track) -> None:
    """Raise InputError, naming the frame, unless every frame is a mesh as `check_mesh` wants it."""
    if not track.num_frames:
        raise InputError(f"{track.name}: has no frame; give at least one")
    checked: set[int] = set()
    for t in range(track.num_frames):
        x, faces = track.positions[t], track.faces[t]
        name = track.name if track.num_frames == 1 else f"{track.name}, frame {t}"
        if id(faces) not in checked:
            check_faces(faces, len(x), name)
            checked.add(id(faces))
        elif faces.max() >= len(x):
            raise InputError(f"{name}: has {len(x)} vertices, fewer than its faces name")
        check_finite(x, name)


def check_finite(vertices: np.ndarray, name: str) -> None:
    """Raise InputError if a coordinate is NaN or infinite. vertices: (..., V, 3)"""
    if np.isfinite(vertices).all():
        return
    bad = np.flatnonzero(~np.isfinite(vertices).all(axis=-1).reshape(-1))
    raise InputError(
        f"{name}: NaN or infinity at vertex {bad[0] % vertices.shape[-2]} ({len(bad)} in all); "
        "every coordinate must be finite"
    )


def check_indices(faces: np.ndarray, num_vertices: int, name: str) -> None:
    """Raise InputError unless faces name vertices that exist."""
    if faces.size and (faces.min() < 0 or faces.max() >= num_vertices):
        raise InputError(f"{name}: a face has a vertex index outside 0 to {num_vertices - 1}")


def check_faces(faces: np.ndarray, num_vertices: int, name: str) -> None:
    """Raise InputError unless there are triangles, of vertices that exist, at most two at each edge."""
    if len(faces) == 0 or num_vertices == 0:
        raise InputError(f"{name}: the mesh is empty ({num_vertices} vertices, {len(faces)} faces)")
    check_indices(faces, num_vertices, name)
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    if count.max() > 2:
        a, b = unique[count.argmax()]
        raise InputError(
            f"{name}: not manifold: the edge of vertices {a} and {b} has {count.max()} faces, at most 2 are "
            "allowed; split the mesh there"
        )
