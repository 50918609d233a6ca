"""Distortion in a metric, against triangles whose distortion is known and against the plain figure."""

from __future__ import annotations

import numpy as np
import pytest

from muslin.eval.metrics.triangle_quality import distortion as plain_distortion
from muslin.sim.remesh.distortion import distortion, forced, least_quality
from muslin.sim.remesh.metric import uniform
from muslin.sim.remesh.topology import remesh
from tests.sim.meshes import sheet
from tests.sim.remesh.panels import one_panel


def wedge(angle: float, stretch: float = 1.0):
    """A triangle with one angle of so many degrees at the origin, its legs 1 m long, stretched along y."""
    end = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    points = np.array([[0.0, 0.0], [1.0, 0.0], end]) * [1.0, stretch]
    return one_panel(points, np.array([[0, 1, 2]], dtype=np.int32))


def test_in_a_uniform_metric_it_is_that_of_the_triangle() -> None:
    mesh = sheet("irregular", 0.3, 0.3, 0.04)
    metric = uniform(np.full(len(mesh.panel_vertices), 2e-4))
    plain = plain_distortion(mesh.panel_vertices, mesh.panel_faces)
    np.testing.assert_allclose(distortion(mesh, metric), plain, rtol=1e-10)


def test_stretching_panel_and_metric_alike_changes_nothing() -> None:
    mesh, stretched = wedge(40.0), wedge(40.0, 3.0)
    here = np.tile(np.eye(2), (3, 1, 1))
    there = np.tile(np.diag([1.0, 1.0 / 9.0]), (3, 1, 1))
    np.testing.assert_allclose(distortion(stretched, there), distortion(mesh, here))
    assert abs(distortion(stretched, here)[0] / distortion(mesh, here)[0] - 1.0) > 0.1


def test_no_triangle_of_that_quality_is_more_distorted() -> None:
    """Over random triangles, q >= 2 D / (D^2 + 1) leaves none above D, and the bound is attained."""
    rng = np.random.default_rng(0)
    a, b, c = rng.uniform(size=(3, 20000, 2))
    lengths = sum(((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a)))
    area = 0.5 * np.abs(np.cross(np.c_[b - a, np.zeros(20000)], np.c_[c - a, np.zeros(20000)])[:, 2])
    quality = 4.0 * np.sqrt(3.0) * area / lengths
    points = np.stack([a, b, c], axis=1).reshape(-1, 2)
    shape = plain_distortion(points, np.arange(60000).reshape(-1, 3))
    for largest in (1.5, 2.0, 2.5, 4.0):
        passed = shape[quality >= least_quality(largest)]
        assert passed.max() <= largest
        assert passed.max() >= 0.98 * largest


@pytest.mark.parametrize(("angle", "left_out"), [(15.0, True), (20.0, True), (21.0, False), (50.0, False)])
def test_corners_that_the_pattern_makes_too_sharp_are_left_out(angle: float, left_out: bool) -> None:
    """sqrt(3) / (2 sin beta) is 2.5 at 20.3 degrees."""
    mesh = wedge(angle)
    metric = np.tile(np.eye(2), (3, 1, 1))
    assert forced(mesh, mesh, metric, 2.5).tolist() == [left_out]
    assert (distortion(mesh, metric)[0] > 2.5) == left_out


def test_a_panel_with_a_sharp_tip_is_triangulated_all_the_same() -> None:
    mesh = wedge(14.0)
    made = remesh(mesh, np.zeros((3, 3)), 5e-4, max_distortion=2.5)
    assert made.distortion <= 2.5
    plain = plain_distortion(made.mesh.panel_vertices, made.mesh.panel_faces)
    middle = np.linalg.norm(made.mesh.panel_vertices[made.mesh.panel_faces].mean(axis=1), axis=1)
    edge = np.sqrt(5e-4 * 4.0 / np.sqrt(3.0))
    assert plain[middle > 4.11 * edge].max() <= 2.5, "1 / (2 sin 7 degrees) = 4.10"
    assert plain[middle < edge].max() > 2.5
