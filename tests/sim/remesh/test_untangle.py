"""Untangling: coarse triangles over a sphere cut into it; then nothing crosses, and little has moved."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from muslin.garments.errors import InputError
from muslin.sim.dataset.intersections import count_intersections, find_crossings
from muslin.sim.remesh.topology import remesh
from muslin.sim.remesh.untangle import untangle
from tests.sim.meshes import sheet

RADIUS = 0.2
BALL = trimesh.creation.icosphere(4, RADIUS)
BODY = np.array(BALL.vertices), np.array(BALL.faces, dtype=np.int32)


def draped(mesh, gap: float = 0.0005) -> np.ndarray:
    """A sheet laid over the sphere `gap` metres above it, hanging down straight from the equator on."""
    points = mesh.panel_vertices - 0.5 * (mesh.panel_vertices.min(axis=0) + mesh.panel_vertices.max(axis=0))
    way = np.linalg.norm(points, axis=1)
    round_ = np.minimum(way / (RADIUS + gap), 0.5 * np.pi)
    below = np.maximum(way - 0.5 * np.pi * (RADIUS + gap), 0.0)
    outward = points / np.maximum(way, 1e-12)[:, None]
    r, h = (RADIUS + gap) * np.sin(round_), (RADIUS + gap) * np.cos(round_) - below
    return np.stack([r * outward[:, 0], h, -r * outward[:, 1]], axis=1)


def test_a_coarse_sheet_over_a_sphere_is_freed() -> None:
    mesh = sheet("alternating", 0.7, 0.7, 0.01)
    drape = draped(mesh)
    assert len(find_crossings(drape, mesh.faces, *BODY)) == 0
    made = remesh(mesh, drape, 16.0 * float(mesh.face_areas.mean()))  # edges four times as long
    before = find_crossings(made.positions, made.mesh.faces, *BODY)
    assert len(before) > 100
    free = untangle(made, drape, *BODY)
    counts = count_intersections(free.positions, made.mesh.faces, *BODY)
    assert (counts.cloth_cloth, counts.cloth_body) == (0, 0)
    moved = np.linalg.norm(free.positions - made.positions, axis=1)
    assert 0.0 < moved.max() < 0.004, "a chord of 6 cm is 2.3 mm inside the sphere"
    # What hangs well below the equator touches nothing, and is left where it was, to the bit.
    below = made.positions[:, 1] < -0.08
    assert below.sum() > 30
    np.testing.assert_array_equal(free.positions[below], made.positions[below])
    np.testing.assert_array_equal(free.mesh.panel_vertices, made.mesh.panel_vertices)


def test_two_layers_of_one_cloth_are_parted() -> None:
    """A fold 2 mm wide with waves along it, remeshed with triangles larger than the waves."""
    mesh = sheet("alternating", 0.6, 0.3, 0.01)
    x, y = (mesh.panel_vertices - mesh.panel_vertices.min(axis=0)).T
    turn = np.clip((x - 0.3) / 0.002 + 0.5 * np.pi, 0.0, np.pi)
    along = np.where(x < 0.3, x, 0.6 - x)
    wave = 0.01 * np.sin(2.0 * np.pi * (along + 0.5 * y) / 0.15)
    drape = np.stack([along, y, wave + 0.001 * (1.0 - np.cos(turn))], axis=1)
    none = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32)
    if len(find_crossings(drape, mesh.faces, *none)):
        pytest.fail("the fold is meant to be free of crossings")
    made = remesh(mesh, drape, 5e-4, seed=1)
    assert len(find_crossings(made.positions, made.mesh.faces, *none)) > 0
    free = untangle(made, drape)
    assert len(find_crossings(free.positions, made.mesh.faces, *none)) == 0


def test_what_crosses_nothing_is_returned_as_it_is() -> None:
    mesh = sheet("irregular", 0.3, 0.3, 0.03)
    flat = np.c_[mesh.panel_vertices, np.zeros(mesh.num_vertices)]
    made = remesh(mesh, flat, 8e-4)
    np.testing.assert_array_equal(untangle(made, flat).positions, made.positions)


def test_a_drape_that_crosses_the_body_itself_is_refused() -> None:
    mesh = sheet("alternating", 0.7, 0.7, 0.035)
    sunk = draped(mesh) - [0.0, 0.05, 0.0]
    made = remesh(mesh, sunk, 4e-3)
    with pytest.raises(InputError, match="intersections itself"):
        untangle(made, sunk, *BODY)
