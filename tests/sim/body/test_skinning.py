from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from muslin.garments.errors import InputError
from muslin.sim.body import BodyModel, load_body
from muslin.sim.body.skinning import bind, pose, unpose

Floats = NDArray[np.float64]


@pytest.fixture
def body() -> BodyModel:
    return load_body("male")


@pytest.fixture
def beta() -> Floats:
    return np.array([1.0, -0.5, 0.5])


@pytest.fixture
def cloth(body: BodyModel, beta: Floats) -> Floats:
    """Points up to 4 cm off the skin in T-pose."""
    generator = np.random.default_rng(0)
    skin = body.vertices(beta)[generator.integers(0, body.num_vertices, 500)]
    return skin + generator.uniform(-0.04, 0.04, size=skin.shape)


def test_weights_are_a_partition_of_unity(body: BodyModel, beta: Floats, cloth: Floats) -> None:
    binding = bind(cloth, body, beta)
    assert (binding.weights >= 0.0).all()
    np.testing.assert_allclose(binding.weights.sum(axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(binding.barycentric.sum(axis=1), 1.0, atol=1e-14)


def test_distances_are_those_to_the_interpolated_point(body: BodyModel, beta: Floats, cloth: Floats) -> None:
    binding = bind(cloth, body, beta)
    nearest = binding.interpolate(body.vertices(beta))
    np.testing.assert_allclose(np.linalg.norm(cloth - nearest, axis=1), binding.distances, atol=1e-7)
    to_vertices = np.linalg.norm(cloth[:50, None] - body.vertices(beta), axis=-1).min(axis=1)
    assert (binding.distances[:50] <= to_vertices + 1e-12).all()


def test_unpose_inverts_pose(body: BodyModel, beta: Floats, cloth: Floats, walking: Floats) -> None:
    binding = bind(cloth, body, beta)
    shift = np.array([0.3, 1.0, -2.0])
    posed = pose(cloth, binding, beta, walking, shift)
    assert np.linalg.norm(posed - cloth, axis=1).max() > 0.5
    np.testing.assert_allclose(unpose(posed, binding, beta, walking, shift), cloth, atol=1e-12)


def test_the_skin_itself_is_posed_as_the_body_is(body: BodyModel, beta: Floats, walking: Floats) -> None:
    chosen = np.arange(0, body.num_vertices, 25)
    binding = bind(body.vertices(beta)[chosen], body, beta)
    posed = pose(body.vertices(beta)[chosen], binding, beta, walking)
    np.testing.assert_allclose(posed, body.vertices(beta, walking)[chosen], atol=1e-9)


def test_the_rest_pose_changes_nothing(body: BodyModel, beta: Floats, cloth: Floats) -> None:
    binding = bind(cloth, body, beta)
    np.testing.assert_allclose(pose(cloth, binding, beta, np.zeros((24, 3))), cloth, atol=1e-14)


def test_a_turn_of_the_root_is_undone(body: BodyModel, cloth: Floats) -> None:
    theta = np.zeros((24, 3))
    theta[0] = [0.2, 2.5, -0.4]
    turned = Rotation.from_rotvec(theta[0]).apply(cloth)
    binding = bind(turned, body, None, theta)
    # the pelvis of the default bodies is the origin, so the root turns about it
    np.testing.assert_allclose(unpose(turned, binding, None, theta), cloth, atol=1e-6)


def test_binding_in_a_pose_uses_that_pose(body: BodyModel, beta: Floats, walking: Floats) -> None:
    posed = body.vertices(beta, walking, [0.0, 1.0, 0.0])[::40]
    assert bind(posed, body, beta, walking, [0.0, 1.0, 0.0]).distances.max() < 1e-6


def test_a_folding_pose_is_refused(body: BodyModel) -> None:
    elbow = body.joint_template[18] + [0.0, 0.05, 0.0]
    theta = np.zeros((24, 3))
    theta[18, 0] = np.pi
    binding = bind(elbow + np.linspace(-0.1, 0.1, 801)[:, None] * [1.0, 0.0, 0.0], body)
    with pytest.raises(InputError, match="cannot be unposed"):
        unpose(np.zeros((801, 3)), binding, None, theta)


@pytest.mark.parametrize(
    ("points", "message"), [(np.zeros(3), "points have shape"), ([[0.0, np.nan, 0.0]], "point 0 holds NaN")]
)
def test_bad_points_are_named(body: BodyModel, points: Floats, message: str) -> None:
    with pytest.raises(InputError, match=message):
        bind(points, body)


def test_several_frames_at_once_are_refused(body: BodyModel, cloth: Floats) -> None:
    with pytest.raises(InputError, match="one frame at a time"):
        pose(cloth, bind(cloth, body), None, np.zeros((2, 24, 3)))
