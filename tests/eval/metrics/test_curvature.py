"""Mean curvature of spheres, cylinders and waves, and the distance of its distributions."""

import numpy as np
import pytest
from scipy.integrate import quad

from muslin.eval.metrics.curvature import Curvatures, curvature_distance, mean_curvature
from muslin.garments.errors import InputError
from tests.eval.metrics.shapes import lifted, rolled, sheet, sphere, turned


def test_sphere_has_curvature_one_over_radius():
    found = mean_curvature(*sphere(4, 0.25))
    assert np.average(found.values, weights=found.areas) == pytest.approx(4.0, rel=2e-3)
    assert found.values == pytest.approx(np.full(len(found.values), 4.0), rel=0.02)
    x, faces = sphere(4, 0.25)
    assert mean_curvature(x, faces[:, ::-1]).values == pytest.approx(-found.values)
    assert found.areas.sum() == pytest.approx(4.0 * np.pi * 0.25**2, rel=5e-3)


def test_cylinder_is_exact_on_a_grid_and_its_mean_converges_on_irregular_triangles():
    uv, faces = sheet(0.4, 0.4, 20, 20, "structured")
    found = mean_curvature(rolled(uv, 0.2), faces)
    assert len(found.values) == 19**2  # none on the boundary
    assert found.values == pytest.approx(np.full(19**2, 2.5), rel=1e-10)
    inside = rolled(uv, 0.2) * [1.0, 1.0, -1.0]
    assert mean_curvature(inside, faces).values == pytest.approx(-found.values)
    for n, share in ((10, 0.004), (40, 0.0005)):
        uv, faces = sheet(0.4, 0.4, n, n, "irregular")
        rough = mean_curvature(rolled(uv, 0.2), faces)
        assert np.average(rough.values, weights=rough.areas) == pytest.approx(2.5, rel=share)


def test_wave_converges_by_second_order_on_a_grid():
    a, k = 0.004, 2.0 * np.pi / 0.1
    errors = []
    for n in (20, 40, 80):
        uv, faces = sheet(0.1, 0.05, n, n // 2, "structured")
        inner = (uv[:, 0] > 1e-9) & (uv[:, 0] < 0.1 - 1e-9) & (uv[:, 1] > 1e-9) & (uv[:, 1] < 0.05 - 1e-9)
        phase = k * uv[inner, 0]
        exact = 0.5 * a * k**2 * np.sin(phase) / (1.0 + (a * k * np.cos(phase)) ** 2) ** 1.5
        errors.append(
            np.abs(mean_curvature(lifted(uv, a * np.sin(k * uv[:, 0])), faces).values - exact).max()
        )
    assert np.array(errors[:-1]) / errors[1:] == pytest.approx([4.0, 4.0], rel=0.15)


def test_rms_of_a_wave_is_its_integral():
    a, k = 0.004, 2.0 * np.pi / 0.1

    def bent(x: float) -> float:
        return (0.5 * a * k**2 * np.sin(k * x) / (1.0 + (a * k * np.cos(k * x)) ** 2) ** 1.5) ** 2

    def length(x: float) -> float:
        return np.sqrt(1.0 + (a * k * np.cos(k * x)) ** 2)

    uv, faces = sheet(0.4, 0.1, 160, 40)
    found = mean_curvature(lifted(uv, a * np.sin(k * uv[:, 0])), faces)
    expected = quad(lambda x: bent(x) * length(x), 0.0, 0.1)[0] / quad(length, 0.0, 0.1)[0]
    assert found.rms == pytest.approx(np.sqrt(expected), rel=0.02)


def test_distance_is_the_difference_of_curvature_of_two_cylinders_on_any_mesh():
    # Different triangulations, no correspondence: 1 / (2 r) - 1 / (2 R).
    a, b = sheet(0.3, 0.3, 40, 40), sheet(0.3, 0.3, 50, 30)
    near, far = mean_curvature(rolled(a[0], 0.1), a[1]), mean_curvature(rolled(b[0], 0.2), b[1])
    assert curvature_distance(near, far) == pytest.approx(2.5, rel=0.01)
    assert curvature_distance(near, near) == 0.0
    assert curvature_distance(near, far) == curvature_distance(far, near)


def test_distance_against_the_slow_reference():
    rng = np.random.default_rng(0)
    a = Curvatures(rng.normal(size=30), rng.random(30))
    b = Curvatures(rng.normal(size=20) + 0.5, rng.random(20))
    grid = np.linspace(-5, 6, 400_001)
    shares = [
        sum(area * (grid >= h) for h, area in zip(s.values, s.areas, strict=True)) / s.areas.sum()
        for s in (a, b)
    ]
    slow = np.abs(shares[0] - shares[1]).mean() * 11.0
    assert curvature_distance(a, b) == pytest.approx(slow, rel=1e-3)


def test_distance_knows_ridges_from_valleys_but_no_rigid_motion():
    uv, faces = sheet(0.3, 0.3, 30, 30)
    ridge = mean_curvature(rolled(uv, 0.2), faces)
    valley = mean_curvature(rolled(uv, 0.2) * [1.0, 1.0, -1.0], faces)
    assert curvature_distance(ridge, valley) == pytest.approx(5.0, rel=0.01)
    assert curvature_distance(ridge, mean_curvature(turned(rolled(uv, 0.2)), faces)) < 1e-9


UV, FACES = sheet(0.2, 0.2, 3, 3)


@pytest.mark.parametrize(
    "call",
    [
        lambda: mean_curvature(lifted(UV)[:3], np.array([[0, 1, 2]])),
        lambda: mean_curvature(np.full((len(UV), 3), np.nan), FACES),
        lambda: mean_curvature(lifted(UV), FACES[:0]),
        lambda: mean_curvature(lifted(UV * [1.0, 0.0]), FACES),
    ],
)
def test_bad_input_is_named(call):
    with pytest.raises(InputError):
        call()
