"""Arc length, area and arc-length sampling of boundary curves."""

from __future__ import annotations

import numpy as np
import pytest

from muslin.garments.curves import CubicBezier, Line

RNG = np.random.default_rng(3)
BEZIERS = [CubicBezier(*(tuple(p) for p in RNG.uniform(-1.0, 1.0, size=(4, 2)).tolist())) for _ in range(8)]


def test_line_has_pythagorean_length_and_even_points() -> None:
    line = Line((1.0, 2.0), (4.0, 6.0))
    assert line.length == pytest.approx(5.0, abs=1e-15)
    np.testing.assert_allclose(line.at_fraction([0.0, 0.2, 1.0]), [[1, 2], [1.6, 2.8], [4, 6]], atol=1e-15)


def test_straight_bezier_is_the_line() -> None:
    line, bezier = Line((0.0, 0.0), (3.0, 1.5)), CubicBezier((0, 0), (0.2, 0.1), (2.4, 1.2), (3, 1.5))
    assert bezier.length == pytest.approx(line.length, abs=1e-14)
    s = np.linspace(0.0, 1.0, 11)
    np.testing.assert_allclose(bezier.at_fraction(s), line.at_fraction(s), atol=1e-13)


@pytest.mark.parametrize("curve", BEZIERS)
def test_length_is_the_limit_of_chord_sums(curve: CubicBezier) -> None:
    def chords(count: int) -> float:
        return float(np.linalg.norm(np.diff(curve.at(np.linspace(0, 1, count + 1)), axis=0), axis=1).sum())

    # Chord sums converge from below with order 2; one Richardson step cancels the leading error.
    coarse, fine = chords(20000), chords(40000)
    assert coarse <= fine <= curve.length
    assert curve.length == pytest.approx(fine + (fine - coarse) / 3.0, abs=1e-6)


@pytest.mark.parametrize("curve", BEZIERS)
def test_fractions_are_fractions_of_arc_length(curve: CubicBezier) -> None:
    points = curve.at_fraction(np.linspace(0.0, 1.0, 4001))
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    # A chord is shorter than its arc by curvature^2 s^3 / 24; where the curve turns sharply that is most.
    assert np.median(steps) == pytest.approx(curve.length / 4000, rel=1e-6)
    assert steps.max() <= curve.length / 4000 * (1.0 + 1e-9)
    np.testing.assert_array_equal(points[[0, -1]], [curve.start, curve.end])


@pytest.mark.parametrize("curve", BEZIERS)
def test_derivative_matches_central_differences(curve: CubicBezier) -> None:
    t, h = np.linspace(0.01, 0.99, 9), 1e-6
    numeric = (curve.at(t + h) - curve.at(t - h)) / (2 * h)
    np.testing.assert_allclose(curve.derivative(t), numeric, atol=1e-8)


@pytest.mark.parametrize("curve", BEZIERS)
def test_signed_area_matches_fine_polygon(curve: CubicBezier) -> None:
    p = curve.at(np.linspace(0.0, 1.0, 20001))
    polygon = 0.5 * (p[:-1, 0] * p[1:, 1] - p[1:, 0] * p[:-1, 1]).sum()
    assert curve.signed_area == pytest.approx(polygon, abs=1e-8)


@pytest.mark.parametrize("curve", [*BEZIERS, Line((0.3, -1.0), (2.0, 0.7))])
def test_mirrored_curve_runs_backwards_through_reflected_points(curve: CubicBezier | Line) -> None:
    s = np.linspace(0.0, 1.0, 7)
    np.testing.assert_allclose(curve.mirrored().at(s), curve.at(1.0 - s) * [-1.0, 1.0], atol=1e-14)
    assert curve.mirrored().length == pytest.approx(curve.length, abs=1e-13)
    # Reflection and reversal each change the sign of the area.
    assert curve.mirrored().signed_area == pytest.approx(curve.signed_area, abs=1e-13)
