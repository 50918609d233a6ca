"""Growth of sizes: bounded on every edge, by no more than it takes, from panel to panel."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template
from muslin.sim.remesh.gradation import TOLERANCE, limit_gradation
from muslin.sim.remesh.metric import eigenvalues, quadratic_form
from tests.sim.meshes import sheet

Array = NDArray[np.float64]


def size_at(mesh: GarmentMesh, point: tuple[float, float], fine: float, coarse: float) -> Array:
    """Isotropic, `fine` metres at the vertex nearest to `point`, and `coarse` elsewhere."""
    sizes = np.full(len(mesh.panel_vertices), coarse)
    sizes[np.linalg.norm(mesh.panel_vertices - point, axis=1).argmin()] = fine
    return sizes[:, None, None] ** -2 * np.eye(2)


@pytest.mark.parametrize("growth", [1.2, 2.0])
def test_no_edge_grows_faster(growth: float) -> None:
    mesh = sheet("irregular", 0.3, 0.2, 0.01)
    root = np.random.default_rng(0).normal(size=(mesh.num_vertices, 2, 2))
    metric = 100.0 * (root @ root.transpose(0, 2, 1) + 0.1 * np.eye(2))
    found = limit_gradation(mesh, metric, growth)
    assert eigenvalues(found - metric)[:, 1].min() > -1e-9 * metric.max()
    i, j = np.concatenate([mesh.edges, mesh.edges[:, ::-1]]).T
    way = np.sqrt(quadratic_form(found[i], mesh.panel_vertices[j] - mesh.panel_vertices[i]))
    asked = found[i] / ((1.0 + np.log(growth) * way) ** 2)[:, None, None]
    rest = (1.0 + TOLERANCE) * found[j] - asked
    assert np.linalg.eigvalsh(rest).min() > -1e-9 * metric.max()


def test_sizes_grow_with_the_way_from_a_fine_spot() -> None:
    """h' = ln(growth) in the limit of small edges: h = fine + ln(growth) r, up to the coarse size."""
    mesh = sheet("turned", 0.3, 0.3, 0.006)
    found = limit_gradation(mesh, size_at(mesh, (0.15, 0.15), 0.01, 0.05), 1.4)
    centre = mesh.panel_vertices[np.linalg.norm(mesh.panel_vertices - (0.15, 0.15), axis=1).argmin()]
    way = np.linalg.norm(mesh.panel_vertices - centre, axis=1)
    expected = np.minimum(0.01 + np.log(1.4) * way, 0.05)
    # Along edges of six directions the way is up to 2 / sqrt(3) longer, and each edge may save the tolerance.
    size = eigenvalues(found)[:, 0] ** -0.5
    assert (size > expected - 1e-9).all()
    assert (size < (0.01 + 2.0 / np.sqrt(3.0) * np.log(1.4) * way) * (1.0 + TOLERANCE)).all()
    np.testing.assert_allclose(size[way > 0.13], 0.05, rtol=1e-12)


def test_what_grows_slowly_enough_stays_as_it_is() -> None:
    mesh = sheet("irregular", 0.3, 0.2, 0.01)
    sizes = 0.01 + 0.3 * mesh.panel_vertices[:, 0]
    metric = sizes[:, None, None] ** -2 * np.eye(2)
    np.testing.assert_array_equal(limit_gradation(mesh, metric, 1.5), metric)


def test_fineness_spreads_across_seams() -> None:
    tee = template("tee", {}, resolution=1400)
    seam = np.bincount(tee.panel_to_vertex) > 1
    on_seam = np.flatnonzero(seam[tee.panel_to_vertex])
    spot = int(on_seam[len(on_seam) // 2])
    sizes = np.full(len(tee.panel_vertices), 0.1)
    sizes[spot] = 0.02
    metric = sizes[:, None, None] ** -2 * np.eye(2)
    found = limit_gradation(tee, metric, 1.3)
    raised = eigenvalues(found)[:, 0] > 1.5 * 0.1**-2
    panels = np.unique(tee.panel_vertex_panel[raised])
    assert len(panels) >= 2
    inside = raised & ~seam[tee.panel_to_vertex]
    assert len(np.unique(tee.panel_vertex_panel[inside])) >= 2


@pytest.mark.parametrize("growth", [1.0, 0.5, float("nan")])
def test_growth_has_to_be_growth(sheet_mesh: GarmentMesh, growth: float) -> None:
    with pytest.raises(InputError, match="must be more than 1"):
        limit_gradation(sheet_mesh, np.tile(np.eye(2), (len(sheet_mesh.panel_vertices), 1, 1)), growth)
