"""AMASS files: SMPL-H and SMPL-X motion captures, z up on disk, and the same form for our own clips.

A file's pose turns the body about its rest pelvis J_0 and then adds `trans`, in a world whose z is up:
pelvis_z = J_0 + trans. In memory y is up: pelvis = C pelvis_z, root rotation = C R, with
C = rotation by -90 degrees about x, (x, y, z) -> (x, z, -y).

J_0 depends on the shape beta of a licensed body that need not be there; its mean-shape value stands in
for it. The error, some centimetres, is constant over a clip, and `fit_to_body` removes its vertical part.
"""

from __future__ import annotations

import tokenize
import zipfile
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from muslin.garments.errors import InputError
from muslin.sim.motion.motion import Motion
from muslin.sim.motion.rotations import (
    axis_angle_from_quaternion,
    conjugate,
    multiply,
    quaternion_from_axis_angle,
    rotate,
)

Array = NDArray[np.float64]

Y_UP_FROM_Z_UP = quaternion_from_axis_angle(np.array([-0.5 * np.pi, 0.0, 0.0]))

SMPLH_PELVIS = np.array([-0.0018, -0.2233, 0.0282])
"""(3,) metres: rest pelvis of the mean SMPL-H body."""
SMPLX_PELVIS = np.array([0.0031, -0.3514, 0.0120])
"""(3,) metres: rest pelvis of the mean SMPL-X body."""

_WIDTHS = {72: "SMPL", 156: "SMPL-H", 165: "SMPL-X"}
_FRAME_RATES = ("mocap_framerate", "mocap_frame_rate", "fps")
_ALLOWED = (
    "allowed is an AMASS motion: .npz with `poses` (T, 156 SMPL-H, 165 SMPL-X or 72 SMPL) or "
    "`root_orient` (T, 3) + `pose_body` (T, 63), `trans` (T, 3) and `mocap_framerate`"
)

# What reading a damaged archive, or the text that heads its arrays, can raise.
DAMAGE = (
    OSError, ValueError, EOFError, KeyError, RuntimeError, zipfile.BadZipFile, zlib.error, SyntaxError,
    tokenize.TokenError,
)  # fmt: skip

POSE_QUANTUM = 2.0**-13
"""Radians; clips are stored in multiples of it, which compress to about half their size."""
TRANSLATION_QUANTUM = 2.0**-14
"""Metres."""


def read_amass(path: str | Path, rest_pelvis: ArrayLike = (0.0, 0.0, 0.0), name: str | None = None) -> Motion:
    """Read one AMASS motion for a body whose rest pelvis is `rest_pelvis` (3,) metres.

    The first 22 joints are SMPL's own; the fingers of SMPL-H and SMPL-X have no counterpart in SMPL's two
    hand joints, which stay straight. The file's betas, dmpls and face are of another body and are ignored.
    InputError for a file that is missing, unreadable, no motion, or holds NaN or Python objects.
    """
    path = Path(path)
    arrays = _arrays(path)
    pose, kind = _joint_values(path, arrays)
    trans = _numbers(path, "trans", arrays["trans"])
    if trans.shape != (len(pose), 3):
        raise InputError(f"{path}: trans has shape {trans.shape}; allowed is ({len(pose)}, 3), one per pose")
    fps = _frame_rate(path, arrays)
    pelvis = rotate(Y_UP_FROM_Z_UP, trans + (SMPLX_PELVIS if kind == "SMPL-X" else SMPLH_PELVIS))
    pose[:, 0] = axis_angle_from_quaternion(multiply(Y_UP_FROM_Z_UP, quaternion_from_axis_angle(pose[:, 0])))
    source = str(arrays["source"]) if "source" in arrays else f"AMASS {kind} file {path.name}"
    rest = np.asarray(rest_pelvis, dtype=np.float64)
    return Motion(name or path.stem, pose, pelvis - rest, fps, source, rest)


