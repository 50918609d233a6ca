"""STL, binary and text: triangles by their corners."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from muslin.eval.read.content import parsing
from muslin.garments.errors import InputError

_HEADER_BYTES = 80
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(path: Path) -> np.ndarray:
    """(F, 3, 3) float64 corners of the triangles; normals are left out.

    Raises InputError for a file that is neither of the size that a binary header asks for, nor text.
    """
    with parsing(path, "an STL file"):
        data = path.read_bytes()
        start = _HEADER_BYTES + 4
        count = struct.unpack_from("<I", data, _HEADER_BYTES)[0] if len(data) >= start else -1
        if count >= 0 and len(data) == start + count * _TRIANGLE.itemsize:
            return np.frombuffer(data, dtype=_TRIANGLE, offset=start)["corners"].astype(np.float64)
        if not data.lstrip().startswith(b"solid"):
            raise InputError(
                f"{path}: not an STL file: {len(data)} bytes, where its header asks for {count} triangles, "
                "and no text that begins with solid"
            )
        return _corners_of_text(data.decode("latin1"))


def _corners_of_text(text: str) -> np.ndarray:
    """The corners between each facet and its endfacet; anything else in a facet is an error."""
    corners: list[list[float]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        match line.lower().split():
            case ["vertex", x, y, z]:
                corners.append([float(x), float(y), float(z)])
            case ["endfacet"] if len(corners) % 3:
                raise ValueError(f"line {number}: a facet of other than 3 vertices")
            case ["vertex", *_]:
                raise ValueError(f"line {number}: a vertex has 3 numbers")
            case ["solid" | "endsolid" | "facet" | "outer" | "endloop" | "endfacet", *_] | []:
                continue
            case _:
                raise ValueError(f"line {number}: {line.strip()[:40]!r}")
    if not text.split()[-2:] or "endsolid" not in text.lower().splitlines()[-1]:
        raise ValueError("the text ends without endsolid")
    return np.array(corners, dtype=np.float64).reshape(-1, 3, 3)
