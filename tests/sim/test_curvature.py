"""Curvature of triangles from hinge angles: exact on quadratics, moments that do the folded sheet's work."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from muslin.eval.validate.meshes import delaunay
from muslin.garments.mesh import GarmentMesh
from muslin.sim.cloth import ClothModel, build_cloth
from muslin.sim.material import isotropic_fabric
from tests.sim.conftest import make_flat_mesh
from tests.sim.meshes import KINDS, Kind, sheet

Array = NDArray[np.float64]

FABRIC = isotropic_fabric(young=2.0e6, poisson=0.3, thickness=4.0e-4, density=0.2)
TENSORS = np.array([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.7, -1.3, 0.4)])


def operator(cloth: ClothModel) -> Array:
    """(F, 3, H), from angles to (K11, K22, K12)."""
    dense = np.zeros((len(cloth.faces), len(cloth.hinges), 3))
    face = np.repeat(np.arange(len(cloth.faces)), np.diff(cloth.curvature_offsets))
    np.add.at(dense, (face, cloth.curvature_hinges), cloth.curvature_weights)
    return dense.transpose(0, 2, 1)


def corner_places(mesh: GarmentMesh, cloth: ClothModel) -> Array:
    """(H, 4, 2) warp/weft places of the hinges' vertices, on one plane; the mesh has no seams."""
    return mesh.panel_vertices[:, ::-1][cloth.hinges]


def small_angles(places: Array, heights: Array) -> Array:
    """(H,) angles of hinges at warp/weft places (H, 4, 2) that are lifted by small heights (H, 4): the slope
    across the edge in both triangles together."""
    begin, end = places[:, 0], places[:, 1]
    edge = end - begin
    length = np.linalg.norm(edge, axis=1)
    angle = np.zeros(len(places))
    for k in (2, 3):
        arm = places[:, k] - begin
        share = (arm * edge).sum(axis=1) / length**2
        height = np.abs(edge[:, 0] * arm[:, 1] - edge[:, 1] * arm[:, 0]) / length
        angle += (heights[:, k] - (1.0 - share) * heights[:, 0] - share * heights[:, 1]) / height
    return angle


def quadratic(places: Array, tensor: Array) -> Array:
    x, y = places[..., 0], places[..., 1]
    return 0.5 * tensor[0] * x**2 + 0.5 * tensor[1] * y**2 + tensor[2] * x * y


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_quadratics_have_their_curvature_in_every_triangle(kind: Kind, seed: int) -> None:
    mesh = sheet(kind, 0.5, 0.4, 0.05, seed)
    cloth = build_cloth(mesh, FABRIC)
    places = corner_places(mesh, cloth)
    for tensor in TENSORS:
        found = operator(cloth) @ small_angles(places, quadratic(places, tensor))
        np.testing.assert_allclose(found, np.tile(tensor, (len(found), 1)), atol=1e-9)


def test_a_strip_one_square_wide_sees_all_but_curvature_across() -> None:
    """No triangle has three neighbours, and no hinge lies along the strip."""
    mesh = sheet("structured", 0.6, 0.1, 0.1)
    cloth = build_cloth(mesh, FABRIC)
    places = corner_places(mesh, cloth)
    for tensor in TENSORS:
        found = operator(cloth) @ small_angles(places, quadratic(places, tensor))
        np.testing.assert_allclose(found, np.tile(tensor * [0.0, 1.0, 1.0], (len(found), 1)), atol=1e-9)


def test_two_triangles_alone_take_the_smallest_curvature_that_folds_them() -> None:
    points = 0.04 * np.array([(0.0, 0.0), (1.0, 0.0), (0.5, 0.9), (0.5, -0.9)])
    cloth = build_cloth(make_flat_mesh(points, [(0, 1, 2), (1, 0, 3)]), FABRIC)
    height, length = 0.9 * 0.04, 0.04
    # theta = h K_nn - l^2 K_tt / (4 h), n the warp and t the weft here
    row = np.array([height, -(length**2) / (4.0 * height), 0.0])
    fitted = row / (row @ row)
    for k in operator(cloth)[:, :, 0]:
        assert row @ k == pytest.approx(1.0, rel=1e-9)
        np.testing.assert_allclose(k, fitted, rtol=1e-9)


def test_a_triangle_alone_has_no_curvature() -> None:
    cloth = build_cloth(make_flat_mesh([(0.0, 0.0), (0.1, 0.0), (0.0, 0.1)], [(0, 1, 2)]), FABRIC)
    assert len(cloth.curvature_hinges) == 0
    np.testing.assert_array_equal(cloth.curvature_offsets, [0, 0])


