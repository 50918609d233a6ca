"""Sizing tensors against closed forms: rolled, compressed, turning and falling cloth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.sim.remesh.metric import clamp, eigenvalues, tensor_maximum
from muslin.sim.remesh.obstacle import Obstacle
from muslin.sim.remesh.settings import RemeshSettings
from muslin.sim.remesh.sizing import PanelGradient, compression, face_sizing, sizing_field, squared
from tests.sim.meshes import KINDS, sheet

Array = NDArray[np.float64]

OPEN = RemeshSettings(size_min=1e-4, size_max=10.0, aspect_min=0.01)
"""Bounds so wide that closed forms show through."""
FLOOR = 1e-2
"""1 / size_max^2 of OPEN."""


def turned(mesh: GarmentMesh, angle: float) -> GarmentMesh:
    """The mesh with its panel turned by `angle`, shifted too."""
    c, s = np.cos(angle), np.sin(angle)
    return replace(mesh, panel_vertices=mesh.panel_vertices @ np.array([[c, s], [-s, c]]) + [0.7, -0.2])


def rolled(points: Array, radius: float) -> Array:
    """x wound around an axis along y: no length changes."""
    angle = points[:, 0] / radius
    return np.stack([radius * np.sin(angle), points[:, 1], radius * (1.0 - np.cos(angle))], axis=1)


def inner(mesh: GarmentMesh, margin: float) -> NDArray[np.bool_]:
    """(F,) faces that are clear of the border by `margin`, of a panel before it is turned."""
    lower, upper = mesh.panel_vertices.min(axis=0) + margin, mesh.panel_vertices.max(axis=0) - margin
    corners = mesh.panel_vertices[mesh.panel_faces]
    return ((corners >= lower) & (corners <= upper)).all(axis=(1, 2))


def lifted(mesh: GarmentMesh) -> Array:
    return np.column_stack([mesh.panel_vertices, np.zeros(mesh.num_vertices)])


@pytest.mark.parametrize("radius", [0.05, 0.2])
def test_a_roll_has_its_curvature_around_and_none_along(radius: float) -> None:
    mesh = sheet("alternating", 0.24, 0.1, 0.005)
    settings = replace(OPEN, refine_angle=0.3)
    found = face_sizing(mesh, rolled(mesh.panel_vertices, radius), settings)[inner(mesh, 0.011)]
    around = 1.0 / (0.3 * radius) ** 2
    # A chord under the angle t turns the normal by 2 sin(t / 2).
    np.testing.assert_allclose(found[:, 0, 0], around, rtol=0.02 * (0.05 / radius) ** 2)
    np.testing.assert_allclose(found[:, 0, 1], 0.0, atol=1e-9 * around)
    along = np.maximum(1e-4 * found[:, 0, 0], FLOOR)
    np.testing.assert_allclose(found[:, 1, 1], along, rtol=1e-6)


def test_curvature_of_irregular_triangles_is_right_in_the_mean() -> None:
    """However small the triangles, only where they are regular it is right in each."""
    settings = replace(OPEN, refine_angle=0.3)
    error = {}
    for kind in KINDS:
        mesh = sheet(kind, 0.2, 0.12, 0.01)
        found = face_sizing(mesh, rolled(mesh.panel_vertices, 0.1), settings)[inner(mesh, 0.021)]
        error[kind] = np.abs(found[:, 0, 0].mean() * (0.3 * 0.1) ** 2 - 1.0)
        assert found[:, 1, 1].mean() < 0.02 * found[:, 0, 0].mean()
    assert error.pop("irregular") < 0.08
    assert max(error.values()) < 0.005


def test_the_tensor_turns_with_the_panel_and_not_with_the_world() -> None:
    mesh = sheet("irregular", 0.2, 0.15, 0.02)
    rng = np.random.default_rng(0)
    positions = rolled(mesh.panel_vertices, 0.1) + rng.normal(scale=5e-4, size=(mesh.num_vertices, 3))
    velocities = rng.normal(size=positions.shape)
    settings = RemeshSettings(0.3, 0.005, 0.5, size_min=0.005)
    found = sizing_field(mesh, positions, settings, velocities)
    c, s = np.cos(0.8), np.sin(0.8)
    r = np.array([[c, -s], [s, c]])
    there = sizing_field(turned(mesh, 0.8), positions, settings, velocities)
    np.testing.assert_allclose(there, r @ found @ r.T, atol=1e-6)
    q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    q *= np.sign(np.linalg.det(q))
    moved = sizing_field(mesh, positions @ q.T + [1.0, 2.0, 3.0], settings, velocities @ q.T + 4.0)
    np.testing.assert_allclose(moved, found, atol=1e-6)


def test_a_linear_field_has_its_gradient_on_every_face() -> None:
    mesh = turned(sheet("irregular", 0.2, 0.15, 0.02), 0.3)
    slope = np.array([(1.0, -2.0), (0.5, 3.0), (0.0, 0.1)])
    gradient = PanelGradient(mesh)(mesh.panel_vertices @ slope.T + 5.0)
    np.testing.assert_allclose(gradient, np.tile(slope, (len(mesh.faces), 1, 1)), atol=1e-11)
    np.testing.assert_allclose(squared(gradient), gradient.transpose(0, 2, 1) @ gradient, atol=1e-12)


@pytest.mark.parametrize("factor", [0.99, 0.8, 1.1])
def test_a_flat_sheet_is_refined_where_it_is_compressed(factor: float) -> None:
    """e = factor^2 - 1 along x, lambda = -e / c^2."""
    c = 0.005
    mesh = sheet("irregular", 0.2, 0.15, 0.02)
    positions = lifted(mesh) * [factor, 1.0, 1.0]
    strain = squared(PanelGradient(mesh)(positions)) - np.eye(2)
    expected = np.tile(np.diag([factor**2 - 1.0, 0.0]), (len(mesh.faces), 1, 1))
    np.testing.assert_allclose(strain, expected, atol=1e-12)
    wanted = max(1.0 - factor**2, 0.0) / c**2
    found = compression(strain, np.zeros_like(strain), c)
    np.testing.assert_allclose(found, np.tile(np.diag([wanted, 0.0]), (len(found), 1, 1)), atol=1e-6)
    field = sizing_field(mesh, positions, replace(OPEN, refine_compression=c))
    np.testing.assert_allclose(eigenvalues(field)[:, 0], max(wanted, FLOOR), rtol=1e-6)


@pytest.mark.parametrize(("factor", "radius"), [(0.9, 0.1), (0.9, 0.06), (0.9, 0.04), (0.97, 0.1)])
def test_a_compressed_tube_has_the_shortest_wave_that_grows(factor: float, radius: float) -> None:
    """The larger root of c^2 lambda^2 + e lambda + k^2 = 0 where it is real, and its real part elsewhere."""
    c, e, k = 0.005, factor**2 - 1.0, 1.0 / radius
    strain, bent = np.diag([0.0, e])[None], np.diag([k**2, 0.0])[None]
    found = compression(strain, bent, c)[0]
    larger = np.roots([c**2, e, k**2])
    assert found[1, 1] == pytest.approx(larger.real.max(), rel=1e-9)
    assert found[0, 0] == found[0, 1] == 0.0
    stiff = -e < 2.0 * c * k
    assert stiff == np.iscomplex(larger).all()
    # Bent along the compression instead of across it, it buckles as a flat one does.
    np.testing.assert_allclose(
        compression(strain, bent[:, ::-1, ::-1], c)[0], np.diag([0.0, -e / c**2]), atol=1e-9
    )


def test_a_rolled_sheet_compressed_along_its_axis_feels_its_roll() -> None:
    c, factor, radius = 0.005, 0.9, 0.08
    mesh = sheet("alternating", 0.16, 0.1, 0.004)
    positions = rolled(mesh.panel_vertices, radius) * [1.0, factor, 1.0]
    found = face_sizing(mesh, positions, replace(OPEN, refine_compression=c))[inner(mesh, 0.009)]
    expected = np.roots([c**2, factor**2 - 1.0, radius**-2]).max()
    np.testing.assert_allclose(found[:, 1, 1], expected, rtol=2e-3)


def test_compression_turns_with_the_panel() -> None:
    rng = np.random.default_rng(1)
    root = rng.normal(size=(50, 2, 2))
    strain, bent = 0.2 * (root + root.transpose(0, 2, 1)), 100.0 * root @ root.transpose(0, 2, 1)
    c, s = np.cos(0.4), np.sin(0.4)
    r = np.array([[c, -s], [s, c]])
    expected = r @ compression(strain, bent, 0.01) @ r.T
    np.testing.assert_allclose(compression(r @ strain @ r.T, r @ bent @ r.T, 0.01), expected, atol=1e-7)
    assert np.linalg.eigvalsh(expected).min() > -1e-7


def test_a_turning_sheet_is_refined_by_how_its_velocity_changes() -> None:
    """(grad v)^T (grad v) = F^T (|w|^2 I - w w^T) F, and nothing of what all parts share."""
    mesh = turned(sheet("irregular", 0.2, 0.15, 0.02), 0.5)
    positions, spin = lifted(mesh), np.array([1.0, -2.0, 4.0])
    settings = replace(OPEN, refine_velocity=0.5)
    found = face_sizing(mesh, positions, settings, np.cross(spin, positions) + 5.0)
    expected = ((spin @ spin) * np.eye(3) - np.outer(spin, spin))[:2, :2] / 0.5**2
    np.testing.assert_allclose(found, np.tile(expected, (len(found), 1, 1)), atol=1e-8)
    still = face_sizing(mesh, positions, settings, np.tile([5.0, 0.0, 1.0], (len(positions), 1)))
    np.testing.assert_allclose(still, np.tile(FLOOR * np.eye(2), (len(still), 1, 1)), atol=1e-12)
    np.testing.assert_array_equal(face_sizing(mesh, positions, settings), still)


def ball(radius: float, subdivisions: int) -> Obstacle:
    shape = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return Obstacle(shape.vertices, shape.faces)


def test_a_sheet_beside_a_sphere_is_refined_towards_it() -> None:
    """In the plane at height z, h = |x| - R and grad h = x / |x|: the fall within the plane, over h.

    Tangent planes are those of the sphere's facets, whose slope is right to half the angle of an edge.
    """
    radius, height = 0.3, 0.302
    mesh = sheet("alternating", 0.14, 0.04, 0.004)
    positions = np.column_stack([mesh.panel_vertices, np.full(mesh.num_vertices, height)])
    settings = replace(OPEN, refine_obstacle=True, size_max=0.1)
    distance = np.linalg.norm(positions[mesh.faces], axis=2)
    h, fall = distance - radius, positions[mesh.faces][:, :, :2] / distance[:, :, None]
    within = 1.0 * (h < 10.4e-3)[:, :, None, None]
    tensors = (within * fall[..., :, None] * fall[..., None, :] / (h**2)[:, :, None, None]).mean(axis=1)
    expected = clamp(tensors, 1e-4, 0.1, 0.01)
    assert expected.max() > 5.0 * 0.1**-2
    beyond = (h > 10.6e-3).all(axis=1)
    clear = (h < 10.4e-3).all(axis=1) | beyond
    assert beyond.sum() > 50
    errors = []
    for subdivisions in (4, 5, 6):
        sphere = ball(radius, subdivisions)
        found = face_sizing(mesh, positions, settings, obstacle=sphere, contact_range=1.05e-3)
        np.testing.assert_allclose(found[beyond], expected[beyond], rtol=1e-12)
        errors.append(np.linalg.norm((found - expected)[clear]) / np.linalg.norm(expected[clear]))
    assert errors[1] < 0.6 * errors[0]
    assert errors[2] < 0.6 * errors[1]
    assert errors[2] < 0.1


def test_a_sheet_that_comes_down_edge_first_may_reach_as_far_as_it_is_away() -> None:
    """A vertical sheet above a plane: h falls by its height, so M = 1 / h^2 downwards and 0 sideways."""
    mesh = sheet("structured", 0.05, 0.01, 0.001)
    points = mesh.panel_vertices
    positions = np.column_stack([points[:, 0], 0.004 + points[:, 1], np.zeros(len(points))])
    plane = Obstacle(
        np.array([(-1.0, 0.0, -1.0), (-1.0, 0.0, 1.0), (1.0, 0.0, 1.0), (1.0, 0.0, -1.0)]),
        np.array([(0, 1, 2), (0, 2, 3)]),
    )
    settings = replace(OPEN, refine_obstacle=True)
    found = face_sizing(mesh, positions, settings, obstacle=plane)
    expected = (positions[mesh.faces][:, :, 1] ** -2.0).mean(axis=1)
    np.testing.assert_allclose(found[:, 1, 1], expected, rtol=1e-4)
    np.testing.assert_allclose(found[:, 0, 0], 1e-4 * expected, rtol=1e-2)
    off = face_sizing(mesh, positions, replace(settings, refine_obstacle=False), obstacle=plane)
    np.testing.assert_allclose(off, np.tile(FLOOR * np.eye(2), (len(off), 1, 1)))


def test_criteria_combine_to_their_maximum() -> None:
    mesh = sheet("irregular", 0.2, 0.15, 0.02)
    positions = rolled(mesh.panel_vertices, 0.1) * [1.0, 0.9, 1.0]
    velocities = np.cross([0.0, 3.0, 5.0], positions)
    on = {"refine_angle": 0.3, "refine_compression": 0.005, "refine_velocity": 0.5}
    bounds = RemeshSettings(size_min=0.005)
    parts = [
        face_sizing(mesh, positions, replace(bounds, **{key: on[key]}), velocities)  # type: ignore[arg-type]
        for key in on
    ]
    together = face_sizing(mesh, positions, RemeshSettings(**on, size_min=0.005), velocities)
    expected = clamp(tensor_maximum(tensor_maximum(parts[0], parts[1]), parts[2]), 0.005, 0.2, 0.2)
    np.testing.assert_allclose(together, expected, rtol=1e-9)


def test_cloth_crumpled_at_random_keeps_to_the_bounds() -> None:
    mesh = sheet("irregular", 0.2, 0.15, 0.02)
    rng = np.random.default_rng(2)
    settings = RemeshSettings(0.3, 0.005, 0.5)
    positions, velocities = rng.normal(size=(2, mesh.num_vertices, 3))
    for scale in (0.0, 1e-3, 1.0, 1e3):
        field = sizing_field(mesh, scale * positions, settings, scale * velocities)
        large, small = eigenvalues(field).T
        assert large.max() <= 0.01**-2 * (1.0 + 1e-9)
        assert small.min() >= 0.2**-2 * (1.0 - 1e-9)
        assert (small / large).min() >= 0.2**2 * (1.0 - 1e-9)
        assert field.flags.c_contiguous


def test_positions_that_are_not_the_mesh_s_are_refused(sheet_mesh: GarmentMesh) -> None:
    positions = lifted(sheet_mesh)
    with pytest.raises(InputError, match=r"positions has shape"):
        sizing_field(sheet_mesh, positions[:-1], OPEN)
    with pytest.raises(InputError, match=r"velocities has shape"):
        sizing_field(sheet_mesh, positions, OPEN, positions[:, :2])
    positions[3, 1] = np.nan
    with pytest.raises(InputError, match=r"positions\[3\]"):
        sizing_field(sheet_mesh, positions, OPEN)
