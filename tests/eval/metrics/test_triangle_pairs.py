"""Intersecting triangles against rational arithmetic, ipctk and known configurations."""

from fractions import Fraction
from itertools import combinations, product

import numpy as np
import pytest
import trimesh

from muslin.eval.metrics.box_pairs import box_tree, overlapping, overlapping_within
from muslin.eval.metrics.rational_triangles import APART, COPLANAR, CROSSING, triangles_meet
from muslin.eval.metrics.triangle_pairs import intersecting_triangles, self_intersecting_triangles
from muslin.garments.errors import InputError
from muslin.sim.dataset.intersections import count_intersections
from tests.eval.metrics.shapes import lifted, sheet, sphere, turned

FLAT = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]


def cross(u, v):
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


def parted(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two triangles of some area have no common point, by separating axes in fractions."""
    first, second = ([[Fraction(x) for x in p] for p in t.tolist()] for t in (a, b))
    edges = [
        [[y - x for x, y in zip(t[k - 1], t[k], strict=True)] for k in range(3)] for t in (first, second)
    ]
    normals = [cross(e[0], e[1]) for e in edges]
    axes = [*normals, *(cross(u, v) for u, v in product(*edges))]
    axes += [cross(n, e) for n, side in zip(normals, edges, strict=True) for e in side]
    for axis in axes:
        p, q = ([sum(x * y for x, y in zip(axis, c, strict=True)) for c in t] for t in (first, second))
        if max(p) < min(q) or max(q) < min(p):
            return True
    return False


def by_hand(v, f, w, g) -> list[tuple[int, int]]:
    """Every pair decided in rational arithmetic."""
    return [
        (i, j)
        for i in range(len(f))
        for j in range(len(g))
        if triangles_meet(v[f[i]].tolist(), w[g[j]].tolist()) != APART
    ]


def found(pairs) -> list[tuple[int, int]]:
    return sorted(map(tuple, pairs.faces.tolist()))


def soup(rng: np.random.Generator, count: int, size: float) -> tuple[np.ndarray, np.ndarray]:
    v = rng.random((count, 1, 3)) + size * rng.normal(size=(count, 3, 3))
    return v.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


@pytest.mark.parametrize("seed", range(3))
def test_soups_against_rational_arithmetic(seed):
    rng = np.random.default_rng(seed)
    (v, f), (w, g) = soup(rng, 25, 0.2), soup(rng, 30, 0.4)
    expected = by_hand(v, f, w, g)
    assert 5 < len(expected) < len(f) * len(g) - 5
    assert expected == [(i, j) for i, j in np.ndindex(25, 30) if not parted(v[f[i]], w[g[j]])]
    assert found(intersecting_triangles(v, f, w, g)) == expected


@pytest.mark.parametrize("spread", [2, 4])
def test_whole_number_test_against_separating_axes_in_fractions(spread):
    rng = np.random.default_rng(spread)
    outcomes = []
    for a, b in rng.integers(0, spread, (250, 2, 3, 3)).astype(float):
        if np.cross(a[1] - a[0], a[2] - a[0]).any() and np.cross(b[1] - b[0], b[2] - b[0]).any():
            outcomes.append(triangles_meet(a.tolist(), b.tolist()))
            assert (outcomes[-1] == APART) == parted(a, b)
    assert {APART, CROSSING, COPLANAR} == set(outcomes)


@pytest.mark.parametrize("seed", range(4))
def test_touching_and_coplanar_triangles_against_rational_arithmetic(seed):
    # Small whole coordinates: most pairs touch in a corner, share a plane or an edge, or have no area.
    rng = np.random.default_rng(seed)
    v, w = rng.integers(0, 3, (60, 3)).astype(float), rng.integers(0, 3, (60, 3)).astype(float)
    f = np.arange(60).reshape(-1, 3)
    assert found(intersecting_triangles(v, f, w, f)) == by_hand(v, f, w, f)


def test_a_turned_flat_sheet_does_not_meet_itself_and_a_copy_is_coplanar():
    uv, f = sheet(1.0, 1.0, 4, 4)
    v = turned(lifted(uv))
    assert len(self_intersecting_triangles(v, f)) == 0
    v, w = lifted(uv), lifted(uv + np.array([1 / 16, 1 / 32]))
    pairs = intersecting_triangles(v, f, w, f)
    assert pairs.coplanar.all()
    assert found(pairs) == by_hand(v, f, w, f)


@pytest.mark.parametrize(
    ("corners", "outcome"),
    [
        ([[1, 1, -1], [1, 1, 1], [3, 1, 0]], CROSSING),
        ([[1, 1, 0], [1, 1, 1], [3, 1, 2]], CROSSING),  # touches with a corner
        ([[2, 2, -1], [2, 2, 1], [9, 9, 0]], CROSSING),  # touches on the longest side
        ([[2, 2 + 1e-15, -1], [2, 2 + 1e-15, 1], [9, 9, 0]], APART),
        ([[1, 1, 1e-300], [1, 2, 1], [2, 1, 1]], APART),
        ([[1, 1, 0], [2, 1, 0], [1, 2, 0]], COPLANAR),  # within
        ([[-9, -9, 0], [99, -9, 0], [-9, 99, 0]], COPLANAR),  # around
        ([[4, 0, 0], [5, 0, 0], [4, 1, 0]], COPLANAR),  # a common corner
        ([[5, 0, 0], [6, 0, 0], [5, 1, 0]], APART),
        ([[1, 1, -1], [1, 1, 0.5], [1, 1, 1]], CROSSING),  # no area
        ([[5, 5, -1], [5, 5, 0.5], [5, 5, 1]], APART),
    ],
)
def test_known_pairs(corners, outcome):
    for k in range(3):
        turned_round = np.roll(np.array(corners, dtype=float), k, axis=0)
        assert triangles_meet(FLAT, turned_round.tolist()) == outcome
        pairs = intersecting_triangles(
            np.array(FLAT), np.array([[0, 1, 2]]), turned_round, np.array([[2, 1, 0]])
        )
        assert len(pairs) == (outcome != APART)
        assert pairs.coplanar.tolist() == [outcome == COPLANAR] * (outcome != APART)


def test_own_pairs_leave_out_neighbours_by_index_and_by_position():
    rng = np.random.default_rng(5)
    uv, f = sheet(1.0, 1.0, 5, 5)
    v = lifted(uv) + rng.normal(scale=0.12, size=(len(uv), 3))
    expected = [
        (i, j)
        for i, j in combinations(range(len(f)), 2)
        if not set(f[i]) & set(f[j]) and triangles_meet(v[f[i]].tolist(), v[f[j]].tolist())
    ]
    assert len(expected) > 3
    assert found(self_intersecting_triangles(v, f)) == expected
    torn = v[f].reshape(-1, 3)
    assert found(self_intersecting_triangles(torn, np.arange(len(torn)).reshape(-1, 3))) == expected


def test_zero_exactly_where_ipctk_counts_none():
    ball, ball_faces = sphere(3, 1.0)
    uv, f = sheet(3.0, 3.0, 12, 12)
    for height in (0.3, 0.9, 1.1):
        v = turned(lifted(uv - 1.5, height))
        body = turned(ball)
        pairs = intersecting_triangles(v, f, body, ball_faces)
        count = count_intersections(v, f, body, ball_faces).cloth_body
        assert (len(pairs) > 0) == (count > 0) == (height < 1.0)


def test_boxes_against_all_pairs():
    rng = np.random.default_rng(7)
    a, b = rng.random((333, 3)), rng.random((77, 3))
    size_a, size_b = rng.random((333, 1)) ** 6, rng.random((77, 1)) ** 6
    first, second = box_tree(a, a + size_a), box_tree(b, b + size_b)

    def meet(low, high, low2, high2):
        return ((low[:, None] <= high2[None]) & (low2[None] <= high[:, None])).all(axis=2)

    expected = np.argwhere(meet(a, a + size_a, b, b + size_b))
    assert sorted(map(tuple, overlapping(first, second).tolist())) == sorted(map(tuple, expected.tolist()))
    within = np.argwhere(np.triu(meet(a, a + size_a, a, a + size_a), 1))
    assert sorted(map(tuple, overlapping_within(first).tolist())) == sorted(map(tuple, within.tolist()))


def test_no_triangles_no_pairs():
    v, f = np.array(trimesh.creation.box().vertices), np.array(trimesh.creation.box().faces)
    none = np.zeros((0, 3), dtype=int)
    assert len(intersecting_triangles(v, f, v, none)) == 0
    assert len(intersecting_triangles(v, none, v, f)) == 0
    assert len(intersecting_triangles(v, f, v + 100.0, f)) == 0
    assert len(self_intersecting_triangles(v, none)) == 0
    assert len(self_intersecting_triangles(v, f[:1])) == 0


def test_noise_is_refused_before_it_takes_hours():
    corners = np.random.default_rng(2).random((12_000, 3))
    faces = np.arange(12_000).reshape(-1, 3)
    with pytest.raises(InputError, match="such a surface is no garment"):
        self_intersecting_triangles(corners, faces)
    with pytest.raises(InputError, match="such a surface is no garment"):
        intersecting_triangles(corners, faces, corners[::-1], faces)
