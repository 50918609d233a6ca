"""Length of the contour of two surfaces: circles, straight lines, and what must not change it."""

import numpy as np
import pytest
import trimesh

from muslin.eval.metrics.contours import contour_length
from muslin.eval.metrics.triangle_pairs import intersecting_triangles, self_intersecting_triangles
from tests.eval.metrics.shapes import lifted, sheet, sphere, turned


def length(v, f, w, g) -> float:
    return contour_length(intersecting_triangles(v, f, w, g), v, f, w, g)


def refined(v, f, times=1):
    for _ in range(times):
        v, f = trimesh.remesh.subdivide(v, f)
    return np.array(v), np.array(f)


def test_plane_through_a_sphere_is_a_circle():
    uv, f = sheet(3.0, 3.0, 9, 9)
    v = lifted(uv - 1.5, 0.3)
    circle = 2 * np.pi * np.sqrt(1 - 0.3**2)
    errors = [circle - length(v, f, *sphere(level, 1.0)) for level in (2, 3, 4)]
    assert errors[2] == pytest.approx(0, abs=1e-3 * circle)
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.25)
    assert errors[1] / errors[2] == pytest.approx(4, rel=0.25)


def test_two_crossing_sheets():
    uv, f = sheet(1.0, 1.0, 7, 5)
    up = np.column_stack([uv[:, 0], np.full(len(uv), 0.37), uv[:, 1] - 0.41])
    assert length(lifted(uv), f, up, f) == pytest.approx(1.0, abs=1e-12)
    # The line from one side of the sheet to the other at 30 degrees.
    slope = np.tan(np.pi / 6)
    slanted = np.column_stack([uv[:, 0], 0.2 + slope * uv[:, 0], uv[:, 1] - 0.41])
    assert length(lifted(uv), f, slanted, f) == pytest.approx(1 / np.cos(np.pi / 6), abs=1e-12)


def test_one_mesh_crossing_itself():
    uv, f = sheet(1.0, 1.0, 7, 5)
    up = np.column_stack([uv[:, 0], np.full(len(uv), 0.37), uv[:, 1] - 0.41])
    v, both = np.concatenate([lifted(uv), up]), np.concatenate([f, f + len(uv)])
    assert contour_length(self_intersecting_triangles(v, both), v, both, v, both) == pytest.approx(1.0)


def test_symmetry_scale_motion_orientation_and_refinement():
    rng = np.random.default_rng(0)
    v, f = sphere(2, 1.0)
    w = v + np.array([0.7, 0.2, 0.1]) + 0.03 * rng.normal(size=v.shape)
    whole = length(v, f, w, f)
    assert whole > 1.0
    assert length(w, f, v, f) == pytest.approx(whole, rel=1e-12)
    assert length(1e-3 * v, f, 1e-3 * w, f) == pytest.approx(1e-3 * whole, rel=1e-12)
    assert length(turned(v), f, turned(w), f) == pytest.approx(whole, rel=1e-12)
    assert length(v, f[:, ::-1], w, f) == pytest.approx(whole, rel=1e-12)
    assert length(*refined(v, f, 2), *refined(w, f)) == pytest.approx(whole, rel=1e-12)


def test_contour_along_edges_counts_once():
    # The octahedron's equator lies in the plane: a square of side sqrt(2), along edges of both halves.
    corners = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
    faces = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 0, 5], [2, 1, 5], [3, 2, 5], [0, 3, 5]])
    uv, f = sheet(3.0, 3.0, 1, 1)
    for plane in (f, f[:, ::-1]):
        assert length(lifted(uv - 1.5), plane, corners, faces) == pytest.approx(4 * np.sqrt(2), abs=1e-12)


def test_touching_and_coplanar_surfaces_have_no_contour():
    uv, f = sheet(1.0, 1.0, 4, 4)
    pairs = intersecting_triangles(lifted(uv), f, lifted(uv + 0.03), f)
    assert len(pairs) > 0
    assert pairs.coplanar.all()
    assert contour_length(pairs, lifted(uv), f, lifted(uv + 0.03), f) == 0.0
    tip = np.array([[0.5, 0.5, 0.0], [0.4, 0.5, 1.0], [0.6, 0.5, 1.0]])
    assert length(lifted(uv), f, tip, np.array([[0, 1, 2]])) == 0.0
    assert len(intersecting_triangles(lifted(uv), f, tip, np.array([[0, 1, 2]]))) > 0
