"""Sizing fields normalised to a mean area, and followed from the start."""

from __future__ import annotations

import numpy as np
import pytest

from muslin.garments.errors import InputError
from muslin.sim.remesh.drape_metric import drape_metric, with_mean_area
from muslin.sim.remesh.metric import edge_lengths, uniform
from muslin.sim.remesh.settings import RemeshSettings
from muslin.sim.remesh.topology import remesh
from tests.sim.meshes import sheet

SETTINGS = RemeshSettings(refine_angle=0.25, size_min=0.005, size_max=0.1, aspect_min=0.3)


def bent(mesh) -> np.ndarray:
    """Flat to the left, rolled to a radius of 5 cm to the right of the middle; a bend along y."""
    x, y = mesh.panel_vertices.T
    x = x - 0.5 * (x.min() + x.max())
    angle = np.maximum(x, 0.0) / 0.05
    return np.stack([np.minimum(x, 0.0) + 0.05 * np.sin(angle), y, 0.05 * (1.0 - np.cos(angle))], axis=1)


def test_the_mean_area_is_reached() -> None:
    mesh = sheet("alternating", 0.4, 0.4, 0.01)
    for area in (1e-4, 6e-4):
        metric = drape_metric(mesh, bent(mesh), SETTINGS, area)
        made = remesh(mesh, bent(mesh), metric)
        assert made.mesh.face_areas.mean() == pytest.approx(area, rel=0.02)
        assert made.distortion <= 2.5


def test_bends_get_more_triangles_that_lie_along_them() -> None:
    mesh = sheet("alternating", 0.4, 0.4, 0.01)
    made = remesh(mesh, bent(mesh), drape_metric(mesh, bent(mesh), SETTINGS, 3e-4)).mesh
    middle = mesh.panel_vertices[:, 0].mean()
    centre = made.panel_vertices[made.panel_faces].mean(axis=1)[:, 0] - middle
    assert (centre > 0.05).sum() > 3 * (centre < -0.05).sum()
    inside = (made.panel_vertices[made.edges] - [middle, 0.0])[:, :, 0].min(axis=1) > 0.05
    u = np.diff(made.panel_vertices[made.edges[inside]], axis=1)[:, 0]
    assert np.sqrt((u[:, 1] ** 2).mean() / (u[:, 0] ** 2).mean()) > 1.8


def test_normalising_scales_the_metric_alone() -> None:
    mesh = sheet("irregular", 0.4, 0.3, 0.05)
    given = uniform(np.full(len(mesh.panel_vertices), 7e-4))
    expected = uniform(np.full(len(mesh.panel_vertices), 2e-4))
    np.testing.assert_allclose(with_mean_area(mesh, given, 2e-4), expected)
    field = drape_metric(mesh, np.c_[mesh.panel_vertices, 0.0 * mesh.panel_vertices[:, :1]], SETTINGS)
    scaled = with_mean_area(mesh, field, 2e-4)
    ratio = edge_lengths(mesh.panel_vertices, mesh.edges, scaled) / edge_lengths(
        mesh.panel_vertices, mesh.edges, field
    )
    np.testing.assert_allclose(ratio, ratio[0])
    with pytest.raises(InputError, match="must be positive"):
        with_mean_area(mesh, given, 0.0)
