import json
from dataclasses import asdict, replace
from itertools import product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from muslin.garments.errors import InputError
from muslin.garments.template import template
from muslin.learn.drape.fabric import FIGURES
from muslin.learn.wrinkles.condition import (
    DECIMETRES,
    JOINTS,
    Condition,
    motion_features,
    pose_features,
    used_betas,
    varied_parameters,
)
from muslin.sim.body.joints import JOINT
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.sample import Sample
from tests.learn.wrinkles.worn import BETA, FPS, swinging, track, turned

NAMES = ("sleeve_length", "garment_length")
PARAMETERS = {"garment_length": 0.9, "sleeve_length": 0.2, "neckline_depth": 0.1}
FABRIC = "gray-interlock"


@pytest.mark.parametrize(("pose", "motion", "fabric", "fields"), [*product([False, True], repeat=4)])
@pytest.mark.parametrize("betas", [1, 3, 10])
def test_there_are_as_many_numbers_as_it_counts(betas, pose, motion, fabric, fields) -> None:
    condition = Condition(betas, NAMES, pose, motion, fabric, fields)
    for frames in (1, 2, 5):
        found = condition.of(swinging(frames), FPS, PARAMETERS, FABRIC)
        assert found.shape == (frames, condition.count)
    # Shape and design, and 6 + 3 J of motion, 3 + 6 J of pose; fields are no part of them.
    more = pose * (3 + 6 * len(JOINTS)) + motion * (6 + 3 * len(JOINTS)) + fabric * FIGURES
    assert condition.count == betas + 2 + more


def test_blocks_stand_where_the_table_says() -> None:
    moving = swinging(3)
    found = Condition(4, NAMES, fabric=True).of(moving, FPS, PARAMETERS, FABRIC).numpy()
    np.testing.assert_allclose(found[:, :4], np.tile([*BETA, 0.0], (3, 1)), rtol=1e-6)
    np.testing.assert_allclose(found[:, 4:6], np.tile(DECIMETRES * np.array([0.2, 0.9]), (3, 1)), rtol=1e-6)
    pose = 3 + 6 * len(JOINTS)
    np.testing.assert_allclose(found[:, 6 : 6 + pose], pose_features(moving.poses), atol=1e-6)
    rates = motion_features(moving.poses, moving.translations, FPS)
    np.testing.assert_allclose(found[:, 6 + pose : -FIGURES], rates, atol=1e-5)
    assert np.array_equal(found[0, -FIGURES:], found[2, -FIGURES:])


@pytest.mark.parametrize("angle", [0.5, -2.0, 3.1])
def test_it_makes_no_difference_where_the_body_stands_and_which_way_it_faces(angle: float) -> None:
    moving = swinging(6)
    condition = Condition(3, NAMES)
    here = condition.of(moving, FPS, PARAMETERS, FABRIC)
    there = condition.of(turned(moving, angle, np.array([4.0, 0.3, -7.0])), FPS, PARAMETERS, FABRIC)
    np.testing.assert_allclose(there, here, atol=1e-4)
    # But it does whether it stands or leans.
    leaning = moving.poses.copy()
    leaning[:, 0] = (Rotation.from_rotvec([0.5, 0.0, 0.0]) * Rotation.from_rotvec(leaning[:, 0])).as_rotvec()
    leant = condition.of(track(leaning, moving.translations), FPS, PARAMETERS, FABRIC)
    assert float((leant - here).abs().max()) > 0.3


