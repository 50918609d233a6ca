"""Points of equal panel-space coordinates: exact for linear fields, second order for smooth ones."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from muslin.garments import catalogue
from muslin.garments.correspondence import correspondence
from muslin.garments.errors import InputError
from muslin.garments.merge import merge_meshes
from muslin.garments.mesh import GarmentMesh
from muslin.garments.subdivide import subdivide
from muslin.garments.triangulate import triangulate


@lru_cache
def tee(edge_length: float, seed: int = 0) -> GarmentMesh:
    return triangulate(catalogue.get("tee").pattern(), edge_length, seed)


@lru_cache
def sheet(edge_length: float, seed: int = 0) -> GarmentMesh:
    return triangulate(catalogue.get("sheet").pattern(), edge_length, seed)


def panel_points(mesh: GarmentMesh) -> np.ndarray:
    """(V, 2) one panel-space point of each vertex."""
    points = np.empty((mesh.num_vertices, 2))
    points[mesh.panel_to_vertex] = mesh.panel_vertices
    return points


def linear(mesh: GarmentMesh) -> np.ndarray:
    u = panel_points(mesh)
    return np.stack([1.0 + 2.0 * u[:, 0] - u[:, 1], u[:, 1], 3.0 * u[:, 0]], axis=1)


@pytest.mark.parametrize(("coarse", "fine"), [(0.2, 0.05), (0.05, 0.2), (0.1, 0.1)])
def test_linear_fields_of_a_sheet_are_carried_exactly(coarse: float, fine: float) -> None:
    source, target = sheet(coarse, 0), sheet(fine, 1)
    found = correspondence(source, target)
    np.testing.assert_allclose(found.distance, 0.0, atol=1e-8)
    np.testing.assert_allclose(found.carry(linear(source)), linear(target), atol=1e-12)
    np.testing.assert_allclose(found.carry(np.ones(source.num_vertices)), 1.0, atol=1e-15)


def test_smooth_fields_are_carried_to_second_order() -> None:
    target = sheet(0.07, 5)
    lengths = np.array([0.1, 0.05, 0.025])
    errors = []
    for length in lengths:
        source = sheet(float(length), 1)
        carried = correspondence(source, target).carry(np.sin(4.0 * panel_points(source)).sum(axis=1))
        errors.append(np.abs(carried - np.sin(4.0 * panel_points(target)).sum(axis=1)).max())
    order = np.polyfit(np.log(lengths), np.log(errors), 1)[0]
    assert 1.7 < order < 2.4


def test_a_mesh_corresponds_to_itself_vertex_for_vertex() -> None:
    mesh = tee(0.05)
    found = correspondence(mesh, mesh)
    place = np.arange(mesh.num_vertices, dtype=float)
    np.testing.assert_allclose(found.carry(place), place, atol=1e-9)


def test_midpoint_subdivision_is_carried_to_the_means_of_its_parents() -> None:
    mesh = tee(0.05)
    fine, parents = subdivide(mesh)
    values = np.random.default_rng(0).normal(size=(mesh.num_vertices, 3))
    np.testing.assert_allclose(
        correspondence(mesh, fine).carry(values), values[parents].mean(axis=1), atol=1e-9
    )


@pytest.mark.parametrize(("source", "target"), [(0.05, 0.02), (0.02, 0.05)])
def test_curved_boundaries_are_as_far_off_as_their_chords(source: float, target: float) -> None:
    found = correspondence(tee(source), tee(target))
    # Chords of 5 cm of the tee's curves, all of radius 5 cm or more, sag by less than 7 mm.
    assert 1e-6 < found.distance.max() < 0.007
    assert np.median(found.distance) < 1e-9
    assert found.weights.min() >= 0.0
    np.testing.assert_allclose(found.weights.sum(axis=1), 1.0, atol=1e-12)


def test_seams_lead_to_seams() -> None:
    source, target = tee(0.05), tee(0.02)
    several = np.flatnonzero(np.bincount(target.panel_to_vertex) > 1)
    found = correspondence(source, target)
    assert len(several) > 100
    on_seam = np.bincount(source.panel_to_vertex) > 1
    used = found.weights[several] > 1e-6
    assert on_seam[found.corners[several]][used].all()


def test_hems_lead_to_hems() -> None:
    source, target = tee(0.05), tee(0.02)
    found = correspondence(source, target)
    hem, there = np.unique(target.boundary_edges), np.unique(source.boundary_edges)
    used = found.weights[hem] > 1e-6
    assert np.isin(found.corners[hem], there)[used].all()


def test_other_patterns_do_not_correspond() -> None:
    mesh = sheet(0.1)
    wide = triangulate(catalogue.get("sheet").pattern(width=1.2), 0.1)
    unsaid = replace(wide, parameters=mesh.parameters)
    for other, says in (
        (tee(0.05), "names: tee, sheet"),
        (wide, "parameters: "),
        (replace(mesh, panel_names=("back",)), r"panels: \['back'\]"),
        (unsaid, r"differ by 0\.1 m in panel space"),
    ):
        with pytest.raises(InputError, match=says):
            correspondence(other, mesh) if other is not unsaid else correspondence(mesh, other)


def test_each_garment_of_a_merged_mesh_is_found_in_its_own_panels() -> None:
    source, target = (
        merge_meshes(["in", "out"], [sheet(a), sheet(b, 3)]) for a, b in ((0.2, 0.1), (0.1, 0.2))
    )
    layer = np.repeat([0.0, 1.0], [sheet(0.2).num_vertices, sheet(0.1, 3).num_vertices])
    wanted = np.repeat([0.0, 1.0], [sheet(0.1).num_vertices, sheet(0.2, 3).num_vertices])
    np.testing.assert_allclose(correspondence(source, target).carry(layer), wanted, atol=1e-12)
