"""phi: triangulations of panels anew, their quality, what they keep, and what they refuse."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from muslin.eval.metrics.mesh_quality import quality
from muslin.garments.designs.tee import TEE
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template
from muslin.sim.remesh.distortion import EQUILATERAL
from muslin.sim.remesh.metric import area_density, edge_lengths, uniform
from muslin.sim.remesh.topology import Remeshed, remesh
from tests.sim.meshes import sheet
from tests.sim.remesh.panels import annulus, disk, tube

PRESETS = ("top", "tshirt", "sweater", "short_dress", "long_dress")
ROUND = (annulus(0.1, 0.3, 60, 8), disk(0.2, 60, 8), tube(0.6, 0.4, 30, 20))


@cache
def tee(preset: str) -> GarmentMesh:
    return template("tee", TEE.preset(preset), 4000)


def flat(mesh: GarmentMesh) -> NDArray[np.float64]:
    return np.zeros((mesh.num_vertices, 3))


def same(a: Remeshed, b: Remeshed) -> bool:
    return (
        np.array_equal(a.mesh.panel_vertices, b.mesh.panel_vertices)
        and np.array_equal(a.mesh.panel_faces, b.mesh.panel_faces)
        and np.array_equal(a.positions, b.positions)
    )


@pytest.mark.parametrize("vertices", [1400, 3600])
@pytest.mark.parametrize("preset", PRESETS)
def test_uniform_targets_make_good_triangles(preset: str, vertices: int) -> None:
    source = tee(preset)
    area = float(source.face_areas.sum()) / (2 * vertices)
    for seed in (0, 1):
        made = remesh(source, flat(source), area, seed=seed)
        found = quality(made.mesh, source)
        assert np.degrees(found.min_angle) >= 20.0
        assert found.below_good <= 0.01
        assert found.area_variation <= 0.25
        assert found.max_distortion <= 2.5
        assert found.curve_error is not None
        assert found.curve_error <= 1e-3
        assert (found.degenerate, found.inverted, found.degenerate_uv, found.inverted_uv) == (0, 0, 0, 0)
        assert found.seam_mismatches == 0
        assert made.mesh.face_areas.mean() == pytest.approx(area, rel=0.01)
        assert made.mesh.euler_characteristic == source.euler_characteristic
        assert len(made.mesh.boundary_loops) == len(source.boundary_loops)
        made.mesh.validate()


def test_distortion_of_two_is_within_reach() -> None:
    source = tee("sweater")
    area = float(source.face_areas.sum()) / 2800
    assert remesh(source, flat(source), area, max_distortion=2.2).distortion <= 2.2


def test_seams_have_both_sides_at_the_same_places() -> None:
    """Sewn vertices are shared, and both sides lie equally far along their seam in the source."""
    source = tee("long_dress")
    made = remesh(source, flat(source), float(source.face_areas.sum()) / 2800)
    copies = np.bincount(made.mesh.panel_to_vertex)
    corners = source.faces[made.face]
    for vertex in np.flatnonzero(copies > 1):
        images = []
        for side in np.flatnonzero(made.mesh.panel_to_vertex == vertex):
            image: dict[int, float] = {}
            for corner, weight in zip(corners[side], made.weights[side], strict=True):
                if weight != 0.0:
                    image[int(corner)] = float(weight)
            images.append(image)
        assert all(image == pytest.approx(images[0]) for image in images)


def test_seeds_choose_the_topology_and_repeat() -> None:
    source = tee("top")
    area = float(source.face_areas.sum()) / 2800
    first, again, other = (remesh(source, flat(source), area, seed=seed) for seed in (5, 5, 6))
    assert same(first, again)
    assert not same(first, other)
    assert len(first.mesh.faces) == pytest.approx(len(other.mesh.faces), rel=0.002)


def test_each_panel_has_its_own_target() -> None:
    source = tee("tshirt")
    targets = dict(zip(source.panel_names, (1e-4, 3e-4, 2e-4, 5e-4), strict=True))
    made = remesh(source, flat(source), targets).mesh
    for panel, name in enumerate(source.panel_names):
        assert made.face_areas[made.face_panel == panel].mean() == pytest.approx(targets[name], rel=0.03)
    assert (made.face_areas > 0.0).all()


@pytest.mark.parametrize("mesh", ROUND, ids=["annulus", "disk", "tube"])
@pytest.mark.parametrize("count", [150, 1000])
def test_holes_and_curves_without_corners(mesh: GarmentMesh, count: int) -> None:
    area = float(mesh.face_areas.sum()) / count
    made = remesh(mesh, flat(mesh), area)
    found = quality(made.mesh, mesh)
    assert made.mesh.euler_characteristic == mesh.euler_characteristic
    assert len(made.mesh.boundary_loops) == len(mesh.boundary_loops)
    assert len(made.mesh.faces) == pytest.approx(count, rel=0.02)
    assert np.degrees(found.min_angle) >= 20.0
    assert found.inverted == found.degenerate == 0
    length, given = (
        np.linalg.norm(np.diff(m.panel_vertices[m.panel_boundary_edges], axis=1), axis=2).sum()
        for m in (made.mesh, mesh)
    )
    assert length == pytest.approx(given, rel=1e-3)


def test_a_sizing_field_is_followed_with_its_direction() -> None:
    """Edges twice as long along y as along x, and finer to the right."""
    mesh = sheet("irregular", 1.0, 1.0, 0.03)
    x = mesh.panel_vertices[:, 0] - mesh.panel_vertices[:, 0].min()
    metric = np.zeros((len(x), 2, 2))
    metric[:, 0, 0] = (0.03 - 0.015 * x) ** -2
    metric[:, 1, 1] = 0.25 * metric[:, 0, 0]
    made = remesh(mesh, flat(mesh), metric)
    here = made.carry_panel(metric)
    size = edge_lengths(made.mesh.panel_vertices, made.mesh.edges, here)
    assert size.mean() == pytest.approx(1.0, abs=0.08)
    assert np.percentile(size, [2, 98]) == pytest.approx([1.0, 1.0], abs=0.45)
    count = float((mesh.face_areas * area_density(metric[mesh.panel_faces].mean(axis=1))).sum()) / EQUILATERAL
    assert len(made.mesh.faces) == pytest.approx(count, rel=0.02)
    u = made.mesh.panel_vertices[made.mesh.edges[:, 1]] - made.mesh.panel_vertices[made.mesh.edges[:, 0]]
    assert np.sqrt((u[:, 1] ** 2).mean() / (u[:, 0] ** 2).mean()) == pytest.approx(2.0, rel=0.1)
    assert made.distortion <= 2.5


def test_what_is_linear_over_a_straight_panel_is_carried_exactly() -> None:
    mesh = sheet("irregular", 0.5, 0.7, 0.05)
    A = np.array([[1.0, -0.3], [0.2, 2.0], [0.7, 0.1]])
    world = mesh.panel_vertices @ A.T + [1.0, 2.0, 3.0]
    made = remesh(mesh, world, 4e-4, seed=3)
    np.testing.assert_allclose(made.positions, made.mesh.panel_vertices @ A.T + [1.0, 2.0, 3.0], atol=1e-9)
    np.testing.assert_allclose(made.carry_panel(mesh.panel_vertices), made.mesh.panel_vertices, atol=1e-9)


def test_constants_and_partitions_of_one_are_carried_exactly() -> None:
    source = tee("sweater")
    made = remesh(source, flat(source), 4e-4)
    rng = np.random.default_rng(0)
    skinning = rng.dirichlet(np.ones(4), source.num_vertices)
    np.testing.assert_allclose(made.carry(np.full((source.num_vertices, 2), 7.0)), 7.0, rtol=1e-12)
    carried = made.carry(skinning)
    np.testing.assert_allclose(carried.sum(axis=1), 1.0, rtol=1e-12)
    assert carried.min() >= -1e-12
    corners, weights = made.at_vertices
    np.testing.assert_allclose(np.einsum("vk,vkj->vj", weights, skinning[corners]), carried)


@pytest.mark.parametrize(
    ("target", "options", "says"),
    [
        (0.0, {}, "must be positive"),
        (float("nan"), {}, "must be positive"),
        (1.0, {}, "less than one triangle"),
        (1e-2, {}, "out of reach"),
        ({"front": 1e-4}, {}, "has none"),
        ({"collar": 1e-4}, {}, "no such panel"),
        (4e-4, {"max_distortion": 1.0}, "must be more than 1"),
        (4e-4, {"max_distortion": 1.2}, "out of reach"),
        (np.zeros((3, 2, 2)), {}, "sizing field"),
    ],
)
def test_what_cannot_be_is_refused(target, options, says: str) -> None:
    source = tee("tshirt")
    with pytest.raises(InputError, match=says):
        remesh(source, flat(source), target, **options)


def test_a_uniform_field_is_a_uniform_target() -> None:
    source = tee("top")
    field = uniform(np.full(len(source.panel_vertices), 4e-4))
    assert same(remesh(source, flat(source), 4e-4), remesh(source, flat(source), field))
