"""Which of a file's named arrays are the garment's vertices and faces, and which the body's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from muslin.eval.read.content import Content
from muslin.garments.errors import InputError

# In order of preference; names in files are compared in lower case.
VERTICES = (
    "pred", "prediction", "cloth_positions", "cloth_vertices", "cloth_pos", "garment_positions",
    "garment_vertices", "cloth", "garment", "vertices", "verts", "positions", "points", "pos", "v", "x",
)  # fmt: skip
FACES = ("cloth_faces", "garment_faces", "faces", "triangles", "tris", "f")
BODY = (
    "obstacle", "body_positions", "body_vertices", "body_verts", "body_pos", "obstacle_positions",
    "obstacle_vertices", "obstacle_pos", "body",
)  # fmt: skip
BODY_FACES = ("obstacle_faces", "body_faces")
RATE = ("fps", "frame_rate", "framerate")
# This project's own npz of a garment whose topology changes.
TOPOLOGY = "cloth_topology"
_KNOWN = frozenset((*VERTICES, *FACES, *BODY, *BODY_FACES, *RATE))


def is_known(name: str) -> bool:
    """Whether an array of this name, in lower case, is one that `content_of` may ask for."""
    return name in _KNOWN


def content_of(arrays: Mapping[str, np.ndarray], path: Path) -> Content:
    """The garment, and body if there is one, of arrays by name, in lower case; others are not asked for.

    Vertices are (T, V, 3) or (V, 3), also with one leading 1; faces (F, 3), or (F, 4) quads, which are split.
    Vertices without faces are allowed. Raises InputError if no name of a garment's vertices is there, or an
    array has another shape.
    """
    if TOPOLOGY in arrays:
        return _changing(arrays, path)
    vertices = _first(arrays, VERTICES)
    if vertices is None:
        there = ", ".join(list(arrays)[:8]) or "nothing"
        raise InputError(
            f"{path}: which array holds the vertices? There is {there}; name it 'vertices' (T, V, 3), and "
            "the triangles 'faces' (F, 3)"
        )
    return _surface(path, vertices, _first(arrays, FACES), _rate(arrays), _body(arrays, path))


def frames_of(array: np.ndarray, name: str, path: Path) -> np.ndarray:
    """(T, V, 3) view of vertices of one or several frames. Raises InputError for another shape or type."""
    shape = array.shape
    while array.ndim > 3 and array.shape[0] == 1:
        array = array[0]
    if array.ndim == 2:
        array = array[None]
    if array.ndim != 3 or array.shape[2] != 3 or array.dtype.kind not in "fiu":
        raise InputError(
            f"{path}: '{name}' is {array.dtype} of shape {shape}; vertices are numbers of shape (T, V, 3) or "
            "(V, 3)"
        )
    if not array.shape[0] or not array.shape[1]:
        raise InputError(f"{path}: '{name}' is empty, of shape {shape}; give at least one frame and vertex")
    return array


def triangles_of(array: np.ndarray, name: str, path: Path) -> np.ndarray:
    """(F, 3) int64 triangles. Faces that repeat for every frame or batch are taken once.

    Raises InputError for another shape, for numbers that are not whole, and for faces that change.
    """
    shape = array.shape
    while array.ndim > 2 and array.shape[0]:
        if not (array == array[:1]).all():
            raise InputError(f"{path}: '{name}' of shape {shape} changes over time; export frame by frame")
        array = array[0]
    if array.ndim != 2 or array.shape[1] not in (3, 4) or array.dtype.kind not in "fiu":
        raise InputError(
            f"{path}: '{name}' is {array.dtype} of shape {shape}; faces are indices of shape (F, 3)"
        )
    # a 64-bit unsigned index above the limit would turn negative
    whole = np.isfinite(array).all() and (array == np.floor(array)).all() and (np.abs(array) < 2**53).all()
    if not whole:
        raise InputError(
            f"{path}: '{name}' holds numbers that are no indices; faces are whole numbers from 0"
        )
    faces = array.astype(np.int64)
    return faces if faces.shape[1] == 3 else np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])


def _surface(
    path: Path,
    vertices: tuple[str, np.ndarray],
    faces: tuple[str, np.ndarray] | None,
    fps: float | None = None,
    body: Content | None = None,
) -> Content:
    frames = frames_of(vertices[1], vertices[0], path)
    triangles = None if faces is None else triangles_of(faces[1], faces[0], path)
    shared: Sequence[np.ndarray] = () if triangles is None else [triangles] * len(frames)
    return Content(len(frames), lambda t: frames[t], shared, body=body, fps=fps)


def _body(arrays: Mapping[str, np.ndarray], path: Path) -> Content | None:
    """The body, if its vertices and its faces are there: without faces nothing can be measured against it."""
    vertices, faces = _first(arrays, BODY), _first(arrays, BODY_FACES)
    return None if vertices is None or faces is None else _surface(path, vertices, faces)


def _changing(found: Mapping[str, np.ndarray], path: Path) -> Content:
    order = found[TOPOLOGY].reshape(-1).tolist()
    try:
        faces = {k: triangles_of(found[f"cloth_faces_{k}"], f"cloth_faces_{k}", path) for k in set(order)}
        frames = [
            frames_of(found[key], key, path)[0]
            for key in (f"cloth_positions_{t:04d}" for t in range(len(order)))
        ]
    except KeyError as error:
        raise InputError(f"{path}: has {TOPOLOGY} but not {error}; export it again") from error
    if not frames:
        raise InputError(f"{path}: {TOPOLOGY} is empty; export it again")
    changing = [faces[k] for k in order]
    return Content(len(frames), lambda t: frames[t], changing, body=_body(found, path), fps=_rate(found))


def _first(found: Mapping[str, np.ndarray], names: Sequence[str]) -> tuple[str, np.ndarray] | None:
    return next(((name, found[name]) for name in names if name in found), None)


def _rate(found: Mapping[str, np.ndarray]) -> float | None:
    """The frame rate; zero, which this project writes for a drape, means none."""
    entry = _first(found, RATE)
    value: Any = None if entry is None or entry[1].size != 1 else entry[1].reshape(-1)[0]
    if value is None or entry is None or entry[1].dtype.kind not in "fiu" or not 0 < float(value) < 1e6:
        return None
    return float(value)
