"""What a reader of one format hands over: frames in the file's own units, before anything is converted."""

from __future__ import annotations

import re
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh

Up = Literal["y", "z"]

CLOTH_NAMES = ("cloth", "garment")
BODY_NAMES = ("body", "obstacle", "avatar", "human", "collider")

# fooBar and FOO_bar are two words each
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+")

# What parsers raise on a damaged file.
DAMAGE = (
    ValueError, TypeError, LookupError, AttributeError, ArithmeticError, NotImplementedError, AssertionError,
    OSError, EOFError, MemoryError, RecursionError, SyntaxError, struct.error,
    zlib.error, zipfile.BadZipFile, tokenize.TokenError,
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Content:
    """Frames of one surface as a file holds them.

    read       frame -> (V_t, 3), numbers of any precision, in the file's units
    faces      a frame: (F_t, 3) int; frames of one topology share one object; empty if the file has none
    garments   a frame: its mesh with panels; empty where panels are not known
    body       what the cloth lies on, in the same units
    fps        frames per second, if the file says so
    metres     length of one unit of the file, metres, if the file says so
    up         the axis that points up, if the file says so
    """

    num_frames: int
    read: Callable[[int], np.ndarray]
    faces: Sequence[np.ndarray] = ()
    garments: Sequence[GarmentMesh] = ()
    body: Content | None = None
    fps: float | None = None
    metres: float | None = None
    up: Up | None = None
    notes: tuple[str, ...] = ()


@contextmanager
def parsing(path: Path, kind: str) -> Iterator[None]:
    """Turn what a parser raises on a damaged file into an InputError that names the file.

    kind   what the file should have been, e.g. "a NumPy file"
    """
    try:
        yield
    except DAMAGE as error:
        said = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        raise InputError(f"{path}: not readable as {kind} ({said}); give an intact file") from error


def is_body(name: str) -> bool:
    """Whether a part, a series or a file is named as what cloth lies on: body, walk_body, ObstacleShape …"""
    return _last_word(name) in BODY_NAMES


def is_cloth(name: str) -> bool:
    """Whether a part, a series or a file is named as the garment. Of several such words the last counts."""
    return _last_word(name) in CLOTH_NAMES


def cloth_and_body(names: Iterable[str], path: Path, kind: str) -> tuple[str, str | None]:
    """Which of the named parts is the garment, and which its body: (name, name or None).

    The garment is the part named as one, or the only one that is not named as a body. Raises InputError if
    that leaves no or several parts.
    """
    parts = list(names)
    bodies = [name for name in parts if is_body(name)]
    others = [name for name in parts if name not in bodies]
    cloths = [name for name in others if is_cloth(name)] or others or bodies
    if len(cloths) != 1:
        shown = ", ".join(repr(name) for name in cloths[:6]) or "none"
        raise InputError(
            f"{path}: which {kind} is the garment? There are {len(cloths)}: {shown}; keep one, or name one "
            f"of them {CLOTH_NAMES[0]}"
        )
    return cloths[0], bodies[0] if len(bodies) == 1 and bodies != cloths else None


def _last_word(name: str) -> str:
    words = [word.lower() for word in _WORD.findall(name)]
    return next((word for word in reversed(words) if word in CLOTH_NAMES + BODY_NAMES), "")
