from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from muslin.garments.errors import InputError
from muslin.sim.body import BodyModel, load_body
from muslin.sim.body.joints import PARENTS


@pytest.fixture
def body() -> BodyModel:
    return load_body("female")


def slow_vertices(
    model: BodyModel, beta: NDArray[Any], theta: NDArray[Any], translation: NDArray[Any], chosen: NDArray[Any]
) -> NDArray[np.float64]:
    """The equation of the model, one homogeneous matrix and one vertex at a time."""
    local = Rotation.from_rotvec(theta).as_matrix()
    rest = model.joint_template + model.joint_shapedirs @ beta
    world: list[NDArray[np.float64]] = []
    for joint, parent in enumerate(PARENTS):
        step = np.eye(4)
        step[:3, :3] = local[joint]
        step[:3, 3] = rest[joint] - (rest[parent] if parent >= 0 else 0.0)
        world.append(step if parent < 0 else world[parent] @ step)
    features = np.concatenate([(local[joint] - np.eye(3)).ravel() for joint in range(1, 24)])
    result = []
    for v in chosen:
        point = model.v_template[v] + model.shapedirs[v] @ beta + model.posedirs[v] @ features
        moved = np.zeros(3)
        for joint in range(24):
            moved += model.weights[v, joint] * (world[joint] @ np.append(point - rest[joint], 1.0))[:3]
        result.append(moved + translation)
    return np.array(result)


@pytest.mark.parametrize("seed", range(3))
def test_vertices_follow_the_equation(body: BodyModel, seed: int) -> None:
    generator = np.random.default_rng(seed)
    beta, theta = generator.normal(size=10), 0.5 * generator.normal(size=(24, 3))
    translation, chosen = generator.normal(size=3), generator.integers(0, body.num_vertices, 40)
    expected = slow_vertices(body, beta, theta, translation, chosen)
    np.testing.assert_allclose(body.vertices(beta, theta, translation)[chosen], expected, atol=1e-12)


def test_dense_pose_shapes_give_what_sparse_ones_give(body: BodyModel) -> None:
    dense = replace(body, posedirs=body.posedirs + 1e-300)
    theta = 0.4 * np.random.default_rng(0).normal(size=(24, 3))
    assert isinstance(dense._pose_operator, np.ndarray)
    assert not isinstance(body._pose_operator, np.ndarray)
    np.testing.assert_allclose(dense.pose_offsets(theta), body.pose_offsets(theta), atol=1e-14)


def test_zero_pose_and_zero_shape_give_the_template(body: BodyModel) -> None:
    np.testing.assert_allclose(body.vertices(np.zeros(10), np.zeros((24, 3))), body.v_template, atol=1e-15)
    np.testing.assert_allclose(body.joints(np.zeros(10)), body.joint_template, atol=1e-15)
    np.testing.assert_allclose(
        body.transforms(None, np.zeros((24, 3))), np.tile(np.eye(4), (24, 1, 1)), atol=1e-15
    )


def test_turning_the_root_turns_the_body_about_the_pelvis(
    body: BodyModel, walking: NDArray[np.float64]
) -> None:
    beta = np.linspace(-1.0, 1.0, 10)
    turn = Rotation.from_rotvec([0.4, -1.2, 0.7])
    turned = walking.copy()
    turned[0] = (turn * Rotation.from_rotvec(walking[0])).as_rotvec()
    pelvis = body.joints(beta)[0]
    expected = turn.apply(body.vertices(beta, walking) - pelvis) + pelvis
    np.testing.assert_allclose(body.vertices(beta, turned), expected, atol=1e-13)


def test_pose_shapes_ignore_the_root(body: BodyModel, walking: NDArray[np.float64]) -> None:
    turned = walking.copy()
    turned[0] = [1.0, 2.0, 3.0]
    np.testing.assert_array_equal(body.pose_offsets(turned), body.pose_offsets(walking))


def test_translation_is_added_last(body: BodyModel, walking: NDArray[np.float64]) -> None:
    shift = np.array([1.0, -2.0, 0.5])
    moved = body.vertices(None, walking, shift) - body.vertices(None, walking)
    np.testing.assert_allclose(moved, np.broadcast_to(shift, moved.shape), atol=1e-14)
    np.testing.assert_allclose(
        body.joints(None, walking, shift) - body.joints(None, walking), np.tile(shift, (24, 1))
    )


