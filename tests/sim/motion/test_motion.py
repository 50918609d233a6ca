"""Motion: validity, resampling, clipping, mirroring, moving."""

from __future__ import annotations

import numpy as np
import pytest

from muslin.garments.errors import InputError
from muslin.sim.motion import Motion
from muslin.sim.motion.rotations import (
    about_y,
    axis_angle_from_quaternion,
    conjugate,
    multiply,
    quaternion_from_axis_angle,
    rotate,
)
from muslin.sim.motion.skeleton import JOINT, JOINT_NAMES, MIRRORED, PARENTS, forward_kinematics

REST = np.cumsum(np.random.default_rng(2).normal(scale=0.1, size=(24, 3)), axis=0)


def sway(frames: int = 61, fps: float = 30.0) -> Motion:
    time = np.arange(frames) / fps
    rng = np.random.default_rng(0)
    poses = rng.normal(scale=0.4, size=(24, 3)) * np.sin(
        2.0 * time[:, None, None] + rng.uniform(0, 6, (24, 3))
    )
    translations = np.stack([np.sin(time), 0.9 + 0.05 * np.cos(3 * time), 1.2 * time], axis=1)
    return Motion("sway", poses, translations, fps, "a formula", (0.01, -0.2, 0.03))


def test_forward_kinematics_of_the_rest_pose_is_the_rest_joints_moved() -> None:
    np.testing.assert_allclose(
        forward_kinematics(np.zeros((24, 3)), REST, [1.0, 2.0, 3.0]),
        REST + np.array([1.0, 2.0, 3.0]),
        atol=1e-14,
    )


def test_forward_kinematics_keeps_bone_lengths_and_turns_about_the_pelvis() -> None:
    motion = sway()
    joints = forward_kinematics(motion.poses, REST, motion.translations)
    for joint, parent in enumerate(PARENTS):
        if parent >= 0:
            np.testing.assert_allclose(
                np.linalg.norm(joints[:, joint] - joints[:, parent], axis=1),
                np.linalg.norm(REST[joint] - REST[parent]),
                atol=1e-13,
            )
    np.testing.assert_allclose(joints[:, 0], REST[0] + motion.translations, atol=1e-14)


def test_resampling_at_the_same_rate_is_the_identity() -> None:
    motion = sway()
    again = motion.resample(motion.fps)
    np.testing.assert_array_equal(again.poses, motion.poses)
    np.testing.assert_array_equal(again.translations, motion.translations)


def test_resampling_up_and_down_again_returns_the_frames() -> None:
    motion = sway()
    back = motion.resample(90.0).resample(30.0)
    assert back.num_frames == motion.num_frames
    np.testing.assert_allclose(back.poses, motion.poses, atol=1e-12)
    np.testing.assert_allclose(back.translations, motion.translations, atol=1e-12)


def test_doubled_rate_puts_slerp_midpoints_between_frames() -> None:
    motion = sway()
    double = motion.resample(60.0)
    assert double.num_frames == 2 * motion.num_frames - 1
    q = motion.quaternions
    before = multiply(conjugate(q[:-1]), double.quaternions[1::2])
    after = multiply(conjugate(double.quaternions[1::2]), q[1:])
    np.testing.assert_allclose(
        axis_angle_from_quaternion(before), axis_angle_from_quaternion(after), atol=1e-12
    )
    np.testing.assert_allclose(
        double.translations[1::2], 0.5 * (motion.translations[1:] + motion.translations[:-1]), atol=1e-14
    )


def test_resampling_converges_at_second_order() -> None:
    """Interpolation error of a smooth motion falls by four when the frame rate doubles."""
    errors = []
    for fps in (15.0, 30.0, 60.0):
        motion = sway(frames=int(2 * fps) + 1, fps=fps)
        fine = motion.resample(240.0)
        exact = sway(frames=fine.num_frames, fps=240.0)
        errors.append(np.abs(fine.poses - exact.poses).max())
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.15)


