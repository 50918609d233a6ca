"""Rest geometry of a cloth, its masses, hinges and matrix pattern, against direct constructions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from muslin.garments.mesh import GarmentMesh
from muslin.sim.cloth import build_cloth
from muslin.sim.elastic import principal_stretches
from muslin.sim.material import load_fabric

FABRIC = load_fabric("camel-ponte-roma")


def placed(mesh: GarmentMesh, warp: float = 1.0, weft: float = 1.0) -> np.ndarray:
    """An unsewn mesh in space as its panel, stretched along warp (+y) and weft (+x), turned and moved."""
    flat = np.zeros((mesh.num_vertices, 3))
    flat[:, 0], flat[:, 1] = weft * mesh.panel_vertices[:, 0], warp * mesh.panel_vertices[:, 1]
    return Rotation.from_euler("xyz", [0.3, -1.1, 2.0]).apply(flat) + np.array([0.1, 0.2, 0.3])


def test_areas_and_mass_add_up(sheet_mesh: GarmentMesh) -> None:
    cloth = build_cloth(sheet_mesh, FABRIC)
    area = 0.3 * 0.4
    assert cloth.rest_area.sum() == pytest.approx(area, rel=1e-12)
    assert cloth.vertex_area.sum() == pytest.approx(area, rel=1e-12)
    assert cloth.edge_area.sum() == pytest.approx(area, rel=1e-12)
    assert cloth.mass.sum() == pytest.approx(area * FABRIC.density, rel=1e-12)
    np.testing.assert_allclose(cloth.vertex_area, sheet_mesh.vertex_areas, rtol=1e-12)


def test_edge_area_is_a_third_of_the_faces_at_the_edge(sheet_mesh: GarmentMesh) -> None:
    cloth = build_cloth(sheet_mesh, FABRIC)
    for edge, area in zip(cloth.edges, cloth.edge_area, strict=True):
        around = np.isin(cloth.faces, edge).sum(axis=1) == 2
        assert area == pytest.approx(cloth.rest_area[around].sum() / 3.0)


def test_deformation_gradient_is_one_at_rest_and_knows_warp_from_weft(sheet_mesh: GarmentMesh) -> None:
    cloth = build_cloth(sheet_mesh, FABRIC)
    warp_weft = placed(sheet_mesh, 1.2, 0.9)
    corners = warp_weft[cloth.faces]
    edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
    gradient = edges @ cloth.inverse_rest
    metric = gradient.transpose(0, 2, 1) @ gradient
    np.testing.assert_allclose(metric, np.tile(np.diag([1.2**2, 0.9**2]), (len(metric), 1, 1)), atol=1e-12)
    np.testing.assert_allclose(principal_stretches(sheet_mesh, placed(sheet_mesh)), 1.0, atol=1e-12)
    np.testing.assert_allclose(
        principal_stretches(sheet_mesh, warp_weft), [[1.2, 0.9]] * len(metric), atol=1e-12
    )


def test_hinges_are_the_interior_edges_each_once(sheet_mesh: GarmentMesh) -> None:
    cloth = build_cloth(sheet_mesh, FABRIC)
    assert len(cloth.hinges) == len(sheet_mesh.edges) - len(sheet_mesh.boundary_edges)
    assert len(np.unique(np.sort(cloth.hinges[:, :2], axis=1), axis=0)) == len(cloth.hinges)
    faces = {frozenset(face) for face in cloth.faces.tolist()}
    directed = {(face[k], face[(k + 1) % 3]) for face in cloth.faces.tolist() for k in range(3)}
    for a, b, c, d in cloth.hinges.tolist():
        assert frozenset((a, b, c)) in faces
        assert frozenset((a, b, d)) in faces
        # The first face runs from a to b, so the normals of (a, b, c) and (b, a, d) both look outside.
        assert {(a, b), (b, c), (c, a), (b, a), (a, d), (d, b)} <= directed


def test_pattern_is_that_of_faces_and_hinges_below_the_diagonal(sheet_mesh: GarmentMesh) -> None:
    cloth = build_cloth(sheet_mesh, FABRIC)
    n = cloth.num_vertices
    coupled = np.zeros((n, n), dtype=bool)
    for stencils in (cloth.faces, cloth.hinges):
        for stencil in stencils:
            coupled[np.ix_(stencil, stencil)] = True
    offsets, columns = cloth.pattern
    assert offsets.dtype == columns.dtype == np.int32
    for row in range(n):
        np.testing.assert_array_equal(
            columns[offsets[row] : offsets[row + 1]], np.flatnonzero(coupled[row, :row])
        )


def test_slots_are_where_the_pattern_holds_the_pair(sheet_mesh: GarmentMesh) -> None:
    cloth = build_cloth(sheet_mesh, FABRIC)
    offsets, columns = cloth.pattern
    rows = np.repeat(np.arange(cloth.num_vertices), np.diff(offsets))
    for stencils in (cloth.faces, cloth.hinges):
        ascending = np.sort(stencils, axis=1)
        larger, smaller = np.array([(i, j) for i in range(stencils.shape[1]) for j in range(i)]).T
        slots = cloth.slots(stencils)
        np.testing.assert_array_equal(rows[slots], ascending[:, larger])
        np.testing.assert_array_equal(columns[slots], ascending[:, smaller])
