"""Fitting topologies to one drape: exact where it can be, better than interpolation where it cannot."""

from __future__ import annotations

import numpy as np
import pytest

from muslin.sim.dataset.intersections import find_crossings
from muslin.sim.remesh.fit import fit, topologies, transfer_error
from muslin.sim.remesh.topology import remesh
from tests.sim.meshes import sheet
from tests.sim.remesh.panels import annulus, tube


def waves(mesh, height: float = 0.02, length: float = 0.25) -> np.ndarray:
    x, y = mesh.panel_vertices.T
    return np.stack([x, y, height * np.sin(2.0 * np.pi * (x + 0.3 * y) / length)], axis=1)


def linear(points: np.ndarray) -> np.ndarray:
    return points @ np.array([[1.0, 0.2, 0.7], [-0.3, 2.0, 0.1]]) + [1.0, 2.0, 3.0]


@pytest.mark.parametrize("count", [60, 2000])
def test_what_is_linear_over_panel_space_is_kept(count: int) -> None:
    """On a round panel too, whose new boundary lies partly outside the source's."""
    mesh = annulus(0.1, 0.3, 50, 8)
    made = fit(
        remesh(mesh, linear(mesh.panel_vertices), mesh.face_areas.sum() / count), linear(mesh.panel_vertices)
    )
    np.testing.assert_allclose(made.positions, linear(made.mesh.panel_vertices), atol=1e-9)


def test_the_projection_of_a_finer_linear_element_is_itself() -> None:
    """A drape that the new mesh can show exactly is found again: fitting a mesh to itself changes nothing."""
    mesh = sheet("irregular", 0.4, 0.4, 0.04)
    made = remesh(mesh, waves(mesh), 2e-3)
    itself = type(made)(
        mesh,
        np.zeros((mesh.num_vertices, 3)),
        mesh,
        np.repeat(np.arange(len(mesh.faces)), 3)[np.unique(mesh.panel_faces, return_index=True)[1]],
        np.eye(3)[np.unique(mesh.panel_faces, return_index=True)[1] % 3],
        1.0,
    )
    np.testing.assert_allclose(fit(itself, waves(mesh)).positions, waves(mesh), atol=1e-9)
    assert transfer_error(itself, itself.carry(waves(mesh))).max() > 0.01, "not fitted: all at the origin"
    assert transfer_error(fit(itself, waves(mesh)), waves(mesh)).max() < 1e-9


@pytest.mark.parametrize("area", [4e-4, 1.6e-3])
def test_fitting_beats_interpolation_in_the_mean(area: float) -> None:
    mesh = sheet("alternating", 0.6, 0.6, 0.01)
    drape = waves(mesh)
    made = remesh(mesh, drape, area)
    plain, fitted = transfer_error(made, drape), transfer_error(fit(made, drape), drape)
    assert np.sqrt((fitted**2).mean()) < 0.6 * np.sqrt((plain**2).mean())
    assert fitted.mean() < 0.6 * plain.mean()


def test_the_error_is_of_second_order() -> None:
    mesh = sheet("alternating", 0.6, 0.6, 0.006)
    drape = waves(mesh)
    errors = []
    for area in (2e-3, 5e-4):
        error = transfer_error(fit(remesh(mesh, drape, area), drape), drape)
        errors.append(np.sqrt((error**2).mean()))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.35)


def test_seams_stay_sewn_and_the_radius_is_not_lost() -> None:
    """A tube of one seam: interpolation puts a coarse polygon inside the round, the fit straddles it."""
    mesh = tube(2.0 * np.pi * 0.1, 0.4, 80, 50)
    angle = mesh.panel_vertices[:, 0] / 0.1
    panel = np.stack([0.1 * np.cos(angle), mesh.panel_vertices[:, 1], -0.1 * np.sin(angle)], axis=1)
    drape = np.empty((mesh.num_vertices, 3))
    drape[mesh.panel_to_vertex] = panel
    made = remesh(mesh, drape, 9e-4)
    fitted = fit(made, drape)
    assert fitted.positions.shape == (made.mesh.num_vertices, 3)
    radii = []
    for one in (made, fitted):
        centre = one.positions[one.mesh.faces].mean(axis=1)
        areas = one.mesh.face_areas
        radii.append((np.hypot(centre[:, 0], centre[:, 2]) * areas).sum() / areas.sum())
    assert radii[0] < 0.0985
    assert abs(radii[1] - 0.1) < 0.3 * abs(radii[0] - 0.1)


def test_topologies_describe_one_drape_and_cross_nothing() -> None:
    mesh = sheet("alternating", 0.5, 0.5, 0.01)
    drape = waves(mesh)
    found = list(topologies(mesh, drape, 1e-3, 3, seed=4))
    assert [len(one.mesh.faces) for one in found] == pytest.approx([250] * 3, rel=0.02)
    assert len({one.mesh.panel_vertices.tobytes() for one in found}) == 3
    none = np.zeros((0, 3))
    for k, one in enumerate(found):
        alone = next(topologies(mesh, drape, 1e-3, 1, seed=4 + k))
        np.testing.assert_array_equal(one.positions, alone.positions)
        assert len(find_crossings(one.positions, one.mesh.faces, none, none.astype(np.int32))) == 0
        assert np.sqrt((transfer_error(one, drape) ** 2).mean()) < 0.0015
