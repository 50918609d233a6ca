"""Tailor's measurements of a body in T-pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull, QhullError

from muslin.garments.errors import InputError
from muslin.sim.body.joints import JOINT
from muslin.sim.body.model import BodyModel

Floats = NDArray[np.float64]

# Distance between the planes searched for the widest or narrowest girth, metres.
PLANE_STEP = 0.005

_TRUNK = (
    "pelvis",
    "spine1",
    "spine2",
    "spine3",
    "neck",
    "left_collar",
    "right_collar",
    "left_hip",
    "right_hip",
)
_UP = np.array([0.0, 1.0, 0.0])
_LEFT = np.array([1.0, 0.0, 0.0])


def measure(model: BodyModel, beta: ArrayLike | None = None) -> dict[str, float]:
    """Measures one body in T-pose, barefoot; everything in metres.

    A girth is the length of a tape around a plane section: the perimeter of the section's convex hull.

    | key | what |
    | --- | --- |
    | height | floor to the top of the head |
    | neck | smallest girth across the neck |
    | chest | largest girth of the trunk between the lower ribs and the armpits |
    | waist | smallest girth of the trunk in the middle half between pelvis and breast |
    | hip | largest girth of the trunk between the crotch and the pelvis joint |
    | upper_arm, wrist | largest girth of the upper arm, girth at the wrist joint, left |
    | thigh, calf | largest girth of the thigh below the crotch, of the lower leg, left |
    | shoulder_width | between the shoulder joints |
    | arm_length | shoulder to wrist joint, left |
    | trunk_length | neck joint to pelvis joint, vertically |
    | inseam | floor to crotch |

    Args:
        beta: (n,), one body.
    """
    vertices, joints = model.rest_vertices(beta), model.rest_joints(beta)
    if vertices.ndim != 2:
        raise InputError(f"beta describes bodies of shape {vertices.shape}; measure takes one body at a time")
    joint = {name: joints[index] for name, index in JOINT.items()}
    owner = np.argmax(model.weights, axis=1)

    def part(*names: str) -> NDArray[np.int32]:
        """Faces whose three corners move mostly with the named joints."""
        return model.faces[np.isin(owner, [JOINT[name] for name in names])[model.faces].all(axis=1)]

    def girths(faces: NDArray[np.int32], normal: Floats, low: float, high: float) -> Floats:
        planes = np.arange(low, max(high, low + PLANE_STEP), PLANE_STEP)
        return np.array([girth(vertices, faces, offset * normal, normal) for offset in planes])

    floor = vertices[:, 1].min()
    trunk = part(*_TRUNK)
    crotch = _crotch_height(vertices, joint["pelvis"][1], joint["left_knee"][1])
    shoulder, elbow, wrist = (joint[f"left_{name}"] for name in ("shoulder", "elbow", "wrist"))
    pelvis, ribs, breast = (joint[name][1] for name in ("pelvis", "spine2", "spine3"))
    armpit = _armpit_height(vertices[owner == JOINT["left_shoulder"]], 0.5 * (shoulder + elbow)[0])
    arm, leg = part("left_shoulder", "left_elbow"), part("left_hip", "left_knee")
    knee, ankle = joint["left_knee"][1], joint["left_ankle"][1]
    return {
        "height": float(vertices[:, 1].max() - floor),
        "neck": float(girths(part("neck", "head", "spine3"), _UP, joint["neck"][1], joint["head"][1]).min()),
        "chest": float(girths(trunk, _UP, ribs, armpit).max()),
        "waist": float(girths(trunk, _UP, *_inner_half(pelvis, breast)).min()),
        "hip": float(girths(trunk, _UP, crotch + PLANE_STEP, pelvis).max()),
        "upper_arm": float(girths(arm, _LEFT, 0.65 * shoulder[0] + 0.35 * elbow[0], elbow[0]).max()),
        "wrist": girth(vertices, part("left_elbow", "left_wrist"), wrist, _LEFT),
        "thigh": float(girths(leg, _UP, 0.5 * (knee + crotch), crotch - PLANE_STEP).max()),
        "calf": float(girths(part("left_knee"), _UP, 0.5 * (ankle + knee), knee - 0.05).max()),
        "shoulder_width": float(np.linalg.norm(shoulder - joint["right_shoulder"])),
        "arm_length": float(np.linalg.norm(elbow - shoulder) + np.linalg.norm(wrist - elbow)),
        "trunk_length": float(joint["neck"][1] - joint["pelvis"][1]),
        "inseam": float(crotch - floor),
    }


def girth(vertices: Floats, faces: NDArray[np.int32], origin: Floats, normal: Floats) -> float:
    """Perimeter of the convex hull of the section of a mesh with a plane, metres; 0 where they do not meet.

    Args:
        vertices: (V, 3); faces: (F, 3); origin: a point of the plane; normal: its unit normal.
    """
    points = section(vertices, faces, origin, normal)
    if len(points) < 3:
        return 0.0
    axis = np.eye(3)[np.argmin(np.abs(normal))]
    first = np.cross(normal, axis)
    first /= np.linalg.norm(first)
    flat = (points - origin) @ np.stack([first, np.cross(normal, first)], axis=1)
    try:
        # in two dimensions scipy's `area` is the perimeter
        return float(ConvexHull(flat).area)
    except QhullError:
        # all points on one line: the tape goes there and back
        return float(2.0 * np.linalg.norm(np.ptp(flat, axis=0)))


def section(vertices: Floats, faces: NDArray[np.int32], origin: Floats, normal: Floats) -> Floats:
    """Points (K, 3) in which a plane crosses the edges of a mesh; shared edges give their point twice."""
    height = (vertices - origin) @ normal
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    crossed = (height[start] < 0.0) != (height[end] < 0.0)
    start, end = start[crossed], end[crossed]
    share = (height[start] / (height[start] - height[end]))[:, None]
    return vertices[start] + share * (vertices[end] - vertices[start])


def _crotch_height(vertices: Floats, pelvis: float, knee: float) -> float:
    """The lowest point of the body's midline between knees and pelvis."""
    near_midline = np.abs(vertices[:, 0]) < 0.01
    between = (vertices[:, 1] > knee) & (vertices[:, 1] < pelvis)
    return float(vertices[near_midline & between, 1].min())


def _armpit_height(upper_arm: Floats, elbow_side: float) -> float:
    """The lowest point of the left arm's inner half, which in T-pose is the armpit."""
    return float(upper_arm[upper_arm[:, 0] < elbow_side, 1].min())


def _inner_half(low: float, high: float) -> tuple[float, float]:
    return 0.75 * low + 0.25 * high, 0.25 * low + 0.75 * high
