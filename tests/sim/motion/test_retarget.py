"""Retargeting: parsers on files written here, bones that point as their source's do, clean-up that cleans."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from muslin.garments.errors import InputError
from muslin.sim.body import load_body
from muslin.sim.motion import Motion, load_motion
from muslin.sim.motion.arms import CLEARANCE, MAX_SPREAD, arm_parts, clearances, spread_arms
from muslin.sim.motion.grounding import lowest_heights
from muslin.sim.motion.retarget.build import heal
from muslin.sim.motion.retarget.bvh import read_bvh
from muslin.sim.motion.retarget.deepmimic import read_deepmimic
from muslin.sim.motion.retarget.feet import clean_feet, standing
from muslin.sim.motion.retarget.legs import reach
from muslin.sim.motion.retarget.onto_smpl import CMU, DEEPMIMIC, Skeleton, leg_length, retarget
from muslin.sim.motion.retarget.source import SourceMotion
from muslin.sim.motion.rotations import (
    axis_angle_from_quaternion,
    conjugate,
    multiply,
    quaternion_from_axis_angle,
)
from muslin.sim.motion.skeleton import JOINT, forward_kinematics, global_rotations

BODY = load_body("neutral")
REST = BODY.joint_template

BVH = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
  JOINT Arm
  {
    OFFSET 2 0 0
    CHANNELS 3 Zrotation Yrotation Xrotation
    End Site
    {
      OFFSET 3 0 0
    }
  }
}
MOTION
Frames: 2
Frame Time: .0083333
1 2 3  0 0 0  0 0 0
1 2 3  90 0 0  0 90 0
"""


