"""What a displacement map is drawn for: the body, its pose and motion, the design and the fabric."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from torch import Tensor

from muslin.garments.errors import InputError
from muslin.learn.drape.fabric import FIGURES, fabric_figures
from muslin.learn.drape.world import shape_tensor
from muslin.sim.body.joints import JOINT
from muslin.sim.body.rotation import rotation_matrices
from muslin.sim.dataset.sample import BodyTrack, Sample

JOINTS = tuple(
    JOINT[name]
    for name in (
        "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "spine3", "neck",
        "left_collar", "right_collar", "left_shoulder", "right_shoulder", "left_elbow", "right_elbow",
    )
)  # fmt: skip
"""Joints that cloth sees: hands, feet and head move nothing that it lies on."""

DECIMETRES = 10.0


@dataclass(frozen=True)
class Condition:
    """Which of the numbers there are, a frame:

    | block | numbers | |
    | --- | --- | --- |
    | shape | betas | standard deviations |
    | design | names | design parameters, decimetres |
    | pose | 3 + 6 a joint | direction of gravity as seen from the root; first two columns of the rotation of each of JOINTS |
    | motion | 6 + 3 a joint | velocity, m/s, and rate of turn, rad/s, of the root as seen from it; rates of JOINTS |
    | fabric | FIGURES | see `fabric_figures` |

    So nothing depends on where the body stands or which way it faces. The thesis has shape, pose and design;
    motion and fabric, without which neither inertia nor another cloth can be told, are options. So are
    `fields`, which are no part of these numbers: FIELDS more for every place of the cloth.
    """  # noqa: E501

    betas: int
    names: tuple[str, ...]
    pose: bool = True
    motion: bool = True
    fabric: bool = False
    fields: bool = True

    @staticmethod
    def from_json(values: Mapping[str, Any]) -> Condition:
        """The inverse of `dataclasses.asdict`, by way of JSON."""
        return Condition(**{**values, "names": tuple(values["names"])})

    @property
    def count(self) -> int:
        """Numbers in all."""
        moving = 6 + 3 * len(JOINTS) if self.motion else 0
        posed = self.pose * (3 + 6 * len(JOINTS))
        return self.betas + len(self.names) + posed + moving + FIGURES * self.fabric

    def of(self, track: BodyTrack, fps: float, parameters: Mapping[str, float], fabric: str) -> Tensor:
        """(T, count) of every frame of a moving body. Raises InputError for a missing design parameter."""
        missing = [name for name in self.names if name not in parameters]
        if missing:
            raise InputError(f"design parameter {missing[0]!r} is missing; give {', '.join(self.names)}")
        design = [DECIMETRES * parameters[name] for name in self.names]
        constant = [shape_tensor(track.beta, self.betas), torch.tensor(design, dtype=torch.float32)]
        frames = [np.zeros((len(track.poses), 0))]
        if self.pose:
            frames.append(pose_features(track.poses))
        if self.motion:
            frames.append(motion_features(track.poses, track.translations, fps))
        moving = torch.from_numpy(np.concatenate(frames, axis=1).astype(np.float32))
        said = torch.cat(constant).expand(len(moving), -1)
        parts = [said, moving]
        if self.fabric:
            parts.append(fabric_figures([fabric]).expand(len(moving), -1))
        return torch.cat(parts, dim=1)


def pose_features(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """(T, 3 + 6 J) of poses (T, 24, 3), radians.

    The first two columns of a rotation matrix are a continuous form of it (Zhou et al. 2019, "On the
    Continuity of Rotation Representations in Neural Networks").
    """
    rotations = rotation_matrices(poses)
    down = -rotations[:, 0, 1, :]
    columns = rotations[:, list(JOINTS)][..., :2]
    return np.concatenate([down, columns.reshape(len(poses), -1)], axis=1)


def motion_features(
    poses: NDArray[np.float64], translations: NDArray[np.float64], fps: float
) -> NDArray[np.float64]:
    """(T, 6 + 3 J) rates of poses (T, 24, 3) and translations (T, 3), from the frame before to each; the
    first frame has those of the second, a single one none."""
    if len(poses) == 1:
        return np.zeros((1, 6 + 3 * len(JOINTS)))
    turned = rotation_matrices(poses[:, [0, *JOINTS]])
    step = np.swapaxes(turned[:-1], -1, -2) @ turned[1:]
    rates = Rotation.from_matrix(step.reshape(-1, 3, 3)).as_rotvec().reshape(len(step), -1) * fps
    velocity = np.einsum("tji,tj->ti", turned[1:, 0], np.diff(translations, axis=0)) * fps
    moving = np.concatenate([velocity, rates], axis=1)
    return np.concatenate([moving[:1], moving])


def varied_parameters(samples: Iterable[Sample]) -> tuple[str, ...]:
    """Names of the design parameters that are not the same in all samples."""
    found = [sample.frame_garment(0).parameters for sample in samples]
    return tuple(name for name, value in found[0].items() if any(own[name] != value for own in found))


def used_betas(samples: Iterable[Sample]) -> int:
    """Number of shape coefficients up to the last that some sample uses, at least one."""
    used = [np.flatnonzero(sample.body.beta) for sample in samples if sample.body is not None]
    return max((int(own.max()) + 1 for own in used if len(own)), default=1)
