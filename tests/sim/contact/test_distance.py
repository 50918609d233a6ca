"""Closest points of pairs against IPC Toolkit, a quadratic programme by brute force, and geometry by hand."""

import ipctk
import numpy as np
import pytest


def ipctk_distance(points, is_edge_edge: bool) -> np.ndarray:
    squared = ipctk.edge_edge_distance if is_edge_edge else ipctk.point_triangle_distance
    return np.sqrt([squared(*pair) for pair in points])


def random_quadruples(is_edge_edge: bool, count: int = 3000) -> np.ndarray:
    """Generic ones, slivers and near-parallel ones, of sizes from 1 mm to 1 m."""
    draw = np.random.default_rng(3 + is_edge_edge)
    points = draw.normal(size=(count, 4, 3))
    third = count // 3
    points[:third, 3] = points[:third, 2] + 1e-4 * draw.normal(size=(third, 3))
    along = points[third : 2 * third, 1] - points[third : 2 * third, 0]
    along *= 1 + 1e-5 * draw.normal(size=(third, 3))
    points[third : 2 * third, 3] = points[third : 2 * third, 2] + along
    return points * 10.0 ** draw.uniform(-3, 0, size=(count, 1, 1))


@pytest.mark.parametrize("is_edge_edge", [False, True])
def test_distance_is_ipctks(closest, is_edge_edge):
    points = random_quadruples(is_edge_edge)
    distance = closest(points, is_edge_edge)[1]
    size = np.linalg.norm(points - points.mean(axis=1, keepdims=True), axis=2).max(axis=1)
    assert (np.abs(distance - ipctk_distance(points, is_edge_edge)) <= 1e-8 * size).all()


@pytest.mark.parametrize("is_edge_edge", [False, True])
def test_no_point_of_a_grid_is_closer(closest, is_edge_edge):
    points = random_quadruples(is_edge_edge, 150)
    distance = closest(points, is_edge_edge)[1]
    n = 40
    s, t = (grid.ravel() / n for grid in np.meshgrid(np.arange(n + 1), np.arange(n + 1)))
    if is_edge_edge:
        w = np.stack([1 - s, s, t - 1, -t])
    else:
        s, t = s[s + t <= 1 + 1e-12], t[s + t <= 1 + 1e-12]
        w = np.stack([np.ones_like(s), s + t - 1, -s, -t])
    grid = np.linalg.norm(np.einsum("ws,kwx->ksx", w, points), axis=2).min(axis=1)
    longest = np.linalg.norm(points[:, :, None] - points[:, None], axis=3).max(axis=(1, 2))
    assert (distance <= grid * (1 + 1e-12)).all()
    assert (grid <= distance + 1.5 * longest / n).all()


@pytest.mark.parametrize("is_edge_edge", [False, True])
def test_weights_are_points_of_the_two_sides(closest, is_edge_edge):
    w = closest(random_quadruples(is_edge_edge), is_edge_edge)[0]
    ahead = 2 if is_edge_edge else 1
    assert (w[:, :ahead] >= 0).all()
    assert (w[:, ahead:] <= 1e-15).all()
    np.testing.assert_allclose(w[:, :ahead].sum(axis=1), 1, atol=1e-12)
    np.testing.assert_allclose(w[:, ahead:].sum(axis=1), -1, atol=1e-12)


@pytest.mark.parametrize("is_edge_edge", [False, True])
def test_weights_times_normal_are_the_gradient_of_the_distance(closest, is_edge_edge):
    points = np.random.default_rng(8).normal(size=(60, 4, 3))
    w, d = closest(points, is_edge_edge)
    normal = np.einsum("kw,kwx->kx", w, points) / d[:, None]
    h = 1e-6
    for vertex in range(4):
        for axis in range(3):
            ahead, behind = points.copy(), points.copy()
            ahead[:, vertex, axis] += h
            behind[:, vertex, axis] -= h
            slope = (closest(ahead, is_edge_edge)[1] - closest(behind, is_edge_edge)[1]) / (2 * h)
            np.testing.assert_allclose(slope, w[:, vertex] * normal[:, axis], atol=1e-7)


TRIANGLE = ((0, 0, 0), (1, 0, 0), (0, 1, 0))


@pytest.mark.parametrize(
    ("point", "distance", "weights"),
    [
        ((0.25, 0.25, 0.5), 0.5, (1, -0.5, -0.25, -0.25)),
        ((-3, 0, 4), 5, (1, -1, 0, 0)),
        ((4, 0, 4), 5, (1, 0, -1, 0)),
        ((0, 5, 3), 5, (1, 0, 0, -1)),
        ((0.5, -2, 0), 2, (1, -0.5, -0.5, 0)),
        ((-2, 0.25, 0), 2, (1, -0.75, 0, -0.25)),
        ((1, 1, 0), np.sqrt(0.5), (1, 0, -0.5, -0.5)),
        ((0.2, 0.3, 0), 0, (1, -0.5, -0.2, -0.3)),
    ],
)
def test_each_region_of_a_triangle(closest, point, distance, weights):
    w, d = closest([point, *TRIANGLE], False)
    np.testing.assert_allclose(w[0], weights, atol=1e-15)
    np.testing.assert_allclose(d[0], distance, atol=1e-15)


@pytest.mark.parametrize(
    ("edges", "distance"),
    [
        (((-1, 0, 0), (1, 0, 0), (0, -1, 2), (0, 1, 2)), 2),
        (((0, 0, 0), (1, 0, 0), (0, 3, 0), (1, 3, 0)), 3),
        (((0, 0, 0), (1, 0, 0), (1, 3, 0), (0, 3, 0)), 3),
        (((0, 0, 0), (1, 0, 0), (0.5, 3, 0), (9, 3, 0)), 3),
        (((0, 0, 0), (1, 0, 0), (4, 4, 0), (9, 4, 0)), 5),
        (((0, 0, 0), (1, 0, 0), (2, 0, 0), (5, 0, 0)), 1),
        (((0, 0, 0), (2, 0, 0), (1, 0, 0), (5, 0, 0)), 0),
        (((0, 0, 0), (0, 0, 0), (-1, 2, 0), (1, 2, 0)), 2),
        (((-1, 2, 0), (1, 2, 0), (0, 0, 0), (0, 0, 0)), 2),
        (((0, 0, 0), (0, 0, 0), (3, 4, 0), (3, 4, 0)), 5),
    ],
    ids=[
        "crossed",
        "parallel",
        "antiparallel",
        "overlapping",
        "apart",
        "collinear",
        "touching",
        "point-edge",
        "edge-point",
        "point-point",
    ],
)
def test_parallel_and_degenerate_edges(closest, edges, distance):
    np.testing.assert_allclose(closest([edges], True)[1], distance, atol=1e-12)


@pytest.mark.parametrize(
    ("points", "distance"),
    [
        (((0, 3, 0), (-1, 0, 0), (1, 0, 0), (0, 0, 0)), 3),
        (((0, 3, 0), (-1, 0, 0), (0.5, 0, 0), (1, 0, 0)), 3),
        (((4, 4, 0), (-1, 0, 0), (0.5, 0, 0), (1, 0, 0)), 5),
        (((0, 3, 0), (-1, 0, 0), (1, 0, 0), (1, 0, 0)), 3),
        (((3, 4, 0), (0, 0, 0), (0, 0, 0), (0, 0, 0)), 5),
    ],
)
def test_triangles_without_area(closest, points, distance):
    np.testing.assert_allclose(closest([points], False)[1], distance, atol=1e-12)