def test_bvh_places_joints_by_its_channels(tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    path.write_text(BVH)
    motion = read_bvh(path, "here")
    assert motion.joint_names == ("Hips", "Arm", "Arm_end")
    assert motion.fps == 120.0
    np.testing.assert_allclose(motion.rest, [[0, 0, 0], [2, 0, 0], [5, 0, 0]])
    np.testing.assert_allclose(motion.positions[0], [[1, 2, 3], [3, 2, 3], [6, 2, 3]], atol=1e-12)
    # Hips turn x to y; the arm then turns its own x to -z, which the hips leave alone.
    np.testing.assert_allclose(motion.positions[1], [[1, 2, 3], [1, 4, 3], [1, 4, 0]], atol=1e-12)


@pytest.mark.parametrize(
    "text", ["nothing", BVH.replace("1 2 3  90 0 0", "1 2 3"), BVH.replace("OFFSET 3", "OFSET 3")]
)
def test_a_broken_bvh_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.bvh"
    path.write_text(text)
    with pytest.raises((InputError, ValueError)):
        read_bvh(path, "here")


def deepmimic_row(seconds: float, **joints: list[float]) -> list[float]:
    one = [1.0, 0.0, 0.0, 0.0]
    row = [seconds, *joints.get("position", [0.0, 0.9, 0.0]), *joints.get("root", one), *one, *one]
    for side in ("right", "left"):
        row += [*joints.get(f"{side}_hip", one), *joints.get(f"{side}_knee", [0.0]), *one]
        row += [*joints.get(f"{side}_shoulder", one), *joints.get(f"{side}_elbow", [0.0])]
    return row


def deepmimic_file(path: Path, rows: list[list[float]]) -> Path:
    path.write_text(json.dumps({"Loop": "wrap", "Frames": rows}))
    return path


def test_deepmimic_is_turned_to_face_z_with_left_along_x(tmp_path: Path) -> None:
    rows = [deepmimic_row(0.5, position=[x, 0.9, 0.0], right_elbow=[0.5 * np.pi]) for x in (0.0, 1.0, 2.0)]
    motion = read_deepmimic(deepmimic_file(tmp_path / "a.txt", rows), "here")
    assert (motion.fps, len(motion.rotations)) == (2.0, 3)
    np.testing.assert_allclose(motion.positions[2, 0] - motion.positions[0, 0], [0, 0, 2], atol=1e-12)
    assert motion.positions[0, motion.index("left_hip"), 0] > 0.05
    # A positive elbow lifts the hanging forearm forward.
    forearm = (
        motion.positions[0, motion.index("right_wrist")] - motion.positions[0, motion.index("right_elbow")]
    )
    np.testing.assert_allclose(forearm, [0, 0, 0.258947], atol=1e-9)


def test_deepmimic_resamples_by_slerp(tmp_path: Path) -> None:
    half = quaternion_from_axis_angle(np.array([0.0, 1.0, 0.0])).tolist()
    rows = [deepmimic_row(0.5), deepmimic_row(0.5, root=half)]
    motion = read_deepmimic(deepmimic_file(tmp_path / "a.txt", rows), "here", fps=4.0)
    np.testing.assert_allclose(axis_angle_from_quaternion(motion.rotations[1, 0]), [0, 0.5, 0], atol=1e-12)
    with pytest.raises(InputError, match="44 numbers"):
        read_deepmimic(deepmimic_file(tmp_path / "b.txt", [[0.0] * 20, [0.0] * 20]), "here")


def wild_deepmimic(tmp_path: Path) -> SourceMotion:
    rng = np.random.default_rng(6)
    rows = []
    for _ in range(12):
        turns = quaternion_from_axis_angle(rng.normal(scale=0.6, size=(5, 3))).tolist()
        names = ("root", "right_hip", "left_hip", "right_shoulder", "left_shoulder")
        hinges = {f"{side}_knee": [-rng.uniform(0, 2)] for side in ("left", "right")}
        hinges |= {f"{side}_elbow": [rng.uniform(0, 2)] for side in ("left", "right")}
        rows.append(
            deepmimic_row(
                0.1, position=rng.normal(size=3).tolist(), **dict(zip(names, turns, strict=True)), **hinges
            )
        )
    return read_deepmimic(deepmimic_file(tmp_path / "wild.txt", rows), "here")


LIMBS = [("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist")]


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize(("start", "end"), LIMBS)
def test_retargeted_limbs_point_exactly_as_their_source(
    tmp_path: Path, side: str, start: str, end: str
) -> None:
    source = wild_deepmimic(tmp_path)
    motion = retarget(source, DEEPMIMIC, REST)
    joints = forward_kinematics(motion.poses, REST, motion.translations)
    ours = joints[:, JOINT[f"{side}_{end}"]] - joints[:, JOINT[f"{side}_{start}"]]
    theirs = (
        source.positions[:, source.index(f"{side}_{end}")]
        - source.positions[:, source.index(f"{side}_{start}")]
    )
    ours /= np.linalg.norm(ours, axis=1, keepdims=True)
    theirs /= np.linalg.norm(theirs, axis=1, keepdims=True)
    assert np.degrees(np.arccos(np.clip(np.sum(ours * theirs, axis=1), -1, 1))).max() < 1e-4


def test_retargeted_hips_travel_by_the_ratio_of_leg_lengths(tmp_path: Path) -> None:
    source = wild_deepmimic(tmp_path)
    motion = retarget(source, DEEPMIMIC, REST)
    joints = forward_kinematics(motion.poses, REST, motion.translations)
    middle = joints[:, [JOINT["left_hip"], JOINT["right_hip"]]].mean(axis=1)
    ratio = leg_length(REST, JOINT["left_hip"], JOINT["left_knee"], JOINT["left_ankle"]) / (
        0.421546 + 0.409870
    )
    np.testing.assert_allclose(
        np.diff(middle, axis=0), ratio * np.diff(source.positions[:, 0], axis=0), atol=1e-9
    )


@pytest.mark.parametrize("skeleton", [CMU, DEEPMIMIC])
def test_skeletons_name_smpl_joints(skeleton: Skeleton) -> None:
    assert set(skeleton.parts) <= set(JOINT)
    assert all(part.bone is None or part.bone[0] in JOINT for part in skeleton.parts.values())


def test_leg_reaches_its_target_and_keeps_the_foot(tmp_path: Path) -> None:
    motion = retarget(wild_deepmimic(tmp_path), DEEPMIMIC, REST)
    joints = forward_kinematics(motion.poses, REST, motion.translations)
    hip = joints[:, JOINT["left_hip"]]
    target = hip + 0.9 * (joints[:, JOINT["left_ankle"]] - hip) + np.array([0.02, 0.0, -0.03])
    poses = reach(motion.poses, motion.translations, REST, "left", target)
    moved = forward_kinematics(poses, REST, motion.translations)
    np.testing.assert_allclose(moved[:, JOINT["left_ankle"]], target, atol=1e-9)
    turn = multiply(conjugate(global_rotations(motion.poses)[:, 7]), global_rotations(poses)[:, 7])
    np.testing.assert_allclose(axis_angle_from_quaternion(turn), 0.0, atol=1e-9)
    others = [j for j in range(24) if j not in (1, 4, 7)]
    np.testing.assert_array_equal(poses[:, others], motion.poses[:, others])


def test_clean_feet_stands_a_skating_sunken_walker_on_the_floor() -> None:
    # Standing, but 3 cm under the floor at first and sliding at 0.1 m/s.
    frames = 45
    poses = np.zeros((frames, 24, 3))
    poses[:, [1, 2], 0], poses[:, [4, 5], 0], poses[:, [7, 8], 0] = -0.3, 0.6, -0.3
    stand = -BODY.vertices(None, poses[0])[:, 1].min()
    translations = np.zeros((frames, 3))
    translations[:, 1] = stand - 0.03 * np.linspace(1, 0, frames)
    translations[:, 0] = 0.1 * np.arange(frames) / 30.0
    sliding = Motion("slide", poses, translations, 30.0, "a formula")
    clean = clean_feet(sliding, BODY)
    assert lowest_heights(clean, BODY).min() > -1e-9
    for side in ("left", "right"):
        assert standing(clean, BODY, side).all()
        ball = forward_kinematics(clean.poses, REST, clean.translations)[:, JOINT[f"{side}_foot"]]
        before = forward_kinematics(poses, REST, translations)[:, JOINT[f"{side}_foot"]]
        assert np.ptp(ball[:, 0]) < 0.1 * np.ptp(before[:, 0])


def test_arms_pressed_into_the_trunk_are_spread_and_free_arms_are_left() -> None:
    pressed = np.zeros((12, 24, 3))
    pressed[:, JOINT["left_shoulder"], 2] = -np.radians(92.0)
    pressed[:, JOINT["right_shoulder"], 2] = np.radians(40.0)
    motion = Motion("pressed", pressed, np.zeros((12, 3)), 30.0, "a formula")
    spread, figures = spread_arms(motion, BODY)
    parts = arm_parts(BODY, "left")
    before = clearances(BODY.vertices(None, motion.poses[5]), parts)[0].min()
    after = clearances(BODY.vertices(None, spread.poses[5]), parts)[0].min()
    assert before < 0.0
    assert after > 0.75 * CLEARANCE
    assert 0.0 < figures["arm_spread_left"] <= MAX_SPREAD + 1e-9
    assert figures["arm_spread_right"] == 0.0
    others = [j for j in range(24) if j != JOINT["left_shoulder"]]
    np.testing.assert_array_equal(spread.poses[:, others], motion.poses[:, others])


def test_clearance_agrees_with_exact_signed_distance() -> None:
    import igl

    motion = load_motion("walk")
    for frame in (0, 12, 25):
        vertices = BODY.vertices(None, motion.poses[frame], motion.translations[frame])
        parts = arm_parts(BODY, "right")
        distance, _ = clearances(vertices, parts)
        points, surface = (
            np.ascontiguousarray(vertices[parts.vertices]),
            np.ascontiguousarray(vertices[parts.surface]),
        )
        squared, _, _ = igl.point_mesh_squared_distance(points, surface, parts.faces.astype(np.int64))
        inside = igl.fast_winding_number(surface, parts.faces.astype(np.int64), points) > 0.5
        exact = np.where(inside, -1.0, 1.0) * np.sqrt(squared)
        near = exact < 0.04
        np.testing.assert_allclose(distance[near], exact[near], atol=0.004)


def test_healing_bridges_a_leap_and_leaves_the_rest() -> None:
    time = np.arange(90) / 30.0
    poses = np.zeros((90, 24, 3))
    poses[:, 16, 0] = 0.3 * np.sin(2.0 * time)
    poses[:, 17, 0] = poses[:, 16, 0]
    poses[45:, 16, 0] += 0.5
    motion = Motion("leap", poses, np.zeros((90, 3)), 30.0, "a formula")
    healed = heal(motion)
    assert motion.max_joint_speed() > 14.0
    assert healed.max_joint_speed() < 5.0
    np.testing.assert_allclose(healed.poses[:, 17], poses[:, 17], atol=1e-12)
    np.testing.assert_allclose(healed.poses[[20, 70], 16], poses[[20, 70], 16], atol=1e-12)
