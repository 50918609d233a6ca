"""What networks are told of a frame: all of it, and nothing that does not matter."""

from __future__ import annotations

import json
from dataclasses import asdict
from itertools import product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from muslin.garments.errors import InputError
from muslin.learn.wrinkles.condition import JOINTS, Condition, motion_features, pose_features
from muslin.sim.body.joints import JOINT
from muslin.sim.dataset.sample import BodyTrack

PARAMETERS = {"garment_length": 0.6, "sleeve_length": 0.2, "neckline_depth": 0.1}
FPS = 30.0


def moving(frames: int = 5) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(0)
    poses = np.cumsum(0.05 * random.normal(size=(frames, 24, 3)), axis=0)
    return poses, np.cumsum(0.01 * random.normal(size=(frames, 3)), axis=0)


def track(poses: np.ndarray, moved: np.ndarray) -> BodyTrack:
    return BodyTrack("female", "", np.array([0.5, -1.0]), poses, moved)


def turned(poses: np.ndarray, moved: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same, seen by who stands elsewhere and faces elsewhere."""
    turn = Rotation.from_rotvec([0.0, 2.3, 0.0])
    other = poses.copy()
    other[:, 0] = (turn * Rotation.from_rotvec(poses[:, 0])).as_rotvec()
    return other, turn.apply(moved) + np.array([3.0, 0.0, 1.0])


@pytest.mark.parametrize(("pose", "motion", "fabric"), list(product([False, True], repeat=3)))
def test_there_are_as_many_numbers_as_are_said(pose: bool, motion: bool, fabric: bool) -> None:
    condition = Condition(2, tuple(PARAMETERS), pose, motion, fabric)
    told = condition.of(track(*moving()), FPS, PARAMETERS, "gray-interlock")
    assert told.shape == (5, condition.count)
    assert Condition.from_json(json.loads(json.dumps(asdict(condition)))) == condition


def test_shape_and_design_come_first_and_stay() -> None:
    told = Condition(3, ("sleeve_length",)).of(track(*moving()), FPS, PARAMETERS, "gray-interlock")
    np.testing.assert_allclose(told[:, :4], np.tile([0.5, -1.0, 0.0, 2.0], (5, 1)), rtol=1e-6)


def test_place_and_heading_are_not_told() -> None:
    condition = Condition(1, ("sleeve_length",))
    poses, moved = moving()
    here = condition.of(track(poses, moved), FPS, PARAMETERS, "gray-interlock")
    there = condition.of(track(*turned(poses, moved)), FPS, PARAMETERS, "gray-interlock")
    np.testing.assert_allclose(here, there, atol=1e-4)
    lying = poses.copy()
    lying[:, 0] = [np.pi / 2, 0.0, 0.0]
    assert (condition.of(track(lying, moved), FPS, PARAMETERS, "") - here).abs().max() > 0.5


def test_hands_and_feet_do_not_matter() -> None:
    poses, moved = moving()
    other = poses.copy()
    unseen = [number for number in range(1, 24) if number not in JOINTS]
    other[:, unseen] += 0.3
    assert {JOINT["left_wrist"], JOINT["right_foot"], JOINT["head"]} <= set(unseen)
    np.testing.assert_array_equal(pose_features(poses), pose_features(other))
    np.testing.assert_array_equal(motion_features(poses, moved, FPS), motion_features(other, moved, FPS))


def test_rates_of_uniform_motion() -> None:
    """Half a turn a second of an elbow, a quarter of the root, and 1.5 m/s ahead."""
    times = np.arange(6) / FPS
    poses = np.zeros((6, 24, 3))
    poses[:, 0, 1] = 0.5 * np.pi * times
    poses[:, JOINT["left_elbow"], 2] = np.pi * times
    # Ahead as the root sees it at each frame's end.
    heading = Rotation.from_rotvec(poses[:, 0])
    moved = np.cumsum(heading.apply([0.0, 0.0, 1.5 / FPS]), axis=0)
    rates = motion_features(poses, moved, FPS)
    np.testing.assert_allclose(rates[:, :3], np.tile([0.0, 0.0, 1.5], (6, 1)), atol=1e-9)
    np.testing.assert_allclose(rates[:, 3:6], np.tile([0.0, 0.5 * np.pi, 0.0], (6, 1)), atol=1e-9)
    place = 6 + 3 * JOINTS.index(JOINT["left_elbow"])
    np.testing.assert_allclose(rates[:, place : place + 3], np.tile([0.0, 0.0, np.pi], (6, 1)), atol=1e-9)
    others = np.delete(rates, [*range(6), *range(place, place + 3)], axis=1)
    assert np.abs(others).max() < 1e-9


def test_a_single_frame_does_not_move() -> None:
    poses, moved = moving(1)
    assert not motion_features(poses, moved, FPS).any()


def test_a_parameter_that_is_missing() -> None:
    with pytest.raises(InputError, match="'hood' is missing"):
        Condition(1, ("hood",)).of(track(*moving()), FPS, PARAMETERS, "gray-interlock")