def test_clip_takes_the_frames_between_both_times() -> None:
    motion = sway()
    part = motion.clip(0.5, 1.0)
    np.testing.assert_array_equal(part.poses, motion.poses[15:31])
    assert part.duration == pytest.approx(0.5)
    assert "clipped" in part.source


@pytest.mark.parametrize(("start", "end"), [(-0.1, 1.0), (1.0, 0.5), (0.0, 99.0), (0.01, 0.02)])
def test_clip_outside_the_motion_is_an_error(start: float, end: float) -> None:
    with pytest.raises(InputError, match="sway"):
        sway().clip(start, end)


def test_mirroring_twice_is_the_identity() -> None:
    motion = sway()
    twice = motion.mirror().mirror()
    np.testing.assert_array_equal(twice.poses, motion.poses)
    np.testing.assert_allclose(twice.translations, motion.translations, atol=1e-15)


def test_mirrored_joints_are_the_reflected_joints() -> None:
    motion = sway()
    symmetric = 0.5 * (REST + REST[list(MIRRORED)] * [-1, 1, 1])
    motion = Motion("m", motion.poses, motion.translations, 30.0, "", symmetric[0])
    joints = forward_kinematics(motion.poses, symmetric, motion.translations)
    mirrored = motion.mirror()
    reflected = forward_kinematics(mirrored.poses, symmetric, mirrored.translations)
    np.testing.assert_allclose(reflected, joints[:, list(MIRRORED)] * [-1, 1, 1], atol=1e-13)


def test_mirror_pairs_left_with_right() -> None:
    assert MIRRORED[JOINT["left_knee"]] == JOINT["right_knee"]
    assert [MIRRORED[k] for k in MIRRORED] == list(range(24))
    assert all(MIRRORED[k] == k for k, name in enumerate(JOINT_NAMES) if "_" not in name)


def test_moving_turns_and_shifts_every_joint_rigidly() -> None:
    motion = Motion("m", sway().poses, sway().translations, 30.0, "", REST[0])
    moved = motion.moved(0.7, (1.0, 0.0, -2.0))
    joints = forward_kinematics(motion.poses, REST, motion.translations)
    expected = rotate(about_y(0.7), joints) + np.array([1.0, 0.0, -2.0])
    np.testing.assert_allclose(
        forward_kinematics(moved.poses, REST, moved.translations), expected, atol=1e-13
    )


def test_max_joint_speed_of_a_steady_turn() -> None:
    poses = np.zeros((31, 24, 3))
    poses[:, 4, 0] = 2.0 * np.arange(31) / 30.0
    assert Motion("turn", poses, np.zeros((31, 3)), 30.0, "").max_joint_speed() == pytest.approx(2.0)


def test_frames_cannot_be_changed_in_place() -> None:
    with pytest.raises(ValueError, match="read-only"):
        sway().poses[0] = 0.0


@pytest.mark.parametrize(
    ("poses", "translations", "fps"),
    [
        (np.zeros((3, 22, 3)), np.zeros((3, 3)), 30.0),
        (np.zeros((3, 24, 3)), np.zeros((2, 3)), 30.0),
        (np.zeros((0, 24, 3)), np.zeros((0, 3)), 30.0),
        (np.full((3, 24, 3), np.nan), np.zeros((3, 3)), 30.0),
        (np.zeros((3, 24, 3)), np.full((3, 3), np.inf), 30.0),
        (np.zeros((3, 24, 3)), np.zeros((3, 3)), 0.0),
        (np.zeros((3, 24, 3)), np.zeros((3, 3)), np.nan),
    ],
)
def test_invalid_motions_are_refused(poses: np.ndarray, translations: np.ndarray, fps: float) -> None:
    with pytest.raises(InputError, match="bad"):
        Motion("bad", poses, translations, fps, "")


def test_quaternions_of_a_motion_are_those_of_its_poses() -> None:
    motion = sway()
    np.testing.assert_array_equal(motion.quaternions, quaternion_from_axis_angle(motion.poses))
