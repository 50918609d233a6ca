"""Folders: which samples are in one, and which of its files belong to each."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from muslin.eval.read.content import CLOTH_NAMES, Content, is_body
from muslin.eval.read.formats import MOVING, read_file
from muslin.eval.read.meshes import MESH_SUFFIXES
from muslin.eval.read.sequence import read_sequence, series_of
from muslin.garments.errors import InputError
from muslin.sim.dataset.schema import HEADER

Source = Callable[[], Content]

DEEPEST = 2  # folders below the one that is opened
_CLOTH_ENDING = re.compile(rf"[_\-. ]({'|'.join(CLOTH_NAMES)})$", re.IGNORECASE)
_ONE_A_FRAME = (".npy", ".npz")


def sources_in(folder: Path, ids: frozenset[str] = frozenset(), depth: int = 0) -> dict[str, Source]:
    """How to read each sample in a folder, by name.

    Files of moving surfaces are a sample each, named by their stem (walk.pkl, walk_cloth.pc2: walk), with the
    body beside them (walk_body.pc2). Mesh files are the frames of one sequence, or a drape each if they are
    named as `ids`. Else each subfolder is a sample, or several (NAME/GARMENT).

    Raises InputError if nothing of that is there, or two files claim one name.
    """
    entries = sorted(p for p in folder.iterdir() if not p.name.startswith((".", "partial-")))
    files = [p for p in entries if p.is_file()]
    moving = [p for p in files if p.suffix.lower() in MOVING and not is_faces(p.stem)]
    meshes = [p for p in files if p.suffix.lower() in MESH_SUFFIXES]
    if moving:
        return _frame_by_frame(folder, moving, ids) or _one_each(moving)
    if meshes:
        if any(sample_name(file) in ids for file in meshes):
            return _one_each(meshes)
        return {folder.name: lambda: read_sequence(folder, meshes)}
    found: dict[str, Source] = {}
    for below in (p for p in entries if p.is_dir() and depth < DEEPEST):
        inner = _quietly(below, ids, depth + 1)
        found |= {below.name if len(inner) == 1 else f"{below.name}/{name}": s for name, s in inner.items()}
    if not found and depth == 0:
        raise InputError(
            f"{folder}: neither a dataset (no {HEADER}) nor a folder of meshes "
            f"({', '.join((*MESH_SUFFIXES, *MOVING))})"
        )
    return found


def sample_name(file: Path) -> str:
    """walk.pkl, walk_cloth.pc2, walk-Garment.obj: walk."""
    return _CLOTH_ENDING.sub("", file.stem)


def is_faces(stem: str) -> bool:
    """Whether a .npy file is named as faces, not as vertices: faces, walk_faces."""
    return stem.lower() == "faces" or stem.lower().endswith("_faces")


def _quietly(folder: Path, ids: frozenset[str], depth: int) -> dict[str, Source]:
    return {} if (folder / HEADER).is_file() else sources_in(folder, ids, depth)


def _one_each(files: Sequence[Path]) -> dict[str, Source]:
    bodies = [file for file in files if is_body(file.stem)]
    garments = [file for file in files if file not in bodies] or bodies
    if garments == bodies:
        bodies = []
    sources: dict[str, Source] = {}
    taken: dict[str, Path] = {}
    for file in garments:
        name = sample_name(file)
        if name in taken:
            raise InputError(f"{taken[name]} and {file.name} are both {name!r}; keep one of them")
        taken[name] = file
        own = [body for body in bodies if body.stem.lower().startswith(name.lower())]
        own = own or (bodies if len(garments) == 1 and len(bodies) == 1 else [])
        sources[name] = _with_body(file, own[0] if len(own) == 1 else None)
    return sources


def _with_body(file: Path, body: Path | None) -> Source:
    def read() -> Content:
        content = read_file(file)
        return content if body is None or content.body else replace(content, body=read_file(body))

    return read


def _frame_by_frame(folder: Path, files: Sequence[Path], ids: frozenset[str]) -> dict[str, Source]:
    """The files as one sequence, if they are arrays of one frame each, numbered; else nothing."""
    arrays = all(file.suffix.lower() in _ONE_A_FRAME for file in files)
    if len(files) < 2 or not arrays or any(sample_name(file) in ids for file in files):
        return {}
    series = series_of(files)
    if len(series) != 1 or series[0].name == "":
        return {}
    contents = [read_file(file) for file in series[0].files]
    if any(content.num_frames != 1 for content in contents):
        return {}
    return {folder.name: lambda: _sequence(contents, series[0].remarks())}


def _sequence(contents: Sequence[Content], notes: tuple[str, ...]) -> Content:
    faces: list[np.ndarray] = []
    for content in contents:
        now = content.faces[0] if content.faces else None
        if now is not None:
            faces.append(faces[-1] if faces and np.array_equal(faces[-1], now) else now)
    return Content(
        len(contents),
        lambda t: contents[t].read(0),
        faces if len(faces) == len(contents) else (),
        fps=contents[0].fps,
        notes=notes,
    )