def test_gravity_is_told_as_the_root_sees_it() -> None:
    poses = np.zeros((3, 24, 3))
    # Upright; on its belly, where down is ahead, +z; lying on its left side, where down is +x.
    poses[1, 0, 0], poses[2, 0, 2] = 0.5 * np.pi, -0.5 * np.pi
    down = [[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]
    np.testing.assert_allclose(pose_features(poses)[:, :3], down, atol=1e-12)


def test_rotations_of_joints_can_be_had_back_from_two_columns() -> None:
    poses = swinging(4).poses
    columns = pose_features(poses)[:, 3:].reshape(4, len(JOINTS), 3, 2)
    third = np.cross(columns[..., 0], columns[..., 1])
    matrices = np.concatenate([columns, third[..., None]], axis=-1)
    found = Rotation.from_matrix(matrices.reshape(-1, 3, 3)).as_rotvec().reshape(4, len(JOINTS), 3)
    np.testing.assert_allclose(found, poses[:, JOINTS], atol=1e-9)


def test_a_steady_turn_has_its_own_rate_and_a_steady_way_its_own_velocity() -> None:
    time = np.arange(5) / FPS
    poses = np.zeros((5, 24, 3))
    root, elbow = np.array([0.6, 1.2, -0.9]), np.array([0.0, 4.0, 3.0])
    poses[:, 0] = time[:, None] * root
    poses[:, JOINTS[-1]] = time[:, None] * elbow
    found = motion_features(poses, np.zeros((5, 3)), FPS)
    expected = np.zeros((5, 6 + 3 * len(JOINTS)))
    # About its own axis a turn is the same from outside and from the turning body.
    expected[:, 3:6], expected[:, -3:] = root, elbow
    np.testing.assert_allclose(found, expected, atol=1e-9)
    # Facing +x, to walk along the world's +x is to walk ahead, the body's own +z.
    facing = np.zeros((5, 24, 3))
    facing[:, 0, 1] = 0.5 * np.pi
    walking = motion_features(facing, time[:, None] * [1.3, 0.0, 0.0], FPS)
    expected = np.zeros_like(walking)
    expected[:, 2] = 1.3
    np.testing.assert_allclose(walking, expected, atol=1e-9)


def test_rates_are_those_from_the_frame_before() -> None:
    translations = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.0, 0.0]])
    found = motion_features(np.zeros((4, 24, 3)), translations, FPS)
    # A first frame has no frame before: it has the rates of the second.
    np.testing.assert_allclose(found[:, 0], [3.0, 3.0, 0.0, 0.0])
    assert (motion_features(np.zeros((1, 24, 3)), translations[1:2], FPS) == 0.0).all()


def test_a_turn_through_half_a_circle_is_no_jump() -> None:
    poses = np.zeros((8, 24, 3))
    angle = np.linspace(np.pi - 0.2, np.pi + 0.2, 8)
    # A rotation vector changes sign there.
    poses[:, 0, 1] = np.where(angle > np.pi, angle - 2.0 * np.pi, angle)
    found = motion_features(poses, np.zeros((8, 3)), FPS)
    np.testing.assert_allclose(found[:, 4], FPS * 0.4 / 7.0)


def test_a_missing_design_parameter_is_told() -> None:
    with pytest.raises(InputError, match="'garment_length' is missing; give sleeve_length, garment_length"):
        Condition(3, NAMES).of(swinging(1), FPS, {"sleeve_length": 0.2}, FABRIC)


def test_it_comes_back_from_json() -> None:
    for condition in (Condition(3, NAMES), Condition(1, (), False, False, True, False)):
        assert Condition.from_json(json.loads(json.dumps(asdict(condition)))) == condition


def sample(parameters: dict[str, float], beta: list[float]) -> Sample:
    mesh = template("tee", parameters, 403)
    moving = track(np.zeros((1, 24, 3)))
    own = replace(moving, beta=np.array(beta))
    positions = np.zeros((1, mesh.num_vertices, 3), np.float32)
    return Sample("s", "sequence", mesh, positions, Certificate(), FPS, own)


def test_what_varies_in_samples_is_what_is_told() -> None:
    samples = [
        sample({"sleeve_length": 0.2}, [0.0, 1.0, 0.0]),
        sample({"sleeve_length": 0.2, "neckline_depth": 0.1}, [0.5]),
        sample({"sleeve_length": 0.3}, []),
    ]
    assert varied_parameters(samples) == ("sleeve_length", "neckline_depth")
    assert varied_parameters(samples[:1]) == ()
    assert used_betas(samples) == 2
    assert used_betas(samples[2:]) == 1


def test_hands_and_feet_do_not_matter() -> None:
    motion = swinging(4)
    other = motion.poses.copy()
    unseen = [number for number in range(1, 24) if number not in JOINTS]
    other[:, unseen] += 0.3
    assert {JOINT["left_wrist"], JOINT["right_foot"], JOINT["head"]} <= set(unseen)
    np.testing.assert_array_equal(pose_features(motion.poses), pose_features(other))
    rates = (motion_features(poses, motion.translations, FPS) for poses in (motion.poses, other))
    np.testing.assert_array_equal(*rates)
