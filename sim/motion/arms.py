"""Arms held clear of the trunk and the thighs, so that cloth has room between them.

A captured arm has the angles of a leaner body and sinks into a fuller one. For each frame and side, the
point of forearm, hand and lower upper arm that lies deepest asks for a turn of the shoulder that moves it
out along the trunk's surface normal; turns are widened and smoothed in time, applied, and measured again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from muslin.sim.body.model import BodyModel
from muslin.sim.motion.motion import Motion
from muslin.sim.motion.rotations import (
    axis_angle_from_quaternion,
    conjugate,
    multiply,
    quaternion_from_axis_angle,
    rotate,
)
from muslin.sim.motion.skeleton import JOINT, PARENTS, forward_kinematics, global_rotations

Array = NDArray[np.float64]

CLEARANCE = 0.02
"""Metres between arm and trunk that spreading aims for."""
MAX_SPREAD = np.radians(45.0)
"""Radians: the most a shoulder is turned; hands that hold on to the body stay there."""

_ROUNDS = 6
_CHECKS_PER_SECOND = 60.0
_BLOCK = 64  # frames skinned together
_ABOVE = 0.5  # cosine to the normal: a point further off lies beside the part, over its edge
_DEEPEST = 0.12  # metres: no arm is deeper inside a trunk
_SHORTEST_LEVER = 0.1  # metres: about a shorter one a shoulder would have to turn far
_EVERY = 3  # of the arm's vertices, a centimetre or so apart, are enough to see how deep it lies
_UPPER_ARM_FROM = 0.5  # of the way from shoulder to elbow: above it, arm and chest are one flesh
_TRUNK = ("pelvis", "spine1", "spine2", "spine3", "left_hip", "right_hip", "left_knee", "right_knee")


@dataclass(frozen=True, eq=False)
class ArmParts:
    """vertices        (n,) arm vertices of one side, in the body's indices
    surface         (m,) vertices of trunk and thighs, in the body's indices
    faces           (F, 3) of trunk and thighs, in `surface`'s indices
    faces_of_vertex (m, F) incidence, ones
    rim             (m,) whether a vertex is on the rim of the holes at neck, shoulders and shins
    """

    vertices: NDArray[np.intp]
    surface: NDArray[np.int32]
    faces: NDArray[np.intp]
    faces_of_vertex: csr_array
    rim: NDArray[np.bool_]


def arm_parts(body: BodyModel, side: str) -> ArmParts:
    """The parts of `body` on `side`, "left" or "right", by dominant skinning weight."""
    part = np.argmax(body.weights, axis=1)
    rest, joints = body.v_template, body.joint_template
    shoulder, elbow = JOINT[f"{side}_shoulder"], JOINT[f"{side}_elbow"]
    bone = joints[elbow] - joints[shoulder]
    along = (rest - joints[shoulder]) @ bone / (bone @ bone)
    lower = np.isin(part, [elbow, JOINT[f"{side}_wrist"], JOINT[f"{side}_hand"]])
    upper = (part == shoulder) & (along > _UPPER_ARM_FROM)
    trunk = np.isin(part, [JOINT[name] for name in _TRUNK])
    surface, faces = np.unique(body.faces[trunk[body.faces].all(axis=1)], return_inverse=True)
    faces = faces.reshape(-1, 3)
    incidence = csr_array(
        (np.ones(faces.size), (faces.ravel(), np.repeat(np.arange(len(faces)), 3))),
        shape=(len(surface), len(faces)),
    )
    return ArmParts(
        np.flatnonzero(lower | upper)[::_EVERY], surface, faces, incidence, _rim(faces, len(surface))
    )


def _rim(faces: NDArray[np.intp], count: int) -> NDArray[np.bool_]:
    """(count,) whether each vertex is on an edge of one triangle only."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges, uses = np.unique(edges, axis=0, return_counts=True)
    rim = np.zeros(count, dtype=bool)
    rim[edges[uses == 1]] = True
    return rim


