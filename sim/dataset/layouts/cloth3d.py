"""CLOTH3D's form: half-precision point caches relative to the body's root, z up, and info.mat.

    GARMENT.obj, GARMENT.pc16       topology and uv in the first frame; all frames
    body.obj, body.pc16             what the cloth lies on; CLOTH3D has SMPL's parameters alone
    info.mat                        poses (72, T), shape (10 or more,), gender (0 female, 1 male),
                                    trans (3, T), zrot, outfit {GARMENT: {fabric, texture}}, fps

With Z, the turn by 90° about x that takes y up to z up, G_0 the rotation of the root, and J_0 the root of the
shaped body in T-pose:

    trans = Z (J_0 + t),    poses[:3] = log(Z G_0),    pc16 = float16(Z x - trans)

so that a reader that poses the same body, takes J_0 off and adds trans has the body of this dataset, and
pc16 + trans is the garment. Without a body of SMPL's form trans is zero, and poses and shape are absent.

Source: Bertiche, Madadi, Escalera (2020), "CLOTH3D: Clothed 3D Humans", and the readers of its starter kit.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from muslin.sim.dataset.export import write_obj
from muslin.sim.dataset.layouts.layout import Facts, Layout
from muslin.sim.dataset.parts import Part, sample_parts
from muslin.sim.dataset.pc2 import write_pc2
from muslin.sim.dataset.sample import BodyTrack, Sample, body_model

_Y_TO_Z = Rotation.from_euler("x", 90, degrees=True)
_PLAIN = {"type": "color", "data": np.array([0.8, 0.8, 0.8])}
_LEAST_BETAS = 10


def _write(sample: Sample, folder: Path, out: Path, body: bool) -> Facts:
    garment = garment_name(sample.garment.name)
    info: dict[str, Any] = {"zrot": 0.0, "fps": sample.fps or 0.0}
    info["outfit"] = {garment: {"fabric": sample.fabric, "texture": _PLAIN}}
    trans = np.zeros((sample.num_frames, 3))
    if sample.body is not None:
        trans = _root(sample.body)
        info |= _body_info(sample.body)
    savemat(folder / "info.mat", info | {"trans": trans.T}, long_field_names=True)
    error = 0.0
    for part in sample_parts(sample, body):
        assert isinstance(part, Part)  # samples of changing topology are not given to this layout
        name = "body" if part.name == "body" else garment
        turned = _y_to_z(part.positions) - trans[:, None]
        error = max(error, float(np.abs(turned.astype(np.float16) - turned).max()))
        first = Part(name, turned[:1], part.faces, part.uv, part.uv_faces)
        write_obj(folder / f"{name}.obj", first)
        write_pc2(folder / f"{name}.pc16", turned, dtype="<f2")
    return {"garment": garment, "rounding_error_m": error}


def garment_name(name: str) -> str:
    """A garment's name as that of a file and of a field of a MATLAB struct."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)[:50]
    return plain if plain[:1].isalpha() and plain != "body" else f"garment_{plain}"


def _root(track: BodyTrack) -> np.ndarray:
    """(T, 3) positions of the root joint, metres, z up."""
    return _Y_TO_Z.apply(body_model(track).rest_joints(track.beta)[0] + track.translations)


def _body_info(track: BodyTrack) -> dict[str, Any]:
    poses = track.poses.copy()
    poses[:, 0] = (_Y_TO_Z * Rotation.from_rotvec(poses[:, 0])).as_rotvec()
    shape = np.zeros(max(_LEAST_BETAS, len(track.beta)))
    shape[: len(track.beta)] = track.beta
    name = Path(track.model).stem.lower()
    male = "male" in name and "female" not in name
    return {"poses": poses.reshape(len(poses), 72).T, "shape": shape, "gender": int(male)}


def _y_to_z(positions: np.ndarray) -> np.ndarray:
    x, y, z = np.moveaxis(positions.astype(np.float64), -1, 0)
    return np.stack([x, -z, y], axis=-1)


CLOTH3D = Layout(_write)
