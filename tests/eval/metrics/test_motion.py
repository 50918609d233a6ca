"""Derivatives of motion against polynomials and waves, jitter against white noise."""

import numpy as np
import pytest

from muslin.eval.metrics.motion import (
    acceleration_errors,
    derivative_errors,
    derivatives,
    jerk_errors,
    jerk_sizes,
    jitter,
    velocity_errors,
)
from muslin.garments.errors import InputError

FPS = 24.0
COEFFICIENTS = np.random.default_rng(0).normal(size=(4, 5, 3))  # of t^0 to t^3, of five vertices


def polynomial(degree: int, frames: int = 9, fps: float = FPS) -> np.ndarray:
    t = np.arange(frames) / fps
    return sum(t[:, None, None] ** k * COEFFICIENTS[k] for k in range(degree + 1))


@pytest.mark.parametrize("order", [1, 2, 3])
def test_polynomial_motion_has_exact_derivatives(order):
    factorial = (1, 1, 2, 6)[order]
    expected = np.broadcast_to(factorial * COEFFICIENTS[order], (9 - order, 5, 3))
    assert derivatives(polynomial(order), FPS, order) == pytest.approx(expected, rel=1e-8)
    assert derivatives(polynomial(order - 1), FPS, order) == pytest.approx(
        np.zeros((9 - order, 5, 3)), abs=1e-9
    )


@pytest.mark.parametrize("order", [1, 2, 3])
def test_derivative_at_the_middle_converges_by_second_order(order):
    errors = []
    for fps in (50.0, 100.0, 200.0):
        t = (np.arange(order + 1) - 0.5 * order) / fps
        window = np.sin(7.0 * t + 0.7)[:, None, None] * np.ones((1, 1, 3))
        exact = 7.0**order * np.sin(0.7 + order * np.pi / 2)
        errors.append(np.abs(derivatives(window, fps, order) - exact).max())
    ratios = np.array(errors[:-1]) / errors[1:]
    assert ratios == pytest.approx([4.0, 4.0], rel=0.05)


def test_errors_are_those_of_the_difference_and_of_each_window():
    rng = np.random.default_rng(1)
    x, y = rng.normal(size=(2, 7, 4, 3))
    slow = [
        np.linalg.norm(
            [(x[t + 3] - y[t + 3]) - 3 * (x[t + 2] - y[t + 2]) + 3 * (x[t + 1] - y[t + 1]) - (x[t] - y[t])],
            axis=-1,
        )[0]
        * FPS**3
        for t in range(4)
    ]
    assert jerk_errors(x, y, FPS) == pytest.approx(np.array(slow))
    windows = [acceleration_errors(x[t : t + 3], y[t : t + 3], FPS)[0] for t in range(5)]
    assert acceleration_errors(x, y, FPS) == pytest.approx(np.array(windows))
    plain = np.linalg.norm((x[1:] - x[:-1]) - (y[1:] - y[:-1]), axis=-1) * FPS
    assert velocity_errors(x, y, FPS) == pytest.approx(plain)


def test_constant_velocity_offset_is_no_error_of_acceleration():
    x = polynomial(3)
    drift = np.arange(9)[:, None, None] * np.array([0.01, 0.0, -0.02])
    assert acceleration_errors(x + drift + 0.3, x, FPS).max() < 1e-9
    assert derivative_errors(x + drift, x, FPS, 1) == pytest.approx(
        np.full((8, 5), np.hypot(0.01, 0.02) * FPS)
    )


def test_jitter_of_white_noise_is_its_closed_form_and_scales_as_the_cube_of_the_rate():
    rng = np.random.default_rng(2)
    noise = 1e-3 * rng.normal(size=(300, 200, 3))
    found = jitter(noise, polynomial(3, 300)[:, :1], 30.0)
    assert found.prediction == pytest.approx(1e-3 * 30.0**3 * np.sqrt(20.0 * 8.0 / np.pi), rel=0.01)
    assert jitter(noise, noise, 60.0).truth == pytest.approx(8.0 * found.prediction)
    assert jitter(noise, noise, 60.0).ratio == 1.0
    assert jitter(1.5 * noise, noise, 60.0).ratio == pytest.approx(1.5)


def test_jitter_ignores_rigid_placement_and_uniform_acceleration_and_weighs():
    x = polynomial(3)
    turned = x @ np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]) + 5.0
    assert jitter(turned, x, FPS).ratio == pytest.approx(1.0)
    assert jitter(x + polynomial(2), x, FPS).prediction == pytest.approx(jitter(x, x, FPS).truth)
    only = np.eye(5)[3]
    assert jitter(x, x, FPS, only).truth == pytest.approx(6.0 * np.linalg.norm(COEFFICIENTS[3, 3]))
    assert jitter(x, np.zeros_like(x), FPS).ratio is None
    by_window = np.mean([jerk_sizes(x[t : t + 4], FPS).mean() for t in range(6)])
    assert jitter(x, x, FPS).truth == pytest.approx(by_window)


@pytest.mark.parametrize(
    "call",
    [
        lambda: derivatives(np.zeros((3, 2, 3)), FPS, 3),
        lambda: derivatives(np.zeros((5, 2, 3)), FPS, 4),
        lambda: derivatives(np.zeros((5, 2, 3)), np.nan, 2),
        lambda: derivatives(np.zeros((5, 0, 3)), FPS, 2),
        lambda: derivatives(np.full((5, 2, 3), np.nan), FPS, 2),
        lambda: jerk_errors(np.zeros((5, 2, 3)), np.zeros((5, 3, 3)), FPS),
        lambda: jerk_errors(np.full((5, 2, 3), np.inf), np.full((5, 2, 3), np.inf), FPS),
        lambda: jitter(np.zeros((5, 2, 3)), np.zeros((6, 2, 3)), FPS),
        lambda: jitter(np.zeros((5, 2, 3)), np.zeros((5, 2, 3)), FPS, np.ones(3)),
    ],
)
def test_bad_input_is_named(call):
    with pytest.raises(InputError):
        call()
