"""Counts against the definition, evaluated in exact integers for every pair."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sheet_producer import RADIUS, RIPPLE, ball, make_sample, sheet, sheet_positions

from muslin.sim.dataset.intersections import IntersectionCounts, count_intersections, crossed_body_faces

GRID = 2.0**14
"""Coordinates are multiples of 1 / GRID, so that the determinants below are exact in 64-bit integers."""


def orientation(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Sign of det [b - a, c - a, d - a] of integer points, exactly."""
    u, v, w = b - a, c - a, d - a
    return np.sign(
        u[:, 0] * (v[:, 1] * w[:, 2] - v[:, 2] * w[:, 1])
        + u[:, 1] * (v[:, 2] * w[:, 0] - v[:, 0] * w[:, 2])
        + u[:, 2] * (v[:, 0] * w[:, 1] - v[:, 1] * w[:, 0])
    )


def piercings(points: np.ndarray, edges: np.ndarray, faces: np.ndarray) -> int:
    """Number of (edge, face) pairs without a common vertex, in general position, of which the edge pierces
    the face."""
    e, f = (index.ravel() for index in np.meshgrid(np.arange(len(edges)), np.arange(len(faces))))
    apart = ~(edges[e][:, :, None] == faces[f][:, None, :]).any(axis=(1, 2))
    p, q = points[edges[e[apart]]].swapaxes(0, 1)
    a, b, c = points[faces[f[apart]]].swapaxes(0, 1)
    separated = orientation(a, b, c, p) != orientation(a, b, c, q)
    turns = [orientation(p, q, *side) for side in ((a, b), (b, c), (c, a))]
    return int(np.count_nonzero(separated & (turns[0] == turns[1]) & (turns[1] == turns[2])))


def edges_of(faces: np.ndarray) -> np.ndarray:
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return np.unique(np.sort(sides, axis=1), axis=0)


def slow_counts(
    cloth: np.ndarray, cloth_faces: np.ndarray, body: np.ndarray, body_faces: np.ndarray
) -> IntersectionCounts:
    points = np.rint(np.concatenate([cloth, body]) * GRID).astype(np.int64)
    solid = body_faces + len(cloth)
    cloth_body = piercings(points, edges_of(cloth_faces), solid) + piercings(
        points, edges_of(solid), cloth_faces
    )
    return IntersectionCounts(piercings(points, edges_of(cloth_faces), cloth_faces), cloth_body)


@given(st.integers(0, 2**32 - 1), st.floats(0.05, 0.6))
@settings(max_examples=60, deadline=None)
def test_counts_equal_the_definition(seed: int, roughness: float) -> None:
    """Random crumpled sheets of 4 x 4 vertices beside a random octahedron."""
    draw = np.random.default_rng(seed)
    garment = sheet(4)
    flat = np.stack(
        [garment.panel_vertices[:, 0], 0.3 * draw.random(16), garment.panel_vertices[:, 1]], axis=1
    )
    cloth = flat + roughness * draw.normal(size=flat.shape)
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    body = 0.5 + 0.4 * axes + 0.05 * draw.normal(size=(6, 3))
    faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    body_faces = np.array(faces, dtype=np.int32)
    cloth, body = (np.rint(points * GRID) / GRID for points in (cloth, body))
    expected = slow_counts(cloth, garment.faces, body, body_faces)
    assert count_intersections(cloth, garment.faces, body, body_faces) == expected
    alone = [slow_counts(cloth, garment.faces, body, body_faces[[face]]).cloth_body for face in range(8)]
    crossed = crossed_body_faces(cloth, garment.faces, body, body_faces)
    assert crossed.tolist() == np.flatnonzero(alone).tolist()
    assert count_intersections(cloth, garment.faces, body, np.delete(body_faces, crossed, 0)).cloth_body == 0


@pytest.mark.parametrize("clearance", [1e-4, 1e-6])
def test_a_sheet_just_above_the_ball_is_free(clearance: float) -> None:
    vertices, faces = ball()
    flat = make_sample(clearance=0.0).positions[0].astype(np.float64)
    flat[:, 1] = float(vertices[0, :, 1].max()) + clearance
    assert count_intersections(flat, sheet().faces, vertices[0].astype(float), faces) == IntersectionCounts(
        0, 0
    )
    flat[:, 1] -= 2 * clearance
    assert count_intersections(flat, sheet().faces, vertices[0].astype(float), faces).cloth_body > 0


def test_a_body_that_crosses_itself_is_none_of_our_business() -> None:
    vertices, faces = ball()
    two = np.concatenate([vertices[0], vertices[0] + [0.1, 0.0, 0.0]]).astype(np.float64)
    both = np.concatenate([faces, faces + len(vertices[0])])
    cloth = sheet_positions(sheet(), RADIUS + 2 * RIPPLE, np.zeros(1))[0]
    assert count_intersections(cloth, sheet().faces, two, both) == IntersectionCounts(0, 0)


def test_cloth_far_from_the_body_and_cloth_alone() -> None:
    vertices, faces = ball()
    cloth = sheet_positions(sheet(), 10.0, np.zeros(1))[0]
    none = IntersectionCounts(0, 0)
    assert count_intersections(cloth, sheet().faces, vertices[0].astype(float), faces) == none
    assert count_intersections(cloth, sheet().faces, np.zeros((0, 3)), np.zeros((0, 3), np.int32)) == none