def clearances(vertices: Array, parts: ArmParts) -> tuple[Array, Array]:
    """Signed distances (n,) of the arm's vertices to the trunk, inside negative, and directions out (n, 3).

    d = n . (x - y) at the trunk vertex y nearest to x, n its normal, where x lies above or below it; beside
    it, |x - y|. Good to a millimetre or two on a mesh of centimetre edges, and ten times as fast as exact.
    """
    surface = vertices[parts.surface]
    corners = surface[parts.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = parts.faces_of_vertex @ normals
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    points = vertices[parts.vertices]
    apart, nearest = cKDTree(surface).query(points)
    height = np.sum((points - surface[nearest]) * normals[nearest], axis=1)
    # Nearest to a rim means past a hole, and far below the surface means on its other side: both are outside.
    above = (np.abs(height) > _ABOVE * apart) & ~parts.rim[nearest] & (apart < _DEEPEST)
    return np.where(above, height, apart), normals[nearest]


def spread_arms(
    motion: Motion, body: BodyModel, beta: ArrayLike | None = None
) -> tuple[Motion, dict[str, float]]:
    """`motion` with arms clear of the trunk as far as MAX_SPREAD allows, and the figures:

    arm_spread_left / _right    largest turn of each shoulder, radians
    depth_before / depth        deepest arm vertex inside trunk or thighs before and after, metres
    """
    figures = {"depth_before": 0.0, "depth": 0.0}
    for side in ("left", "right"):
        parts = arm_parts(body, side)
        shoulder = JOINT[f"{side}_shoulder"]
        turn = np.zeros((motion.num_frames, 3))
        need, distance = np.zeros((motion.num_frames, 3)), np.zeros(motion.num_frames)
        changed = np.arange(0, motion.num_frames, max(round(motion.fps / _CHECKS_PER_SECOND), 1))
        checked, spread = changed, motion
        for round_number in range(_ROUNDS + 1):
            need[changed], distance[changed] = _turns(spread, changed, body, beta, parts, shoulder)
            deepest = max(0.0, -float(distance[checked].min()))
            if round_number == 0:
                figures["depth_before"] = max(figures["depth_before"], deepest)
            if round_number == _ROUNDS or not need.any():
                break
            turn = _limited(turn + _widened(need, motion.fps))
            spread = _turned(motion, turn, shoulder)
            changed = checked[np.linalg.norm(turn[checked], axis=1) > 1e-6]
        figures["depth"] = max(figures["depth"], deepest)
        figures[f"arm_spread_{side}"] = float(np.linalg.norm(turn, axis=1).max())
        motion = spread
    return motion, figures


def _turns(
    motion: Motion,
    frames: NDArray[np.intp],
    body: BodyModel,
    beta: ArrayLike | None,
    parts: ArmParts,
    shoulder: int,
) -> tuple[Array, Array]:
    """Turns (n, 3) the frames' deepest arm vertices ask for, in the collar's frame, and their distances."""
    poses, translations = motion.poses[frames], motion.translations[frames]
    pivots = forward_kinematics(poses, body.rest_joints(beta), translations)[:, shoulder]
    collars = conjugate(global_rotations(poses)[:, PARENTS[shoulder]])
    turns, smallest = np.zeros((len(frames), 3)), np.empty(len(frames))
    for start in range(0, len(frames), _BLOCK):
        block = slice(start, start + _BLOCK)
        for k, vertices in enumerate(body.vertices(beta, poses[block], translations[block]), start):
            distance, outward = clearances(vertices, parts)
            worst = int(np.argmin(distance))
            smallest[k] = distance[worst]
            if distance[worst] < CLEARANCE:
                axis = np.cross(vertices[parts.vertices[worst]] - pivots[k], outward[worst])
                lever = float(np.linalg.norm(axis))
                angle = np.arctan((CLEARANCE - distance[worst]) / max(lever, _SHORTEST_LEVER))
                turns[k] = rotate(collars[k], axis / max(lever, 1e-9)) * angle
    return turns, smallest


def _widened(turns: Array, fps: float) -> Array:
    """Each frame's turn carried to its neighbours and smoothed, so that arms move away and back softly."""
    radius = max(round(0.1 * fps), 1)
    length = np.linalg.norm(turns, axis=1)
    padded = np.pad(length, radius, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * radius + 1)
    strongest = np.clip(np.arange(len(turns)) + np.argmax(windows, axis=1) - radius, 0, len(turns) - 1)
    return gaussian_filter1d(turns[strongest], radius / 2.0, axis=0, mode="nearest")


def _limited(turns: Array) -> Array:
    length = np.linalg.norm(turns, axis=1, keepdims=True)
    return turns * np.minimum(1.0, MAX_SPREAD / np.maximum(length, 1e-9))


def _turned(motion: Motion, turns: Array, shoulder: int) -> Motion:
    poses = motion.poses.copy()
    local = multiply(quaternion_from_axis_angle(turns), motion.quaternions[:, shoulder])
    poses[:, shoulder] = axis_angle_from_quaternion(local)
    return motion.with_frames(poses, motion.translations)
