"""Angles of panels at their boundary, and the corners of triangles that lie at them."""

import numpy as np
import pytest

from muslin.garments.boundary_angles import boundary_angles, corners_at
from muslin.garments.designs.tee import TEE
from muslin.garments.mesh import GarmentMesh, corner_angles
from muslin.garments.triangulate import triangulate


@pytest.fixture(scope="module")
def tee() -> GarmentMesh:
    return triangulate(TEE.pattern(**TEE.preset("tshirt")), 0.04)


def test_angles_of_a_panel_add_up(tee: GarmentMesh):
    beta = boundary_angles(tee, corner_angles(tee.panel_vertices, tee.panel_faces))
    for panel in range(len(tee.panel_names)):
        here = beta[(tee.panel_vertex_panel == panel) & np.isfinite(beta)]
        assert here.sum() == pytest.approx((len(here) - 2) * np.pi)


def test_inner_vertices_are_not_confined(tee: GarmentMesh):
    beta = boundary_angles(tee, corner_angles(tee.panel_vertices, tee.panel_faces))
    assert set(np.flatnonzero(np.isfinite(beta))) == set(tee.panel_boundary_edges.ravel())


def test_corners_are_found_in_another_triangulation_of_their_own_panel(tee: GarmentMesh):
    other = triangulate(TEE.pattern(**TEE.preset("tshirt")), 0.07)
    chosen = np.zeros(len(tee.panel_vertices), dtype=bool)
    chosen[tee.panel_boundary_edges[0, 0]] = True
    (vertex,) = np.flatnonzero(chosen)
    gap = np.linalg.norm(other.panel_vertices - tee.panel_vertices[vertex], axis=1)
    there = (gap < 1e-6) & (other.panel_vertex_panel == tee.panel_vertex_panel[vertex])
    np.testing.assert_array_equal(corners_at(other, tee, chosen), there[other.panel_faces])
    assert corners_at(tee, tee, chosen).sum() == np.count_nonzero(tee.panel_faces == vertex)
