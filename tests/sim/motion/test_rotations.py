"""Quaternion algebra against SciPy's rotations and against identities."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from muslin.sim.motion.rotations import (
    about_y,
    aligned,
    angular_speed,
    axis_angle_from_quaternion,
    between,
    conjugate,
    heading,
    matrix_from_quaternion,
    multiply,
    quaternion_from_axis_angle,
    rotate,
    slerp,
    smooth,
)

RNG = np.random.default_rng(5)
VECTORS = np.concatenate([RNG.normal(size=(50, 3)), np.zeros((1, 3)), [[1e-9, 0, 0], [0, np.pi - 1e-7, 0]]])


def scipy_of(quaternions: np.ndarray) -> Rotation:
    return Rotation.from_quat(quaternions, scalar_first=True)


def test_axis_angle_to_quaternion_and_matrix_agree_with_scipy() -> None:
    q = quaternion_from_axis_angle(VECTORS)
    np.testing.assert_allclose(np.linalg.norm(q, axis=-1), 1.0, atol=1e-15)
    np.testing.assert_allclose(
        matrix_from_quaternion(q), Rotation.from_rotvec(VECTORS).as_matrix(), atol=1e-14
    )


def test_axis_angle_round_trip_takes_the_short_way() -> None:
    back = axis_angle_from_quaternion(quaternion_from_axis_angle(VECTORS))
    np.testing.assert_allclose(back, Rotation.from_rotvec(VECTORS).as_rotvec(), atol=1e-9)
    assert np.all(np.linalg.norm(back, axis=-1) <= np.pi + 1e-12)


def test_product_and_rotation_agree_with_scipy() -> None:
    p, q = quaternion_from_axis_angle(RNG.normal(size=(2, 40, 3)))
    v = RNG.normal(size=(40, 3))
    np.testing.assert_allclose(
        matrix_from_quaternion(multiply(p, q)), (scipy_of(p) * scipy_of(q)).as_matrix(), atol=1e-14
    )
    np.testing.assert_allclose(rotate(q, v), scipy_of(q).apply(v), atol=1e-14)
    np.testing.assert_allclose(rotate(conjugate(q), rotate(q, v)), v, atol=1e-14)


def test_slerp_midpoint_is_half_the_turn() -> None:
    axis = np.array([0.6, 0.0, 0.8])
    start = quaternion_from_axis_angle(np.array([0.3, -0.4, 1.0]))
    end = multiply(start, quaternion_from_axis_angle(2.0 * axis))
    middle = slerp(start, end, 0.5)
    np.testing.assert_allclose(
        axis_angle_from_quaternion(multiply(conjugate(start), middle)), axis, atol=1e-14
    )
    np.testing.assert_allclose(slerp(start, end, 0.0), start, atol=1e-15)
    # -q is the same rotation and must not send the interpolation the long way round.
    np.testing.assert_allclose(
        matrix_from_quaternion(slerp(start, -end, 0.5)), matrix_from_quaternion(middle), atol=1e-14
    )


def test_between_turns_one_direction_into_the_other_by_the_smallest_angle() -> None:
    a, b = RNG.normal(size=(2, 60, 3))
    q = between(a, b)
    turned = rotate(q, a / np.linalg.norm(a, axis=-1, keepdims=True))
    np.testing.assert_allclose(turned, b / np.linalg.norm(b, axis=-1, keepdims=True), atol=1e-13)
    cosine = np.sum(a * b, axis=-1) / np.linalg.norm(a, axis=-1) / np.linalg.norm(b, axis=-1)
    np.testing.assert_allclose(
        np.linalg.norm(axis_angle_from_quaternion(q), axis=-1), np.arccos(cosine), atol=1e-7
    )


@pytest.mark.parametrize("axis", np.eye(3))
def test_between_opposite_directions_is_half_a_turn(axis: np.ndarray) -> None:
    np.testing.assert_allclose(rotate(between(axis, -axis), axis), -axis, atol=1e-15)


@pytest.mark.parametrize("angle", [-3.0, -0.5, 0.0, 1.2, 3.1])
def test_heading_recovers_the_turn_about_the_vertical(angle: float) -> None:
    tilt = quaternion_from_axis_angle(np.array([0.4, 0.0, -0.3]))
    assert heading(multiply(about_y(angle), tilt)) == pytest.approx(angle, abs=1e-12)
    np.testing.assert_allclose(rotate(about_y(0.5 * np.pi), [0.0, 0.0, 1.0]), [1.0, 0.0, 0.0], atol=1e-15)


def test_angular_speed_of_a_steady_turn() -> None:
    q = quaternion_from_axis_angle(np.arange(200)[:, None] * np.array([0.0, 0.1, 0.0]))
    np.testing.assert_allclose(angular_speed(q, 30.0), 3.0, atol=1e-10)


def test_smoothing_keeps_a_steady_turn_and_undoes_sign_flips() -> None:
    q = quaternion_from_axis_angle(np.arange(200)[:, None] * np.array([0.0, 0.02, 0.01]))
    q[::3] *= -1.0
    assert np.all(np.sum(aligned(q)[1:] * aligned(q)[:-1], axis=-1) > 0.0)
    inner = slice(20, -20)
    difference = multiply(conjugate(q), smooth(q, 3.0))[inner]
    assert np.linalg.norm(axis_angle_from_quaternion(difference), axis=-1).max() < 1e-6


def test_smoothing_reduces_noise() -> None:
    noise = 0.05 * RNG.normal(size=(400, 3))
    smoothed = axis_angle_from_quaternion(smooth(quaternion_from_axis_angle(noise), 4.0))
    # White noise through a Gaussian of width s keeps 1 / (2 s sqrt(pi)) of its variance.
    assert smoothed.std() == pytest.approx(0.05 * np.sqrt(1.0 / (8.0 * np.sqrt(np.pi))), rel=0.2)
