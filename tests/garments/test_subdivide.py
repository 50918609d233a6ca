"""Midpoint subdivision: the same surface, positions as means of the parents."""

from __future__ import annotations

import numpy as np
import pytest

from muslin.garments.subdivide import subdivide
from muslin.garments.template import template

COARSE = template("tee", {}, 403)
FINE, PARENTS = subdivide(COARSE)


def test_counts_and_topology() -> None:
    FINE.validate()
    assert FINE.num_vertices == COARSE.num_vertices + len(COARSE.edges)
    assert len(FINE.faces) == 4 * len(COARSE.faces)
    assert FINE.euler_characteristic == COARSE.euler_characteristic
    assert len(FINE.boundary_loops) == 4
    assert PARENTS.shape == (FINE.num_vertices, 2)
    assert PARENTS.dtype == np.int32


def test_old_vertices_come_first_and_edges_follow_in_order() -> None:
    kept = np.arange(COARSE.num_vertices)
    np.testing.assert_array_equal(PARENTS[: COARSE.num_vertices], np.stack([kept, kept], axis=1))
    np.testing.assert_array_equal(PARENTS[COARSE.num_vertices :], COARSE.edges)
    np.testing.assert_array_equal(FINE.panel_to_vertex[: len(COARSE.panel_vertices)], COARSE.panel_to_vertex)


def test_panel_space_and_uv_are_the_same_surface() -> None:
    for panel in range(4):
        assert FINE.face_areas[FINE.face_panel == panel].sum() == pytest.approx(
            COARSE.face_areas[COARSE.face_panel == panel].sum(), abs=1e-14
        )
    parent = np.tile(COARSE.face_areas, 4)
    np.testing.assert_allclose(FINE.face_areas, parent / 4.0, rtol=1e-9)


def test_world_surface_keeps_its_area_under_any_deformation() -> None:
    positions = np.random.default_rng(0).normal(size=(COARSE.num_vertices, 3))

    def areas(x: np.ndarray, faces: np.ndarray) -> np.ndarray:
        a, b, c = x[faces[:, 0]], x[faces[:, 1]], x[faces[:, 2]]
        return 0.5 * np.cross(b - a, c - a)

    fine = areas(positions[PARENTS].mean(axis=1), FINE.faces)
    # Vector areas: the four children lie in the parent's plane, facing the same way.
    np.testing.assert_allclose(fine, np.tile(areas(positions, COARSE.faces), (4, 1)) / 4.0, atol=1e-14)


def test_panel_midpoints_sit_on_the_midpoints_of_their_sewn_edges() -> None:
    position = np.random.default_rng(1).normal(size=COARSE.num_vertices)
    fine = position[PARENTS].mean(axis=1)
    corners = position[COARSE.faces]
    a, b, c = corners.T
    np.testing.assert_allclose(
        fine[FINE.faces[: len(a)]], np.stack([a, (a + b) / 2, (c + a) / 2], axis=1), atol=1e-15
    )
