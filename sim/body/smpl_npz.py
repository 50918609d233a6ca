"""Reads SMPL arrays from .npz without unpickling anything unchecked."""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Collection
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.lib import format as npy

from muslin.garments.errors import InputError
from muslin.sim.body.smpl_pickle import unpickle_arrays

_HEADER_READERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}


def read_npz(path: Path, keys: Collection[str]) -> dict[str, Any]:
    """The named arrays of an .npz file; its other members stay unread.

    A member of dtype object (SMPL files converted together with their scipy regressor have one) is a pickle
    and goes through the same allow-list as a .pkl file.

    Raises:
        InputError: no .npz file, damaged, or with a forbidden pickle.
    """
    arrays: dict[str, Any] = {}
    try:
        with zipfile.ZipFile(path) as archive:
            for member in archive.namelist():
                key = member.removesuffix(".npy")
                if key in keys:
                    arrays[key] = _read_member(archive.read(member), f"{path}, {key}")
    except (
        zipfile.BadZipFile, zlib.error, EOFError, ValueError, OSError, RuntimeError, SyntaxError, TokenError
    ) as error:  # fmt: skip
        raise InputError(
            f"{path}: no readable .npz archive ({error}); give an intact SMPL .npz file"
        ) from error
    return arrays


def _read_member(content: bytes, label: str) -> Any:
    stream = io.BytesIO(content)
    version = npy.read_magic(stream)
    if version not in _HEADER_READERS:
        raise ValueError(f"{label} has unknown .npy version {version}")
    shape, _, dtype = _HEADER_READERS[version](stream)
    if not dtype.hasobject:
        return np.lib.format.read_array(io.BytesIO(content), allow_pickle=False)
    value = unpickle_arrays(stream, label)
    return value[0] if shape == () and isinstance(value, list) and len(value) == 1 else value
