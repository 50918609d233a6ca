"""Adult bodies sampled from anny, turned to SMPL's axes and joints."""

from __future__ import annotations

from dataclasses import dataclass

import anny
import numpy as np
import torch
from anny.shape_distribution import SimpleShapeDistribution
from numpy.typing import NDArray

from muslin.sim.body.joints import JOINT, JOINT_NAMES, NUM_JOINTS

ADULT_AGES = (18.0, 75.0)
# anny's gender axis: 0 is male, 1 is female.
GENDER_MIX = {"female": (1.0,), "male": (0.0,), "neutral": (0.0, 1.0)}
BODIES_PER_CALL = 100
LARGEST_INFLUENCES = 6

# The bone whose head is the joint.
_MIDLINE_BONES = {"pelvis": "root", "spine1": "spine04", "spine2": "spine02", "spine3": "spine01",
                  "neck": "neck01", "head": "head"}  # fmt: skip
_SIDE_BONES = {"hip": "upperleg01", "knee": "lowerleg01", "ankle": "foot", "foot": "toe2-1",
               "collar": "clavicle", "shoulder": "upperarm01", "elbow": "lowerarm01", "wrist": "wrist",
               "hand": "finger3-1"}  # fmt: skip


@dataclass(frozen=True)
class BodySamples:
    """Bodies in anny's A-pose, y up, facing +z, metres.

    vertices: (N, V, 3) float32; joints: (N, 24, 3); weights: (V, 24); faces: (F, 3) int32
    """

    vertices: NDArray[np.float32]
    joints: NDArray[np.float64]
    weights: NDArray[np.float64]
    faces: NDArray[np.int32]


def sample_bodies(gender: str, count: int, seed: int) -> BodySamples:
    """Bodies of adults drawn from anny's own age-conditioned distribution, not uniformly over its sliders."""
    torch.manual_seed(seed)
    model = anny.Anny(rig="anny", topology="notoes", skinning_method="lbs")
    joint_of_bone, head_bones = _bone_maps(list(model.bone_labels), list(model.bone_parents))
    vertices, joints = [], []
    mix = GENDER_MIX[gender]
    per_gender = count // len(mix)
    for value in mix:
        distribution = _adults(model, value)
        for start in range(0, per_gender, BODIES_PER_CALL):
            _, phenotype = distribution.sample(min(BODIES_PER_CALL, per_gender - start))
            with torch.no_grad():
                rest = model.get_rest_model(model.get_phenotype_blendshape_coefficients(**phenotype))
            vertices.append(_to_y_up(rest["rest_vertices"].numpy()).astype(np.float32))
            joints.append(_to_y_up(rest["rest_bone_heads"].numpy())[:, head_bones])
    bone_weights = model.dense_vertex_bone_weights.numpy()
    weights = np.zeros((len(bone_weights), NUM_JOINTS))
    np.add.at(weights.T, joint_of_bone, bone_weights.T)
    return BodySamples(
        np.concatenate(vertices),
        np.concatenate(joints),
        _largest(weights),
        model.faces.numpy().astype(np.int32),
    )


def _adults(model: anny.Anny, gender: float) -> SimpleShapeDistribution:
    low, high = (torch.tensor(age, dtype=model.dtype) for age in ADULT_AGES)
    # torch's Uniform needs a width; this one is far below any visible difference
    start = torch.tensor(gender, dtype=model.dtype) * (1.0 - 1e-6)
    return SimpleShapeDistribution(
        model,
        morphological_age_distribution=torch.distributions.Uniform(low, high),
        gender_distribution=torch.distributions.Uniform(start, start + 1e-6),
    )


def _bone_maps(labels: list[str], parents: list[int]) -> tuple[NDArray[np.int64], list[int]]:
    """The SMPL joint that each bone moves with, and the bone whose head is each SMPL joint.

    A bone moves with the nearest joint at or above it in the hierarchy.
    """
    head_of_joint = {}
    for name in JOINT_NAMES:
        side, _, part = name.partition("_")
        head_of_joint[name] = _MIDLINE_BONES[name] if not part else f"{_SIDE_BONES[part]}.{side[0].upper()}"
    joint_of_label = {bone: JOINT[name] for name, bone in head_of_joint.items()}
    # The toes move as one below the ball of the foot, the fingers as one below the knuckles.
    for side in "LR":
        foot, hand = (JOINT[f"{'left' if side == 'L' else 'right'}_{part}"] for part in ("foot", "hand"))
        joint_of_label |= {f"toe{toe}-1.{side}": foot for toe in range(1, 6)}
        joint_of_label |= {f"finger{finger}-1.{side}": hand for finger in range(2, 6)}
    joints = np.empty(len(labels), dtype=np.int64)
    for bone, label in enumerate(labels):
        joints[bone] = joint_of_label[label] if label in joint_of_label else joints[parents[bone]]
    return joints, [labels.index(head_of_joint[name]) for name in JOINT_NAMES]


def _to_y_up(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """From z up, facing -y, to y up, facing +z."""
    return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)


def _largest(weights: NDArray[np.float64]) -> NDArray[np.float64]:
    kept = np.argsort(weights, axis=1, kind="stable")[:, -LARGEST_INFLUENCES:]
    result = np.zeros_like(weights)
    np.put_along_axis(result, kept, np.take_along_axis(weights, kept, axis=1), axis=1)
    return result / result.sum(axis=1, keepdims=True)
