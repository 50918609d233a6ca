"""The mathematics of the bake; sampling anny itself needs anny and is not repeated here."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from muslin.sim.body import load_body
from muslin.sim.body.bake.asset import POSE_STEP, SHAPE_STEP, quantised, quantised_weights, write_asset
from muslin.sim.body.bake.dual_quaternions import dual_quaternion_skinning, quaternion_product
from muslin.sim.body.bake.pose_shapes import explained_share, fit_pose_shapes, pose_features, pose_targets
from muslin.sim.body.bake.poses import sample_poses
from muslin.sim.body.bake.shape_space import fit_joint_regressor, fit_shape_space
from muslin.sim.body.bake.t_pose import minimal_rotation, to_t_pose
from muslin.sim.body.joints import JOINT
from muslin.sim.body.smpl_npz import read_npz

Floats = NDArray[np.float64]


def test_minimal_rotation_turns_one_direction_into_the_other_and_nothing_else() -> None:
    generator = np.random.default_rng(0)
    for _ in range(20):
        source, target = generator.normal(size=(2, 3))
        turn = minimal_rotation(source, target)
        np.testing.assert_allclose(
            turn @ source / np.linalg.norm(source), target / np.linalg.norm(target), atol=1e-12
        )
        axis = np.cross(source, target)
        np.testing.assert_allclose(turn @ axis, axis, atol=1e-12)
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)


def test_t_pose_skins_back_to_the_pose_it_came_from() -> None:
    body = load_body("female")
    theta = np.zeros((24, 3))
    theta[JOINT["left_shoulder"]], theta[JOINT["right_shoulder"]] = [0, 0.1, -0.8], [0, -0.1, 0.8]
    theta[JOINT["left_elbow"]], theta[JOINT["right_elbow"]] = [0, -0.7, 0], [0, 0.7, 0]
    transforms = body.transforms(None, theta)
    blended = np.einsum("vj,jab->vab", body.weights, transforms)
    a_pose = np.einsum("vab,vb->va", blended[:, :3, :3], body.v_template) + blended[:, :3, 3]
    vertices, joints = to_t_pose(a_pose, body.joints(None, theta), body.weights)
    np.testing.assert_allclose(joints, body.joint_template, atol=1e-4)
    np.testing.assert_allclose(vertices, body.v_template, atol=1e-3)


def test_quaternion_product_is_composition() -> None:
    a, b = Rotation.random(2, random_state=0)
    product = quaternion_product(a.as_quat(scalar_first=True), b.as_quat(scalar_first=True))
    np.testing.assert_allclose(
        Rotation.from_quat(product, scalar_first=True).as_matrix(), (a * b).as_matrix()
    )


def test_dual_quaternions_are_exact_where_one_joint_rules_and_follow_rigid_motions() -> None:
    generator = np.random.default_rng(1)
    body = load_body("male")
    theta = 0.5 * generator.normal(size=(24, 3))
    transforms = body.transforms(None, theta)
    points = body.v_template[::10]
    ruled = np.eye(24)[generator.integers(0, 24, len(points))]
    chosen = transforms[np.argmax(ruled, axis=1)]
    expected = np.einsum("vab,vb->va", chosen[:, :3, :3], points) + chosen[:, :3, 3]
    np.testing.assert_allclose(dual_quaternion_skinning(points, ruled, transforms), expected, atol=1e-12)
    rigid = np.eye(4)
    rigid[:3, :3], rigid[:3, 3] = Rotation.from_rotvec([2.0, 1.0, -1.0]).as_matrix(), [1.0, 2.0, 3.0]
    moved = dual_quaternion_skinning(points, body.weights[::10], rigid @ transforms)
    once = dual_quaternion_skinning(points, body.weights[::10], transforms)
    np.testing.assert_allclose(moved, once @ rigid[:3, :3].T + rigid[:3, 3], atol=1e-12)


def test_pose_shapes_recover_a_linear_law_and_stay_local() -> None:
    poses = sample_poses(300, seed=0)
    weights = np.zeros((3, 24))
    weights[0, [JOINT["left_hip"], JOINT["left_knee"]]] = 0.5
    weights[1, JOINT["head"]] = 1.0
    weights[2, [JOINT["left_shoulder"], JOINT["spine3"]]] = 0.5
    knee = np.arange(9) + 9 * (JOINT["left_knee"] - 1)
    law = np.zeros((3, 3, 207))
    law[0][:, knee] = np.random.default_rng(2).normal(size=(3, 9))
    offsets = np.einsum("vak,nk->nva", law, pose_features(poses))
    fitted = fit_pose_shapes(poses, offsets, weights, ridge=1e-12)
    assert explained_share(poses, offsets, fitted) > 0.9999
    used = np.abs(fitted).max(axis=1).reshape(3, 23, 9).max(axis=2) > 0.0
    joints = [{int(joint) + 1 for joint in np.flatnonzero(row)} for row in used]
    # the topmost of the moving joints turns everything alike and shapes nothing; no law, no shape
    assert joints[0] <= {JOINT["left_knee"]}
    assert joints[1] == set()
    assert joints[2] <= {JOINT["left_collar"], JOINT["left_shoulder"]}


def test_committed_pose_shapes_follow_dual_quaternions_in_poses_not_fitted() -> None:
    body = load_body("female")
    poses = sample_poses(12, seed=99)
    assert explained_share(poses, pose_targets(body, poses), body.posedirs) > 0.85


def test_poses_are_mirrored_and_inside_their_limits() -> None:
    poses = np.degrees(sample_poses(4000, seed=1))
    left, right = poses[:, JOINT["left_knee"]], poses[:, JOINT["right_knee"]]
    for knees in (left, right):
        assert knees[:, 0].min() >= 0.0
        assert knees[:, 0].max() <= 140.0
    left, right = poses[:, JOINT["left_shoulder"]], poses[:, JOINT["right_shoulder"]]
    np.testing.assert_allclose(left.mean(axis=0), right.mean(axis=0) * [1, -1, -1], atol=3.0)
    assert not poses[:, 0].any()


@pytest.fixture
def population() -> tuple[Floats, Floats, Floats]:
    """300 scaled, widened copies of a coarse sphere, with joints that scale along; two true components."""
    generator = np.random.default_rng(3)
    directions = generator.normal(size=(500, 3))
    sphere = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    centres = 0.3 * generator.normal(size=(24, 3)).clip(-1, 1)
    scale = 1.0 + 0.1 * generator.standard_normal(300)[:, None, None]
    width = np.stack([0.05 * generator.standard_normal(300), np.zeros(300), np.zeros(300)], axis=1)[:, None]
    return scale * sphere + width * sphere, scale * centres, np.ones((500, 24)) / 24.0


def test_shape_space_recovers_true_components_in_standard_deviations(
    population: tuple[Floats, Floats, Floats],
) -> None:
    vertices, joints, _ = population
    hull = ConvexHull(vertices.mean(axis=0))
    faces = hull.simplices.astype(np.int32)
    corners = vertices.mean(axis=0)[faces]
    inward = (
        np.einsum(
            "fi,fi->f", np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), corners[:, 0]
        )
        < 0
    )
    faces[inward] = faces[inward][:, ::-1]
    space = fit_shape_space(vertices, joints, faces)
    assert space.explained[:2].sum() == pytest.approx(1.0)
    assert space.vertex_error < 1e-9
    scores = (vertices - space.v_template).reshape(300, -1) @ np.linalg.pinv(
        space.shapedirs[..., :2].reshape(-1, 2)
    ).T
    np.testing.assert_allclose(scores.std(axis=0, ddof=1), 1.0)
    # bigger spheres have the larger first beta
    assert np.corrcoef(scores[:, 0], np.linalg.norm(vertices, axis=2).mean(axis=1))[0, 1] > 0.9


def test_regressor_is_a_sparse_average_that_finds_the_joints(
    population: tuple[Floats, Floats, Floats],
) -> None:
    vertices, joints, weights = population
    regressor = fit_joint_regressor(vertices, joints, weights)
    assert (regressor >= 0.0).all()
    np.testing.assert_allclose(regressor.sum(axis=1), 1.0)
    assert (np.count_nonzero(regressor, axis=1) <= 160).all()
    # the joints scale with the sphere but do not widen with it: a few millimetres stay
    assert np.linalg.norm(regressor @ vertices[0] - joints[0], axis=1).max() < 0.05


def test_quantised_weights_sum_exactly() -> None:
    weights = np.random.default_rng(0).random((1000, 24)) ** 4
    weights /= weights.sum(axis=1, keepdims=True)
    steps = quantised_weights(weights)
    assert (steps.sum(axis=1) == 1 << 14).all()
    np.testing.assert_allclose(steps / (1 << 14), weights, atol=24 * 0.5 / (1 << 14))


def test_an_asset_reads_back_within_its_steps(tmp_path: Path) -> None:
    body = load_body("neutral")
    generator = np.random.default_rng(0)
    shapedirs, posedirs = (
        0.02 * generator.normal(size=(50, 3, 10)),
        0.05 * generator.normal(size=(50, 3, 207)),
    )
    write_asset(
        tmp_path / "body.npz", v_template=body.v_template[:50], shapedirs=shapedirs, posedirs=posedirs,
        joint_template=body.joint_template, joint_shapedirs=body.joint_shapedirs,
        joint_regressor=np.zeros((24, 50)), weights=body.weights[:50],
        faces=np.array([[0, 1, 2]], dtype=np.int32), source="test",
    )  # fmt: skip
    model = load_body(tmp_path / "body.npz")
    np.testing.assert_allclose(model.shapedirs, shapedirs, atol=0.51 * SHAPE_STEP)
    np.testing.assert_allclose(model.posedirs, posedirs, atol=0.51 * POSE_STEP)
    np.testing.assert_array_equal(model.weights, body.weights[:50])
    np.testing.assert_array_equal(model.joint_template, body.joint_template)
    assert str(read_npz(tmp_path / "body.npz", ["source"])["source"]) == "test"


def test_values_beyond_16_bits_are_an_error() -> None:
    with pytest.raises(OverflowError, match="16 bits"):
        quantised(np.array([1.0]), 1e-5)