def test_bones_keep_their_length_in_any_pose(body: BodyModel) -> None:
    theta = np.random.default_rng(3).normal(size=(7, 24, 3))
    beta = np.random.default_rng(4).normal(size=10)
    posed, rest = body.joints(beta, theta), body.joints(beta)
    parents = np.array(PARENTS[1:])
    lengths = np.linalg.norm(posed[:, 1:] - posed[:, parents], axis=-1)
    np.testing.assert_allclose(lengths, np.tile(np.linalg.norm(rest[1:] - rest[parents], axis=-1), (7, 1)))


def test_joint_transforms_carry_rest_joints_to_posed_joints(
    body: BodyModel, walking: NDArray[np.float64]
) -> None:
    beta, shift = np.full(10, 0.5), np.array([0.1, 0.2, 0.3])
    transforms = body.transforms(beta, walking, shift)
    rest = np.concatenate([body.joints(beta), np.ones((24, 1))], axis=1)
    carried = np.einsum("jab,jb->ja", transforms, rest)[:, :3]
    np.testing.assert_allclose(carried, body.joints(beta, walking, shift), atol=1e-14)


def test_a_batch_is_its_frames(body: BodyModel) -> None:
    generator = np.random.default_rng(5)
    theta, shifts = 0.3 * generator.normal(size=(2, 11, 24, 3)), generator.normal(size=(11, 3))
    betas = generator.normal(size=(2, 1, 10))
    together = body.vertices(betas, theta.reshape(2, 11, 72), shifts)
    assert together.shape == (2, 11, body.num_vertices, 3)
    for a, b in [(0, 0), (0, 10), (1, 4)]:
        alone = body.vertices(betas[a, 0], theta[a, b], shifts[b])
        np.testing.assert_allclose(together[a, b], alone, atol=1e-14)


def test_missing_betas_are_zero(body: BodyModel) -> None:
    np.testing.assert_array_equal(body.vertices([1.5, -1.0]), body.vertices([1.5, -1.0] + 8 * [0.0]))


def test_ground_offset_puts_the_feet_on_the_ground(body: BodyModel, walking: NDArray[np.float64]) -> None:
    theta = np.stack([np.zeros((24, 3)), walking])
    offsets = body.ground_offset([2.0], theta)
    shifts = np.zeros((2, 3))
    shifts[:, 1] = offsets
    np.testing.assert_allclose(body.vertices([2.0], theta, shifts)[..., 1].min(axis=1), 0.0, atol=1e-15)


def test_digest_tells_bodies_apart(body: BodyModel) -> None:
    moved = body.v_template.copy()
    moved[17, 1] += 1e-9
    assert replace(body, name="other", source="elsewhere").digest == body.digest
    assert replace(body, v_template=moved).digest != body.digest
    assert len(body.digest) == 64


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([float("nan")],), "beta holds NaN"),
        ((np.zeros(11),), r"beta has shape \(11,\)"),
        ((3.0,), "beta has shape"),
        ((None, np.zeros((23, 3))), "theta has shape"),
        ((None, np.full((24, 3), np.inf)), "theta holds NaN or infinity"),
        ((None, None, [0.0, 1.0]), "translation has shape"),
        ((None, None, float("nan")), "translation holds NaN"),
    ],
)
def test_bad_parameters_are_named(body: BodyModel, arguments: tuple[Any, ...], message: str) -> None:
    with pytest.raises(InputError, match=message):
        body.vertices(*arguments)


def test_bad_arrays_are_named(body: BodyModel) -> None:
    bad_weights, bad_faces, bad_parents = body.weights.copy(), body.faces.copy(), body.parents.copy()
    bad_weights[5, 0] += 0.1
    bad_faces[3, 1] = body.num_vertices
    bad_parents[4] = 9
    broken = body.shapedirs.copy()
    broken[0, 0, 0] = np.nan
    for change, message in [
        ({"weights": bad_weights}, "rows that sum to 1"),
        ({"faces": bad_faces}, f"faces index {body.num_vertices}"),
        ({"parents": bad_parents}, "no tree"),
        ({"shapedirs": broken}, "shapedirs holds NaN"),
        ({"posedirs": body.posedirs[:, :, :200]}, "posedirs has shape"),
    ]:
        with pytest.raises(InputError, match=message):
            replace(body, **change)
