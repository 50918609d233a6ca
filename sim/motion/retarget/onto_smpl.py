"""Bring a captured motion onto SMPL's joints.

For SMPL joint j that plays the part of source joint s:  G_j = S_s C_j,  with S_s the source's world
rotation and C_j the smallest rotation that turns the body's rest bone d_j into the source's rest bone d_s.
So every bone with a direction points exactly where its source bone points: G_j d_j = S_s d_s. Local
rotations follow as R_j = G_parent^-1 G_j. The middle of the hips moves as the source's does, scaled by the
ratio of leg lengths.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from muslin.sim.motion.motion import Motion
from muslin.sim.motion.retarget.source import SourceMotion
from muslin.sim.motion.rotations import (
    axis_angle_from_quaternion,
    between,
    conjugate,
    multiply,
    rotate,
    slerp,
)
from muslin.sim.motion.skeleton import JOINT, JOINT_NAMES, PARENTS

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Part:
    """What one SMPL joint does.

    The rotation is `first`'s, or, where `second` is given, `weight` of the way from it to `second`'s.
    `bone` = (SMPL child, source start, source end) are the bones to be made parallel; without it the two
    rest poses are taken to agree already (trunk, feet).
    """

    first: str
    second: str | None = None
    weight: float = 0.0
    bone: tuple[str, str, str] | None = None


@dataclass(frozen=True)
class Skeleton:
    """The parts of a source skeleton; SMPL joints that are not named follow their parent."""

    parts: dict[str, Part]
    left_leg: tuple[str, str, str]
    right_leg: tuple[str, str, str]


def retarget(source: SourceMotion, skeleton: Skeleton, rest_joints: ArrayLike) -> Motion:
    """Poses and translations of the body with rest joints (24, 3), metres, that follow `source`.

    Starts at the origin, facing +z as far as the source's first root rotation does.
    """
    rest = np.asarray(rest_joints, dtype=np.float64)
    frames = len(source.rotations)
    world = np.empty((frames, 24, 4))
    local = np.empty((frames, 24, 4))
    for joint, name in enumerate(JOINT_NAMES):
        part = skeleton.parts.get(name)
        parent = PARENTS[joint]
        world[:, joint] = world[:, parent] if part is None else _follow(part, name, source, rest)
        inverse = conjugate(world[:, parent]) if parent >= 0 else np.array([1.0, 0.0, 0.0, 0.0])
        local[:, joint] = multiply(inverse, world[:, joint])

    scale = leg_length(rest, *(JOINT[n] for n in ("left_hip", "left_knee", "left_ankle"))) / leg_length(
        source.rest, *(source.index(n) for n in skeleton.left_leg)
    )
    hips = [source.index(skeleton.left_leg[0]), source.index(skeleton.right_leg[0])]
    middle = scale * source.positions[:, hips].mean(axis=1)
    arm = rest[[JOINT["left_hip"], JOINT["right_hip"]]].mean(axis=0) - rest[0]
    pelvis = middle - rotate(world[:, 0], arm)
    pelvis -= pelvis[0] * np.array([1.0, 0.0, 1.0])
    poses = axis_angle_from_quaternion(local)
    return Motion(source.name, poses, pelvis - rest[0], source.fps, source.source, rest[0])


def leg_length(joints: Array, hip: int, knee: int, ankle: int) -> float:
    """Length hip to knee to ankle of joint positions (J, 3)."""
    return float(np.linalg.norm(joints[knee] - joints[hip]) + np.linalg.norm(joints[ankle] - joints[knee]))


def _follow(part: Part, name: str, source: SourceMotion, rest: Array) -> Array:
    rotation = source.rotations[:, source.index(part.first)]
    if part.second is not None:
        rotation = slerp(rotation, source.rotations[:, source.index(part.second)], part.weight)
    if part.bone is None:
        return rotation
    child, start, end = part.bone
    own = rest[JOINT[child]] - rest[JOINT[name]]
    theirs = source.rest[source.index(end)] - source.rest[source.index(start)]
    return multiply(rotation, between(own, theirs))


_SideParts = dict[str, tuple[str, tuple[str, str, str] | None]]


def _both(side_parts: _SideParts, sides: dict[str, str]) -> dict[str, Part]:
    """Parts of both body sides from a description with `*` for the side, in each skeleton's spelling."""
    parts = {}
    for ours, theirs in sides.items():
        for joint, (first, bone) in side_parts.items():
            named = None
            if bone is not None:
                child, start, end = bone
                named = (f"{ours}_{child}", start.replace("*", theirs), end.replace("*", theirs))
            parts[f"{ours}_{joint}"] = Part(first.replace("*", theirs), bone=named)
    return parts


CMU = Skeleton(
    parts={
        "pelvis": Part("Hips"),
        "spine1": Part("LowerBack"),
        "spine2": Part("Spine"),
        "spine3": Part("Spine1"),
        "neck": Part("Neck1"),
        "head": Part("Head"),
        **_both(
            {
                "hip": ("*UpLeg", ("knee", "*UpLeg", "*Leg")),
                "knee": ("*Leg", ("ankle", "*Leg", "*Foot")),
                "ankle": ("*Foot", None),
                "foot": ("*ToeBase", None),
                "collar": ("*Shoulder", None),
                "shoulder": ("*Arm", ("elbow", "*Arm", "*ForeArm")),
                "elbow": ("*ForeArm", ("wrist", "*ForeArm", "*Hand")),
                "wrist": ("*Hand", None),
            },
            {"left": "Left", "right": "Right"},
        ),
    },
    left_leg=("LeftUpLeg", "LeftLeg", "LeftFoot"),
    right_leg=("RightUpLeg", "RightLeg", "RightFoot"),
)

DEEPMIMIC = Skeleton(
    parts={
        "pelvis": Part("root"),
        "spine1": Part("root", "chest", 1.0 / 3.0),
        "spine2": Part("root", "chest", 2.0 / 3.0),
        "spine3": Part("chest"),
        "neck": Part("chest", "neck", 0.5),
        "head": Part("neck"),
        **_both(
            {
                "hip": ("*_hip", ("knee", "*_hip", "*_knee")),
                "knee": ("*_knee", ("ankle", "*_knee", "*_ankle")),
                "ankle": ("*_ankle", None),
                "shoulder": ("*_shoulder", ("elbow", "*_shoulder", "*_elbow")),
                "elbow": ("*_elbow", ("wrist", "*_elbow", "*_wrist")),
            },
            {"left": "left", "right": "right"},
        ),
    },
    left_leg=("left_hip", "left_knee", "left_ankle"),
    right_leg=("right_hip", "right_knee", "right_ankle"),
)