def write_amass(path: str | Path, motion: Motion) -> None:
    """Write `motion` as an AMASS SMPL-H file: poses (T, 156), trans (T, 3), z up, float32 and quantised."""
    root = multiply(conjugate(Y_UP_FROM_Z_UP), quaternion_from_axis_angle(motion.poses[:, 0]))
    poses = np.zeros((motion.num_frames, 156))
    poses[:, :66] = motion.poses[:, :22].reshape(-1, 66)
    poses[:, :3] = axis_angle_from_quaternion(root)
    trans = rotate(conjugate(Y_UP_FROM_Z_UP), motion.pelvis) - SMPLH_PELVIS
    np.savez_compressed(
        path,
        poses=(np.round(poses / POSE_QUANTUM) * POSE_QUANTUM).astype(np.float32),
        trans=(np.round(trans / TRANSLATION_QUANTUM) * TRANSLATION_QUANTUM).astype(np.float32),
        betas=np.zeros(16, dtype=np.float32),
        gender=np.array("neutral"),
        mocap_framerate=np.array(motion.fps),
        source=np.array(motion.source),
    )


def _arrays(path: Path) -> dict[str, NDArray]:
    if not path.is_file():
        raise InputError(f"{path}: no such motion file; {_ALLOWED}")
    try:
        loaded = np.load(path, allow_pickle=False)
        if not isinstance(loaded, np.lib.npyio.NpzFile):
            raise InputError(f"{path}: a single array, not a motion; {_ALLOWED}")
        with loaded as file:
            wanted = {"poses", "root_orient", "pose_body", "trans", "source", *_FRAME_RATES} & set(file.files)
            _check_kind(path, set(file.files))
            return {key: file[key] for key in wanted}
    except InputError:
        raise
    except DAMAGE as error:
        objects = "pickle" in str(error) and zipfile.is_zipfile(path)
        why = "it holds Python objects, which are never loaded" if objects else str(error)
        raise InputError(
            f"{path}: cannot be read ({why}); {_ALLOWED}; save it anew without objects"
        ) from error


def _check_kind(path: Path, keys: set[str]) -> None:
    has_pose = "poses" in keys or {"root_orient", "pose_body"} <= keys
    if has_pose and "trans" in keys:
        return
    if any("stagei" in key or "latent" in key for key in keys):
        what = "an AMASS stage-i file (a subject's shape and markers), not a motion"
    elif "betas" in keys and not has_pose:
        what = "a body shape (like AMASS's shape.npz), not a motion"
    elif has_pose:
        what = "poses without `trans`"
    else:
        what = f"no motion: its arrays are {sorted(keys)[:8]}"
    raise InputError(f"{path}: {what}; {_ALLOWED}; choose the motion file beside it")


def _joint_values(path: Path, arrays: dict[str, NDArray]) -> tuple[Array, str]:
    """(T, 24, 3) poses as stored, z up, and the kind of body they are for."""
    if "poses" not in arrays:
        root = _numbers(path, "root_orient", arrays["root_orient"])
        body = _numbers(path, "pose_body", arrays["pose_body"])
        if root.ndim != 2 or root.shape[1] != 3 or body.shape != (len(root), 63):
            raise InputError(f"{path}: root_orient {root.shape} and pose_body {body.shape}; {_ALLOWED}")
        values, kind = np.concatenate([root, body], axis=1), "SMPL-X"
    else:
        values = _numbers(path, "poses", arrays["poses"])
        if values.ndim != 2 or values.shape[1] not in _WIDTHS:
            raise InputError(f"{path}: poses has shape {values.shape}; {_ALLOWED}")
        kind = _WIDTHS[values.shape[1]]
    if len(values) == 0:
        raise InputError(f"{path}: the motion has no frames; at least one is needed")
    pose = np.zeros((len(values), 24, 3))
    joints = 24 if kind == "SMPL" else 22
    pose[:, :joints] = values[:, : 3 * joints].reshape(-1, joints, 3)
    return pose, kind


def _numbers(path: Path, key: str, array: NDArray) -> Array:
    if array.dtype.kind not in "fiu":
        raise InputError(f"{path}: {key} is of type {array.dtype}; numbers are needed; {_ALLOWED}")
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        raise InputError(
            f"{path}: {key} holds NaN or inf first at frame {int(bad[0, 0])}; every value must be finite: "
            f"cut that part out of the file"
        )
    return array.astype(np.float64)


def _frame_rate(path: Path, arrays: dict[str, NDArray]) -> float:
    for key in _FRAME_RATES:
        if key in arrays:
            value = _numbers(path, key, arrays[key])
            if value.size == 1 and value.item() > 0.0:
                return float(value.item())
            raise InputError(f"{path}: {key} is {value.tolist()}; one positive number of frames a second")
    raise InputError(
        f"{path}: no frame rate; `mocap_framerate` (or `mocap_frame_rate`) is needed; {_ALLOWED}"
    )
