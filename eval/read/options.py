"""How a file is read: what it does not say itself, and how its numbers become metres, y up."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from muslin.eval.read.check import check_indices
from muslin.eval.read.content import Content, Up
from muslin.eval.read.formats import read_file
from muslin.eval.read.meshes import read_mesh
from muslin.eval.read.track import Frames, MovingSurface, Track
from muslin.garments.errors import InputError

# (x, y, z) of a z-up file is (x, z, -y) y-up
Z_TO_Y = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


@dataclass(frozen=True)
class ReadOptions:
    """What is known of a file from elsewhere.

    fps     frames per second; a rate that the file says counts more
    scale   metres a unit of the file, > 0; None takes what the file says, else metres, to be checked by size
    up      the axis that points up, "y" or "z"; None takes what the file says, else y
    faces   a mesh file with the triangles, for files that have vertices alone
    body    a file with what the cloth lies on, in metres; it counts more than a body in the file itself
    """

    fps: float | None = None
    scale: float | None = None
    up: Up | None = None
    faces: Path | None = None
    body: Path | None = None

    def __post_init__(self) -> None:
        for name, value in (("fps", self.fps), ("scale", self.scale)):
            if value is not None and not 0.0 < value < np.inf:
                raise InputError(f"{name} = {value}: must be a number greater than zero")
        if self.up not in (None, "y", "z"):
            raise InputError(f"up = {self.up!r}: must be y or z")


def track_of(name: str, content: Content, options: ReadOptions) -> Track:
    """What a file holds, as a track in metres, y up. Raises InputError if options and file do not fit."""
    for what, value in (("a unit", content.metres), ("frames per second", content.fps)):
        if value is not None and not 0.0 < value < np.inf:
            raise InputError(f"{name}: the file says {value} for {what}; it must be greater than zero")
    scale = options.scale or content.metres
    transform = _transform(scale or 1.0, options.up or content.up or "y")
    notes = content.notes
    if options.fps is not None and content.fps is not None and options.fps != content.fps:
        notes += (
            f"{name}: the file says {content.fps:g} frames per second, so {options.fps:g} is not used for it",
        )
    moving = content.num_frames > 1
    return Track(
        name,
        Frames(content.num_frames, content.read, transform),
        content.faces or _given_faces(content, options.faces),
        content.garments,
        (content.fps or options.fps) if moving else None,
        body=body_of(options.body) if options.body else _body(f"the body in {name}", content.body, transform),
        units_known=scale is not None,
        notes=notes,
    )


def body_of(path: Path) -> MovingSurface:
    """What a file of any format holds, as a body, in metres or the unit that the file says."""
    if not path.is_file():
        raise InputError(f"{path}: no such file; give a file with the body")
    content = read_file(path)
    content = content.body or content
    body = _body(str(path), content, _transform(content.metres or 1.0, content.up or "y"))
    if body is None:
        raise InputError(f"{path}: has no faces of one topology; give a body as a mesh, npz or USD")
    return body


def _body(name: str, content: Content | None, transform: np.ndarray | None) -> MovingSurface | None:
    if content is None or not content.faces:
        return None
    if any(not np.array_equal(faces, content.faces[0]) for faces in content.faces):
        raise InputError(f"{name}: its topology changes over time; a body keeps its triangles")
    frames = Frames(content.num_frames, content.read, transform)
    check_indices(content.faces[0], len(frames[0]), name)
    return MovingSurface(name, frames, content.faces[0])


def _given_faces(content: Content, path: Path | None) -> list[np.ndarray]:
    return [] if path is None else [read_mesh(path).faces] * content.num_frames


def _transform(scale: float, up: Up) -> np.ndarray | None:
    """(3, 3) from the file's numbers to metres, y up; None where nothing changes."""
    if scale == 1.0 and up == "y":
        return None
    return scale * (Z_TO_Y if up == "z" else np.eye(3))