@pytest.mark.parametrize("kind", KINDS)
def test_constant_moments_do_the_work_of_the_folded_sheet(kind: Kind) -> None:
    """sum A K = sum l theta n n^T for any folds that stay clear of the border: the patch test."""
    mesh = sheet(kind, 0.5, 0.4, 0.04, 1)
    cloth = build_cloth(mesh, FABRIC)
    places = corner_places(mesh, cloth)
    inner = ((mesh.panel_vertices > 0.13) & (mesh.panel_vertices < [0.37, 0.27])).all(axis=1)
    heights = np.where(inner, np.random.default_rng(0).normal(size=len(inner)), 0.0)
    angle = small_angles(places, heights[cloth.hinges])
    assert np.abs(angle).max() > 1.0
    edge = places[:, 1] - places[:, 0]
    length = np.linalg.norm(edge, axis=1)
    n = np.stack([-edge[:, 1], edge[:, 0]], axis=1) / length[:, None]
    folded = (length * angle) @ np.stack([n[:, 0] ** 2, n[:, 1] ** 2, n[:, 0] * n[:, 1]], axis=1)
    found = cloth.rest_area @ (operator(cloth) @ angle)
    np.testing.assert_allclose(found, folded, atol=1e-12 * np.abs(length * angle).sum())


@pytest.mark.parametrize("kind", KINDS)
def test_only_flat_hinges_have_no_curvature(kind: Kind) -> None:
    mesh = sheet(kind, 0.4, 0.3, 0.05, 2)
    cloth = build_cloth(mesh, FABRIC)
    places = corner_places(mesh, cloth)
    n = cloth.num_vertices
    folds = np.stack([small_angles(places, row[cloth.hinges]) for row in np.eye(n)], axis=1)
    curvature = operator(cloth).reshape(-1, len(cloth.hinges)) @ folds
    values = np.linalg.svd(curvature, compute_uv=False)
    # Three rigid motions, and no other.
    assert values[n - 4] > 1e-2 * values[0]
    assert values[n - 3] < 1e-9 * values[0]


def test_needles_and_conics_stay_bounded() -> None:
    """Six points on a circle determine no quadratic; the fit then takes in more of the mesh."""
    angles = np.radians([0.0, 60.0, 120.0, 180.0, 240.0, 300.0])
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    points = 0.05 * np.concatenate([ring, 2.2 * ring @ np.array([[0.0, 1.0], [-1.0, 0.0]])])
    mesh = make_flat_mesh(points, delaunay(points))
    cloth = build_cloth(mesh, FABRIC)
    places = corner_places(mesh, cloth)
    found = operator(cloth) @ small_angles(places, quadratic(places, TENSORS[3]))
    np.testing.assert_allclose(found, np.tile(TENSORS[3], (len(found), 1)), atol=1e-8)
    shortest = np.linalg.norm(places[:, 1] - places[:, 0], axis=1).min()
    assert np.abs(cloth.curvature_weights).max() < 10.0 / shortest


def test_seams_are_unfolded_into_each_panels_frame() -> None:
    """A sheet cut in two; the second panel lies elsewhere, turned: each triangle sees the whole sheet."""
    mesh = sheet("irregular", 0.5, 0.4, 0.05, 3)
    turn = np.radians(70.0)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    second = mesh.panel_vertices[mesh.faces].mean(axis=1)[:, 0] > 0.25
    n = mesh.num_vertices
    sewn = GarmentMesh(
        faces=mesh.faces,
        panel_faces=np.where(second[:, None], mesh.faces + n, mesh.faces).astype(np.int32),
        panel_vertices=np.concatenate([mesh.panel_vertices, mesh.panel_vertices @ rotation.T + [1.0, 0.2]]),
        panel_to_vertex=np.tile(np.arange(n, dtype=np.int32), 2),
        face_panel=second.astype(np.int32),
        panel_names=("left", "right"),
        uv=np.zeros((2 * n, 2)),
        name="sewn",
        parameters={},
    )
    places = corner_places(mesh, build_cloth(mesh, FABRIC))
    cloth = build_cloth(sewn, FABRIC)
    angle = small_angles(places, quadratic(places, TENSORS[3]))
    tensor = np.array([[TENSORS[3][1], TENSORS[3][2]], [TENSORS[3][2], TENSORS[3][0]]])  # over (x, y)
    turned = rotation @ tensor @ rotation.T
    expected = np.where(second[:, None], [turned[1, 1], turned[0, 0], turned[0, 1]], TENSORS[3])
    np.testing.assert_allclose(operator(cloth) @ angle, expected, atol=1e-9)
