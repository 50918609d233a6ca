"""Reading of Wavefront OBJ files: vertices, uv, faces and groups, strictly checked."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError

MAX_INDEX = int(np.iinfo(np.int32).max)


@dataclass(frozen=True, eq=False)
class ObjContent:
    """What an OBJ file holds. Polygons are split into fans of triangles.

    vertices: (V, 3) float64, metres; faces: (F, 3) int32
    uv: (P, 2) float64; texture_faces: (F, 3) int32, or None if a face lacks uv
    groups: names; face_group: (F,) int32
    name, parameters, layout, panel_vertices (P, 3: x, y, sewn vertex): from this project's comment lines, if
    any
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    uv: NDArray[np.float64]
    texture_faces: NDArray[np.int32] | None
    groups: list[str]
    face_group: NDArray[np.int32]
    name: str
    parameters: dict[str, float]
    layout: str
    panel_vertices: NDArray[np.float64] | None


def read_obj(path: Path | str) -> ObjContent:
    """Parse an OBJ file; InputError names file, line and text of what is wrong."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}; give the path of an OBJ file") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not a text file; give the path of an OBJ file") from error
    parser = _Parser(path.stem)
    for number, line in enumerate(text.splitlines(), start=1):
        try:
            parser.line(line.split())
        except (ValueError, TypeError, AttributeError, IndexError) as error:
            raise InputError(
                f"{path}, line {number}: '{line.strip()[:60]}' cannot be read: {error}"
            ) from error
    if not parser.faces or not parser.vertices:
        raise InputError(f"{path} is empty: {len(parser.vertices)} vertices, {len(parser.faces)} faces")
    return parser.content(path)


@dataclass
class _Parser:
    name: str
    parameters: dict[str, float] = field(default_factory=dict)
    layout: str = "sewn"
    vertices: list[list[float]] = field(default_factory=list)
    uv: list[list[float]] = field(default_factory=list)
    panel_vertices: list[list[float]] = field(default_factory=list)
    faces: list[list[int]] = field(default_factory=list)
    texture_faces: list[list[int]] = field(default_factory=list)
    groups: list[str] = field(default_factory=list)
    face_group: list[int] = field(default_factory=list)
    group: str = "panel"

    def line(self, words: list[str]) -> None:
        match words:
            case ["v", x, y, z, *_]:
                self.vertices.append([float(x), float(y), float(z)])
            case ["vt", u, v, *_]:
                self.uv.append([float(u), float(v)])
            case ["f", *corners]:
                self.face(corners)
            case ["g", *names]:
                self.group = "_".join(names) or "panel"
            case ["#", "muslin", "panel_vertex", x, y, vertex]:
                self.panel_vertices.append([float(x), float(y), int(vertex)])
            case ["#", "muslin", "garment", name, *rest]:
                self.name = name
                self.parameters = {key: float(value) for key, value in json.loads(" ".join(rest)).items()}
            case ["#", "muslin", "layout", layout]:
                self.layout = layout
            case ["v" | "vt", *_]:
                raise ValueError("too few numbers")

    def face(self, corners: list[str]) -> None:
        if len(corners) < 3:
            raise ValueError("a face needs at least 3 corners")
        parts = [corner.split("/") for corner in corners]
        vertices = [_index(part[0], len(self.vertices)) for part in parts]
        textured = all(len(part) > 1 and part[1] for part in parts)
        texture = [_index(part[1], len(self.uv)) for part in parts] if textured else []
        if self.group not in self.groups:
            self.groups.append(self.group)
        for k in range(1, len(corners) - 1):
            self.faces.append([vertices[0], vertices[k], vertices[k + 1]])
            self.face_group.append(self.groups.index(self.group))
            if textured:
                self.texture_faces.append([texture[0], texture[k], texture[k + 1]])

    def content(self, path: Path) -> ObjContent:
        vertices = np.array(self.vertices, dtype=np.float64)
        faces = np.array(self.faces, dtype=np.int32)
        if not np.isfinite(vertices).all():
            bad = int(np.argmin(np.isfinite(vertices).all(axis=1)))
            raise InputError(f"{path}: vertex {bad + 1} is NaN or infinite; all must be finite metres")
        if faces.max() >= len(vertices):
            raise InputError(f"{path}: a face names vertex {faces.max() + 1}; allowed: 1 to {len(vertices)}")
        textured = len(self.texture_faces) == len(self.faces)
        texture_faces = np.array(self.texture_faces, dtype=np.int32) if textured else None
        if texture_faces is not None and texture_faces.max() >= len(self.uv):
            raise InputError(
                f"{path}: a face names uv {texture_faces.max() + 1}; allowed: 1 to {len(self.uv)}"
            )
        return ObjContent(
            vertices=vertices,
            faces=faces,
            uv=np.array(self.uv, dtype=np.float64).reshape(-1, 2),
            texture_faces=texture_faces,
            groups=self.groups,
            face_group=np.array(self.face_group, dtype=np.int32),
            name=self.name,
            parameters=self.parameters,
            layout=self.layout,
            panel_vertices=np.array(self.panel_vertices, dtype=np.float64) if self.panel_vertices else None,
        )


def _index(word: str, count: int) -> int:
    """Zero-based index of an OBJ index, which counts from 1, or back from the last element if negative."""
    index = int(word)
    if index == 0 or index < -count:
        raise ValueError(f"index {index}; indices count from 1")
    if index > MAX_INDEX:
        raise ValueError(f"index {index}; the largest is {MAX_INDEX}")
    return index - 1 if index > 0 else count + index
