"""Rest geometry of a cloth, its masses, hinges and matrix pattern, against direct constructions."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from muslin.garments.mesh import GarmentMesh
from muslin.sim.cloth import bend_moments, build_cloth
from muslin.sim.elastic import principal_stretches
from muslin.sim.material import fabric_names, load_fabric

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
    np.testing.assert_allclose(principal_stretches(cloth, placed(sheet_mesh)), 1.0, atol=1e-12)
    np.testing.assert_allclose(principal_stretches(cloth, warp_weft), [[1.2, 0.9]] * len(metric), atol=1e-12)


def test_hinges_are_the_interior_edges_each_once(sheet_mesh: GarmentMesh) -> None:
    cloth = build_cloth(sheet_mesh, FABRIC)
    assert len(cloth.hinges) == len(sheet_mesh.edges) - len(sheet_mesh.boundary_edges)
    assert len(np.unique(np.sort(cloth.hinges[:, :2], axis=1), axis=0)) == len(cloth.hinges)
    faces = {frozenset(face): area for face, area in zip(cloth.faces.tolist(), cloth.rest_area, strict=True)}
    directed = {(face[k], face[(k + 1) % 3]) for face in cloth.faces.tolist() for k in range(3)}
    lengths = np.linalg.norm(
        sheet_mesh.panel_vertices[cloth.hinges[:, 1]] - sheet_mesh.panel_vertices[cloth.hinges[:, 0]], axis=1
    )
    np.testing.assert_allclose(cloth.hinge_length, lengths, rtol=1e-12)
    for (a, b, c, d), area in zip(cloth.hinges.tolist(), cloth.hinge_area, strict=True):
        assert area == pytest.approx(faces[frozenset((a, b, c))] + faces[frozenset((a, b, d))])
        # The first face runs from a to b, so the normals of (a, b, c) and (b, a, d) both look outside.
        assert {(a, b), (b, c), (c, a), (b, a), (a, d), (d, b)} <= directed


@pytest.mark.parametrize(
    ("degrees", "row"),
    [
        (90.0, 0.0),
        (45.0, 1.0),
        (0.0, 2.0),
        (-45.0, 1.0),
        (-90.0, 0.0),
        (180.0, 2.0),
        (60.0, 2 / 3),
        (-10.0, 16 / 9),
    ],
)
def test_hinge_stiffness_is_the_tables_at_the_direction_of_the_edge(
    flat_mesh: Callable[..., GarmentMesh], degrees: float, row: float
) -> None:
    """`degrees` of the edge from the weft (+x); `row` of the table: 0, 45, 90 degrees to the warp."""
    turn = np.radians(degrees)
    along, across = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    points = 0.05 * np.array([0 * along, along, 0.4 * along + across, 0.6 * along - across])
    cloth = build_cloth(flat_mesh(points, [(0, 1, 2), (1, 0, 3)]), FABRIC)
    lower = min(int(row), 1)
    expected = (lower + 1 - row) * FABRIC.bend[lower] + (row - lower) * FABRIC.bend[lower + 1]
    np.testing.assert_allclose(cloth.hinge_stiffness[0], expected, rtol=1e-9)
    assert cloth.hinge_length[0] == pytest.approx(0.05)


def test_hinge_on_a_seam_takes_the_mean_of_its_panels() -> None:
    """A panel with the edge along the warp sewn to one with the edge along the weft and a tenth longer."""
    mesh = GarmentMesh(
        faces=np.array([(0, 1, 2), (1, 0, 3)], dtype=np.int32),
        panel_faces=np.array([(0, 1, 2), (4, 3, 5)], dtype=np.int32),
        panel_vertices=np.array(
            [(0.0, 0.0), (0.0, 0.1), (-0.1, 0.0), (0.0, 0.0), (0.11, 0.0), (0.0, -0.1)]
        ),
        panel_to_vertex=np.array([0, 1, 2, 0, 1, 3], dtype=np.int32),
        face_panel=np.array([0, 1], dtype=np.int32),
        panel_names=("left", "right"),
        uv=np.zeros((6, 2)),
        name="seam",
        parameters={},
    )
    cloth = build_cloth(mesh, FABRIC)
    assert len(cloth.hinges) == 1
    np.testing.assert_allclose(cloth.hinge_stiffness[0], 0.5 * (FABRIC.bend[0] + FABRIC.bend[2]), rtol=1e-12)
    assert cloth.hinge_length[0] == pytest.approx(0.105)
    assert cloth.hinge_area[0] == pytest.approx(0.5 * 0.1 * (0.1 + 0.11))
    assert cloth.num_vertices == 4


@pytest.mark.parametrize("name", fabric_names())
def test_bend_moments_are_the_integrals_of_the_table(name: str) -> None:
    bend = load_fabric(name).bend
    moments = bend_moments(bend)
    curvatures = np.array([0.0, 5.0, 10.0, 15.0, 20.0])
    for k, moment in zip(bend, moments, strict=True):
        pieces = [
            quad(lambda a, k=k: np.interp(a, curvatures, k) * a, low, high)[0]
            for low, high in pairwise(curvatures)
        ]
        np.testing.assert_allclose(moment, np.concatenate([[0.0], np.cumsum(pieces)]), rtol=1e-12)


def test_pattern_is_that_of_faces_and_hinges(sheet_mesh: GarmentMesh) -> None:
    cloth = build_cloth(sheet_mesh, FABRIC)
    n = cloth.num_vertices
    coupled = np.eye(n, dtype=bool)
    for stencils in (cloth.faces, cloth.hinges):
        for stencil in stencils:
            coupled[np.ix_(stencil, stencil)] = True
    offsets, columns = cloth.pattern
    assert offsets.dtype == columns.dtype == np.int32
    for row in range(n):
        np.testing.assert_array_equal(columns[offsets[row] : offsets[row + 1]], np.flatnonzero(coupled[row]))


def test_slots_are_where_the_pattern_holds_the_pair(sheet_mesh: GarmentMesh) -> None:
    cloth = build_cloth(sheet_mesh, FABRIC)
    offsets, columns = cloth.pattern
    rows = np.repeat(np.arange(cloth.num_vertices), np.diff(offsets))
    for stencils in (cloth.faces, cloth.hinges):
        k = stencils.shape[1]
        slots = cloth.slots(stencils).reshape(len(stencils), k, k)
        np.testing.assert_array_equal(rows[slots], np.repeat(stencils[:, :, None], k, axis=2))
        np.testing.assert_array_equal(columns[slots], np.repeat(stencils[:, None, :], k, axis=1))
