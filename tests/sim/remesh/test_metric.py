"""Tensors: lengths, bounds, maxima and averages against closed forms and slow searches."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import minimize

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh, signed_areas
from muslin.sim.remesh.metric import (
    area_density,
    clamp,
    edge_lengths,
    eigenvalues,
    faces_to_vertices,
    positive_part,
    quadratic_form,
    square_root,
    tensor_maximum,
    uniform,
    with_eigenvalues,
)
from tests.sim.meshes import sheet

Array = NDArray[np.float64]


def rotation(angle: float) -> Array:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def tensor(large: float, small: float, angle: float) -> Array:
    """The tensor (1, 2, 2) with the axis of `large` at `angle`."""
    r = rotation(angle)
    return (r @ np.diag([large, small]) @ r.T)[None]


def random_tensors(count: int, seed: int) -> Array:
    """Positive definite, eigenvalues over six orders of magnitude."""
    rng = np.random.default_rng(seed)
    values, angles = 10.0 ** rng.uniform(-1.0, 5.0, (count, 2)), rng.uniform(0.0, np.pi, count)
    return np.concatenate([tensor(a, b, t) for (a, b), t in zip(values, angles, strict=True)])


def assert_dominates(bound: Array, metric: Array) -> None:
    """bound - metric is positive semi-definite, up to round-off of the bound."""
    lowest = np.linalg.eigvalsh(bound - metric)[:, 0]
    assert (lowest >= -1e-12 * np.linalg.norm(bound, axis=(1, 2))).all()


# Zero, or far from the smallest numbers, whose squares are zero.
sizes = st.one_of(st.just(0.0), st.floats(1e-3, 1e6))
any_tensor = st.builds(tensor, sizes, sizes, st.floats(0.0, np.pi))


def test_eigenvalues_are_those_of_lapack_in_descending_order() -> None:
    m = random_tensors(200, 0) - random_tensors(200, 1)
    expected = np.linalg.eigvalsh(m)[:, ::-1]
    np.testing.assert_allclose(eigenvalues(m), expected, atol=1e-14 * np.abs(m).max())


def test_a_round_tensor_takes_new_eigenvalues_along_its_axes() -> None:
    given_back = with_eigenvalues(3.0 * np.eye(2)[None], np.array([5.0]), np.array([2.0]))
    np.testing.assert_array_equal(given_back, np.diag([5.0, 2.0])[None])


def test_the_square_of_a_root_is_the_tensor() -> None:
    m = random_tensors(200, 2)
    scale = np.linalg.norm(m, axis=(1, 2))[:, None, None]
    np.testing.assert_allclose(square_root(m) @ square_root(m) / scale, m / scale, atol=1e-14)


def test_a_tensor_is_its_positive_part_less_that_of_its_negative() -> None:
    m = random_tensors(200, 3) - random_tensors(200, 4)
    plus, minus = positive_part(m), positive_part(-m)
    np.testing.assert_allclose(plus - minus, m, atol=1e-12 * np.abs(m).max())
    np.testing.assert_allclose(plus @ minus, np.zeros_like(m), atol=1e-12 * np.abs(m).max() ** 2)


def test_edge_length_is_that_of_the_mean_of_both_ends() -> None:
    rng = np.random.default_rng(5)
    points, metric = rng.normal(size=(20, 2)), random_tensors(20, 5)
    edges = rng.integers(0, 20, (50, 2))
    expected = [
        np.sqrt((points[j] - points[i]) @ (metric[i] + metric[j]) @ (points[j] - points[i]) / 2.0)
        for i, j in edges
    ]
    np.testing.assert_allclose(edge_lengths(points, edges, metric), expected, rtol=1e-13)


@given(any_tensor, any_tensor)
def test_the_maximum_dominates_both_and_knows_no_order(a: Array, b: Array) -> None:
    bound = tensor_maximum(a, b)
    assert np.isfinite(bound).all()
    assert_dominates(bound, a)
    assert_dominates(bound, b)
    scale = np.abs(a).max() + np.abs(b).max()
    np.testing.assert_allclose(tensor_maximum(b, a), bound, rtol=0.0, atol=1e-12 * scale)


@given(sizes, sizes, sizes, sizes, st.floats(0.0, np.pi))
def test_tensors_with_shared_axes_take_the_larger_eigenvalue_on_each(
    a1: float, a2: float, b1: float, b2: float, angle: float
) -> None:
    found = tensor_maximum(tensor(a1, a2, angle), tensor(b1, b2, angle))
    expected = tensor(max(a1, b1), max(a2, b2), angle)
    # Where a + b is all but of rank one, its axes decide only to the square root of round-off.
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-7 * max(a1, a2, b1, b2))


@given(any_tensor, any_tensor)
def test_the_maximum_with_a_tensor_that_dominates_is_that_tensor(a: Array, more: Array) -> None:
    np.testing.assert_allclose(tensor_maximum(a, a + more), a + more, rtol=0.0, atol=1e-7 * (a + more).max())


def test_no_bound_of_both_has_a_smaller_determinant() -> None:
    """A search over all bounds, started at the sum of both, finds the same one."""
    rng = np.random.default_rng(6)
    for _ in range(10):
        a, b = (tensor(*rng.uniform(1.0, 30.0, 2), rng.uniform(0.0, np.pi)) for _ in range(2))
        found = tensor_maximum(a, b)[0]

        def bound(p: Array) -> Array:
            return np.array([[p[0], p[1]], [p[1], p[2]]])

        def lowest(p: Array, least: Array) -> float:
            return float(np.linalg.eigvalsh(bound(p) - least)[0])

        start = (a + b)[0][[0, 0, 1], [0, 1, 1]]
        best = minimize(
            lambda p: np.linalg.slogdet(bound(p))[1],
            start,
            constraints=[{"type": "ineq", "fun": lowest, "args": (least,)} for least in (a[0], b[0])],
            method="SLSQP",
            options={"maxiter": 500, "ftol": 1e-12},
        )
        assert np.linalg.det(found) == pytest.approx(np.linalg.det(bound(best.x)), rel=1e-4)
        np.testing.assert_allclose(found, bound(best.x), atol=0.02 * np.abs(found).max())


def test_the_maximum_goes_along_with_any_linear_map_of_panel_space() -> None:
    a, b = random_tensors(100, 7), random_tensors(100, 8)
    g = np.array([[1.3, 0.4], [-0.2, 0.7]])
    expected = g.T @ tensor_maximum(a, b) @ g
    scale = np.linalg.norm(expected, axis=(1, 2))[:, None, None]
    np.testing.assert_allclose(tensor_maximum(g.T @ a @ g, g.T @ b @ g) / scale, expected / scale, atol=1e-9)


@pytest.mark.parametrize("angle", [0.1, 0.5, np.pi / 2])
def test_crossing_creases_ask_for_fewer_triangles_than_the_bound_of_smallest_trace(angle: float) -> None:
    a, b, s = tensor(7.0, 0.0, 0.0), tensor(7.0, 0.0, angle), np.sin(angle)
    np.testing.assert_allclose(tensor_maximum(a, b), a + b, atol=1e-13)
    by_trace = a + positive_part(b - a)
    ratio = area_density(by_trace) / area_density(tensor_maximum(a, b))
    assert ratio[0] == pytest.approx(np.sqrt((1.0 + s) / (2.0 * s)), rel=1e-9)


def test_clamp_bounds_sizes_then_aspect() -> None:
    lengths = np.array([(0.001, 0.05), (0.03, 5.0), (0.02, 0.09), (0.02, 0.15), (9.0, 12.0)])
    expected = np.array([(0.01, 0.05), (0.03, 0.15), (0.02, 0.09), (0.02, 0.1), (0.2, 0.2)])
    for (short, long), (short_after, long_after) in zip(lengths, expected, strict=True):
        for angle in (0.0, 0.4, 2.0):
            found = clamp(tensor(short**-2, long**-2, angle), 0.01, 0.2, 0.2)
            expected_tensor = tensor(short_after**-2, long_after**-2, angle)
            np.testing.assert_allclose(found, expected_tensor, rtol=1e-9, atol=1e-9)


def test_aspect_one_is_isotropic() -> None:
    m = random_tensors(50, 9)
    found = clamp(m, 1e-4, 1e2, 1.0)
    np.testing.assert_allclose(found, eigenvalues(m)[:, :1, None] * np.eye(2), rtol=1e-9, atol=1e-9)


def test_edges_of_size_one_make_triangles_of_the_uniform_metric_s_area() -> None:
    side = np.sqrt(4.0 * 3e-4 / np.sqrt(3.0))
    points = side * np.array([(0.0, 0.0), (1.0, 0.0), (0.5, np.sqrt(0.75))])
    metric = np.tile(uniform(3e-4), (3, 1, 1))
    lengths = edge_lengths(points, np.array([(0, 1), (1, 2), (2, 0)]), metric)
    np.testing.assert_allclose(lengths, 1.0, rtol=1e-12)
    assert signed_areas(points, np.array([(0, 1, 2)]))[0] == pytest.approx(3e-4)
    np.testing.assert_allclose(3e-4 * area_density(metric) * 4.0 / np.sqrt(3.0), 1.0, rtol=1e-12)
    np.testing.assert_array_equal(uniform([3e-4, 1e-4])[0], uniform(3e-4))
    assert uniform([3e-4, 1e-4]).shape == (2, 2, 2)


@pytest.mark.parametrize("area", [0.0, -1.0, np.nan, np.inf])
def test_no_metric_has_triangles_without_area(area: float) -> None:
    with pytest.raises(InputError, match="must be positive"):
        uniform([1e-4, area])


def test_area_density_is_the_area_of_the_ellipse() -> None:
    """pi / sqrt(det M) is the area of u^T M u <= 1, here counted on a grid."""
    m = tensor(9.0, 2.0, 0.7)
    step = 2.0 / 1500
    x, y = np.meshgrid(*[np.arange(-1.0, 1.0, step) + 0.5 * step] * 2)
    inside = quadratic_form(m, np.stack([x.ravel(), y.ravel()], axis=1)) <= 1.0
    assert inside.sum() * step**2 == pytest.approx(np.pi / area_density(m)[0], rel=5e-4)


def test_vertices_have_the_average_of_their_faces_by_area(sheet_mesh: GarmentMesh) -> None:
    m = random_tensors(len(sheet_mesh.faces), 10)
    found = faces_to_vertices(sheet_mesh, m)
    for vertex in range(0, len(found), 5):
        around = (sheet_mesh.panel_faces == vertex).any(axis=1)
        expected = np.average(m[around], axis=0, weights=sheet_mesh.face_areas[around])
        np.testing.assert_allclose(found[vertex], expected, rtol=1e-12)


def test_averages_keep_the_bounds_of_their_faces() -> None:
    mesh = sheet("irregular", 0.4, 0.3, 0.03)
    found = faces_to_vertices(mesh, clamp(random_tensors(len(mesh.faces), 11), 0.01, 0.2, 0.2))
    large, small = eigenvalues(found).T
    assert large.max() <= 0.01**-2 * (1.0 + 1e-12)
    assert small.min() >= 0.2**-2 * (1.0 - 1e-12)
    assert (small / large).min() >= 0.2**2 * (1.0 - 1e-12)
