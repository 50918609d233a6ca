"""Reads SMPL arrays from .npz without unpickling anything unchecked."""

from __future__ import annotations

import io
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy

from muslin.garments.errors import InputError
from muslin.sim.body.smpl_pickle import unpickle_arrays

_HEADER_READERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}

# What a body is made of; other members of the archive stay unread.
BODY_KEYS = (
    "v_template", "shapedirs", "shapedirs_scale", "posedirs", "posedirs_scale", "weights", "weights_scale",
    "J_regressor", "joint_template", "joint_shapedirs", "kintree_table", "f", "source",
)  # fmt: skip


def read_npz(path: Path) -> dict[str, Any]:
    """Arrays of an .npz file by key.

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
                if key in BODY_KEYS:
                    arrays[key] = _read_member(archive.read(member), f"{path}, {key}")
    except (zipfile.BadZipFile, zlib.error, EOFError, ValueError, OSError) as error:
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
