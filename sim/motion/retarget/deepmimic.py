"""DeepMimic's motion files: JSON, one row of 44 numbers a frame, for the humanoid of pybullet's URDF."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from muslin.garments.errors import InputError
from muslin.sim.motion.retarget.source import SourceMotion
from muslin.sim.motion.rotations import (
    about_y,
    aligned,
    conjugate,
    multiply,
    quaternion_from_axis_angle,
    rotate,
    slerp,
)

# name, parent, offset from the parent in metres (the URDF draws it four times as large, y up, facing +x,
# right along +z), degrees of freedom: 4 a quaternion (w, x, y, z), 1 a hinge about +z, 0 fixed.
_JOINTS: tuple[tuple[str, str, tuple[float, float, float], int], ...] = (
    ("root", "", (0.0, 0.0, 0.0), 4),
    ("chest", "root", (0.0, 0.236151, 0.0), 4),
    ("neck", "chest", (0.0, 0.223894, 0.0), 4),
    ("right_hip", "root", (0.0, 0.0, 0.084887), 4),
    ("right_knee", "right_hip", (0.0, -0.421546, 0.0), 1),
    ("right_ankle", "right_knee", (0.0, -0.409870, 0.0), 4),
    ("right_shoulder", "chest", (-0.024050, 0.243500, 0.183110), 4),
    ("right_elbow", "right_shoulder", (0.0, -0.274788, 0.0), 1),
    ("right_wrist", "right_elbow", (0.0, -0.258947, 0.0), 0),
    ("left_hip", "root", (0.0, 0.0, -0.084887), 4),
    ("left_knee", "left_hip", (0.0, -0.421546, 0.0), 1),
    ("left_ankle", "left_knee", (0.0, -0.409870, 0.0), 4),
    ("left_shoulder", "chest", (-0.024050, 0.243500, -0.183110), 4),
    ("left_elbow", "left_shoulder", (0.0, -0.274788, 0.0), 1),
    ("left_wrist", "left_elbow", (0.0, -0.258947, 0.0), 0),
)

_ROW = 44
_FACE_Z = about_y(-0.5 * np.pi)  # +x (forward) becomes +z, +z (right) becomes -x


def read_deepmimic(path: str | Path, source: str, fps: float | None = None) -> SourceMotion:
    """Read a DeepMimic clip, at its own usual frame rate or resampled by slerp to `fps`.

    Row: seconds until the next frame, root position (3), root quaternion, then `_JOINTS` in order.
    """
    path = Path(path)
    rows = np.array(json.loads(path.read_text(encoding="ascii"))["Frames"], dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != _ROW:
        raise InputError(f"{path}: rows of shape {rows.shape}; a humanoid clip has {_ROW} numbers a frame")
    times = np.concatenate([[0.0], np.cumsum(rows[:-1, 0])])
    fps = fps or float(np.round(1.0 / np.median(rows[:-1, 0])))
    wanted = np.arange(int(np.floor(times[-1] * fps + 0.05)) + 1) / fps
    place = np.interp(wanted, times, np.arange(len(times)))
    before = np.minimum(place.astype(int), len(times) - 2)
    weight = place - before

    names = tuple(name for name, *_ in _JOINTS)
    rotations = np.empty((len(wanted), len(names), 4))
    positions = np.empty((len(wanted), len(names), 3))
    rest = np.zeros((len(names), 3))
    root = (1 - weight[:, None]) * rows[before, 1:4] + weight[:, None] * rows[before + 1, 1:4]
    column = 4
    for joint, (_, parent_name, offset, freedom) in enumerate(_JOINTS):
        local = aligned(_local(rows[:, column : column + freedom], freedom))
        local = slerp(local[before], local[before + 1], weight)
        column += freedom
        if not parent_name:
            rotations[:, joint], positions[:, joint] = local, root
            continue
        parent = names.index(parent_name)
        rotations[:, joint] = multiply(rotations[:, parent], local)
        positions[:, joint] = positions[:, parent] + rotate(rotations[:, parent], np.array(offset))
        rest[joint] = rest[parent] + offset
    turned = multiply(multiply(_FACE_Z, rotations), conjugate(_FACE_Z))
    return SourceMotion(
        path.stem, names, rotate(_FACE_Z, rest), turned, rotate(_FACE_Z, positions), fps, source
    )


def _local(values: np.ndarray, freedom: int) -> np.ndarray:
    if freedom == 4:
        return values / np.linalg.norm(values, axis=1, keepdims=True)
    if freedom == 1:
        return quaternion_from_axis_angle(values * np.array([0.0, 0.0, 1.0]))
    return np.tile([1.0, 0.0, 0.0, 0.0], (len(values), 1))
