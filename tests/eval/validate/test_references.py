"""The known solutions themselves, each against something found another way."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from muslin.eval.validate.cases.catenary import arc, catenary
from muslin.eval.validate.cases.fabrics import known_stress, measured_table
from muslin.eval.validate.cases.flight import turning
from muslin.eval.validate.cases.hanging import depth, stretch
from muslin.eval.validate.cases.pendulum import exact_swing
from muslin.eval.validate.cases.stretch import Stretch
from muslin.eval.validate.cases.stretch import known_stress as plane_stress
from muslin.eval.validate.cases.support import folded
from muslin.eval.validate.elastica import heavy_elastica


@pytest.mark.parametrize("number", [0.1, 3.0, 100.0])
def test_elastica_is_that_of_shooting(number: float) -> None:
    """From the free end: theta = t, theta' = 0 there; t is what makes the clamp level."""

    def shot(t: float) -> np.ndarray:
        path = solve_ivp(
            lambda r, u: [u[1], -number * r * np.cos(u[0]), np.cos(u[0]), np.sin(u[0])],
            (0.0, 1.0),
            [t, 0.0, 0.0, 0.0],
            rtol=1e-11,
            atol=1e-12,
        )
        return path.y[:, -1]

    low, high = (0.0, 0.5 * np.pi) if number < 10.0 else (1.2, 0.5 * np.pi)
    tip = brentq(lambda t: shot(t)[0], low, high, xtol=1e-14)
    x, y = shot(tip)[2:]
    assert heavy_elastica(number).ratio == pytest.approx(y / x, rel=1e-5)


def test_elastica_of_a_stiff_strip_is_the_linear_beam() -> None:
    number = 1e-3
    assert heavy_elastica(number).ratio == pytest.approx(number / 8.0, rel=1e-5)
    s = heavy_elastica(number).s
    beam = number * (6.0 * s**2 - 4.0 * s**3 + s**4) / 24.0
    np.testing.assert_allclose(heavy_elastica(number).y, beam, atol=1e-5 * number)


def test_stretch_solves_its_cubic_on_both_sides_of_the_double_root() -> None:
    tension = np.array([0.0, 1e-6, 0.1, 1.0 / np.sqrt(27.0), 0.3, 5.0])
    found = stretch(tension)
    np.testing.assert_allclose(found * (found**2 - 1.0) / 2.0, tension, atol=1e-12)
    assert (found >= 1.0).all()


@pytest.mark.parametrize("load", [0.01, 0.3, 2.0])
def test_depth_is_the_integral_of_the_stretch(load: float) -> None:
    for s in (0.2, 0.7, 1.0):
        integral = quad(lambda s: float(stretch(np.array(load * (1.0 - s)))), 0.0, s)[0]
        assert float(depth(np.array(s), load)) == pytest.approx(integral, rel=1e-10)
    # A strip of little weight lengthens by half of what its top alone would: sigma g L^2 / (2 E h).
    assert float(depth(np.array(1.0), 1e-5)) - 1.0 == pytest.approx(0.5e-5, rel=1e-3)


@pytest.mark.parametrize("span", [0.3, 0.9])
def test_catenary_and_arc_have_length_and_span(span: float) -> None:
    s = np.linspace(-0.5, 0.5, 4001)
    for curve in (catenary, arc):
        x, y = curve(s, span)
        assert x[-1] - x[0] == pytest.approx(span, rel=1e-9)
        np.testing.assert_allclose(np.hypot(np.diff(x), np.diff(y)), s[1] - s[0], rtol=1e-5)
        assert abs(y[0]) < 1e-12
        assert abs(y[-1]) < 1e-12
        assert y.min() < 0.0


def test_catenary_is_in_balance() -> None:
    """Weight hangs in a constant horizontal force: y'' = sqrt(1 + y'^2) / a."""
    x, y = catenary(np.linspace(-0.5, 0.5, 2001), 0.6)
    slope = np.gradient(y, x)
    bend = np.gradient(slope, x)[2:-2] / np.sqrt(1.0 + slope[2:-2] ** 2)
    np.testing.assert_allclose(bend, bend.mean(), rtol=1e-3)


def test_plane_stress_of_a_free_pull_has_no_stress_across() -> None:
    table = Stretch(
        title="",
        young=1e6,
        poisson=0.3,
        thickness=1e-3,
        density=0.1,
        side=0.1,
        elements=1,
        stretches=[0.1],
        shears=[0.1],
        bar=0.01,
    )
    gradient = np.diag([np.sqrt(1.0 - 0.3 * (1.1**2 - 1.0)), 1.1])
    stress = plane_stress(table, gradient)
    assert abs(stress[0, 0]) < 1e-9
    assert stress[1, 1] == pytest.approx(1e3 * 1.1 * (1.1**2 - 1.0) / 2.0)


def test_table_stress_at_its_ends() -> None:
    entry = measured_table()["royal-target"]
    strain = 0.5 * ((7.0 / 6.0) ** 2 - 1.0)
    assert known_stress(entry, "warp", 1.0 / 6.0) == pytest.approx(
        2.0 * entry["stretch_strained"][0][0] * strain
    )
    assert known_stress(entry, "weft", 1.0 / 6.0) == pytest.approx(
        2.0 * entry["stretch_strained"][4][2] * strain
    )
    small = 1e-9
    assert known_stress(entry, "weft", small) / small == pytest.approx(
        2.0 * entry["stretch_rest"][2], rel=1e-6
    )
    c11, c12, c22, c33 = entry["stretch_rest"]
    # Pulled at 45 degrees G11 = G22 = G12 = g / 2; the stress along is s11 / 2 + s22 / 2 + s12.
    along = (c11 + c12) / 2.0 + (c12 + c22) / 2.0 + c33 / 2.0
    assert known_stress(entry, "45 degrees", small) / small == pytest.approx(along, rel=1e-6)


def test_turning_recursion_is_implicit_euler_of_a_rigid_body() -> None:
    """A cross of four masses, its step solved as the best rotation of 2 x - x_old by singular values."""
    spin, dt, steps = 4.0, 0.02, 30
    x = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    rest, v = x.copy(), spin * x @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    energy = []
    for _ in range(steps):
        u, _, vt = np.linalg.svd((x + dt * v).T @ rest)
        new = rest @ (u @ np.diag([1.0, np.linalg.det(u @ vt)]) @ vt).T
        v, x = (new - x) / dt, new
        energy.append((v**2).sum() / (4.0 * spin**2))
    np.testing.assert_allclose(turning(spin, dt, steps), energy, rtol=1e-9)


def test_small_swing_is_harmonic() -> None:
    times = np.linspace(0.0, 2.0, 50)
    np.testing.assert_allclose(exact_swing(1e-4, 9.0, times), 1e-4 * np.cos(3.0 * times), atol=1e-10)


def test_folded_strip_is_as_long_as_it_was() -> None:
    s = np.linspace(0.0, 0.3, 2001)
    x, y = folded(s, 0.3, 0.02)
    np.testing.assert_allclose(np.hypot(np.diff(x), np.diff(y)), s[1] - s[0], rtol=1e-4)
    assert y[0] == 0.0
    assert y[-1] == pytest.approx(0.02)
    assert x[-1] == pytest.approx(x[0], abs=1e-12)
