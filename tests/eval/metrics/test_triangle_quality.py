"""Angles and distortion of triangles: closed forms, Verdict's own, and a slow reference."""

import numpy as np
import pytest
import pyvista as pv
from hypothesis import given
from hypothesis import strategies as st

from muslin.eval.metrics.triangle_quality import (
    angles,
    coefficient_of_variation,
    degenerate_and_inverted,
    distortion,
    signed_quality,
)

ONE = np.array([[0, 1, 2]], dtype=np.int32)
EQUILATERAL = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.5 * np.sqrt(3.0)]])
RIGHT = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])


def soup(seed: int, count: int = 200, dimensions: int = 3) -> tuple[np.ndarray, np.ndarray]:
    points = np.random.default_rng(seed).normal(size=(3 * count, dimensions))
    return points, np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


def test_equilateral_triangle():
    assert angles(EQUILATERAL, ONE) == pytest.approx(np.full((1, 3), np.pi / 3))
    assert distortion(EQUILATERAL, ONE) == pytest.approx(1.0)
    assert signed_quality(EQUILATERAL, ONE) == pytest.approx(1.0)


def test_right_isosceles_triangle():
    assert angles(RIGHT, ONE)[0] == pytest.approx([np.pi / 2, np.pi / 4, np.pi / 4])
    # longest edge sqrt(2), altitude on it 1 / sqrt(2)
    assert distortion(RIGHT, ONE) == pytest.approx(np.sqrt(3.0))
    assert signed_quality(RIGHT, ONE[:, ::-1]) == pytest.approx(-1.0 / np.sqrt(3.0))


def test_the_smallest_angles_keep_their_digits():
    needle = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1e-10]])
    assert angles(needle, ONE)[0, 0] == pytest.approx(1e-10, rel=1e-12)


def test_triangles_without_area():
    line = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    point = np.zeros((3, 2))
    for flat in (line, point):
        assert distortion(flat, ONE) == np.inf
        assert signed_quality(flat, ONE) == 0.0
        assert degenerate_and_inverted(flat, ONE) == (1, 0)
    assert angles(line, ONE)[0] == pytest.approx([0.0, np.pi, 0.0])
    assert (angles(point, ONE) == 0.0).all()


def test_degenerate_and_inverted_are_counted_apart():
    points = np.concatenate([RIGHT, RIGHT * [1.0, 1e-7]])
    faces = np.array([[0, 1, 2], [0, 2, 1], [2, 1, 0], [3, 4, 5], [3, 5, 4]], dtype=np.int32)
    assert degenerate_and_inverted(points, faces) == (2, 2)
    assert degenerate_and_inverted(1e-4 * points, faces) == (2, 2)


def test_against_verdict():
    points, faces = soup(1)
    mesh = pv.PolyData.from_regular_faces(points, faces)
    found = mesh.cell_quality(["min_angle", "max_angle", "area"])
    corner = np.degrees(angles(points, faces))
    assert corner.min(axis=1) == pytest.approx(found["min_angle"])
    assert corner.max(axis=1) == pytest.approx(found["max_angle"])
    assert coefficient_of_variation(found["area"]) == pytest.approx(
        found["area"].std() / found["area"].mean()
    )


@pytest.mark.parametrize("dimensions", [2, 3])
def test_distortion_against_altitudes_one_by_one(dimensions: int):
    points, faces = soup(2, 50, dimensions)
    expected = []
    for a, b, c in points[faces]:
        sides, altitudes = [], []
        for p, q, r in ((a, b, c), (b, c, a), (c, a, b)):
            along = (q - p) / np.linalg.norm(q - p)
            sides.append(np.linalg.norm(q - p))
            altitudes.append(np.linalg.norm((r - p) - ((r - p) @ along) * along))
        expected.append(np.sqrt(3.0) / 2.0 * max(sides) / min(altitudes))
    assert distortion(points, faces) == pytest.approx(expected)
    if dimensions == 2:
        assert np.abs(signed_quality(points, faces)) == pytest.approx(1.0 / np.array(expected))


@given(st.integers(0, 1000), st.floats(0.0, 6.3), st.floats(1e-3, 1e3))
def test_shape_does_not_see_similarities(seed: int, turn: float, scale: float):
    points, faces = soup(seed, 5, 2)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    moved = scale * points @ rotation.T + [3.0, -1.0]
    assert angles(moved, faces) == pytest.approx(angles(points, faces), abs=1e-7)
    assert angles(points, faces).sum(axis=1) == pytest.approx(np.pi)
    assert signed_quality(moved, faces) == pytest.approx(signed_quality(points, faces), abs=1e-7)
    assert signed_quality(points * [-1.0, 1.0], faces) == pytest.approx(-signed_quality(points, faces))


def test_spread_of_known_values():
    assert coefficient_of_variation(np.array([1.0, 3.0])) == 0.5
    assert coefficient_of_variation(np.full(4, 7.0)) == 0.0
