"""Templates and the uv layout: one connectivity and one uv for the whole family, without flips."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from muslin.garments import catalogue
from muslin.garments.carry import carry
from muslin.garments.cut import cut_pattern
from muslin.garments.errors import InputError
from muslin.garments.locate import locate
from muslin.garments.mesh import corner_angles, signed_areas
from muslin.garments.pattern import Pattern
from muslin.garments.template import EDGE_LENGTHS, template, template_of
from muslin.garments.topology import asset_path, digest, reference, topology
from muslin.garments.triangulate import triangulate
from muslin.garments.uv_layout import BACKGROUND, BACKGROUND_EDGE_LENGTH, interpolate

TEE = catalogue.get("tee")
CORNERS = list(itertools.product(*((p.low, p.high) for p in TEE.parameters.values())))


@pytest.mark.parametrize(("resolution", "count"), [(403, 404), (1400, 1400), (4000, 4004), (17246, 17246)])
def test_vertex_counts(resolution: int, count: int) -> None:
    mesh = template("tee", TEE.reference, resolution)
    assert mesh.num_vertices == count
    assert mesh.euler_characteristic == -2
    assert len(mesh.boundary_loops) == 4
    angles = np.degrees(corner_angles(mesh.panel_vertices, mesh.panel_faces))
    assert angles.min() > 22.0


@pytest.mark.parametrize("resolution", [403, 1400])
def test_every_member_has_the_same_connectivity_and_uv(resolution: int) -> None:
    first = template("tee", {}, resolution)
    rng = np.random.default_rng(resolution)
    inside = [tuple(rng.uniform(p.low, p.high) for p in TEE.parameters.values()) for _ in range(4)]
    corners = CORNERS if resolution == 403 else CORNERS[::3]
    for values in [*corners, *inside]:
        parameters = dict(zip(TEE.parameters, map(float, values), strict=True))
        member = template("tee", parameters, resolution)
        assert member.parameters == parameters
        for key in ("faces", "panel_faces", "panel_to_vertex", "face_panel", "uv"):
            np.testing.assert_array_equal(getattr(member, key), getattr(first, key))
        # `template` has checked that no triangle is inverted; none is near it either.
        assert np.degrees(corner_angles(member.panel_vertices, member.panel_faces)).min() > 6.0
        pattern = TEE.pattern(**parameters)
        edge_length = EDGE_LENGTHS[resolution]
        assert member.face_areas.sum() == pytest.approx(pattern.area, rel=16.0 * edge_length**2)


@pytest.mark.parametrize("resolution", [403, 1400, 4000])
def test_a_template_is_known_by_its_triangles(resolution: int) -> None:
    mesh = template("tee", {"garment_length": 0.9}, resolution)
    assert template_of(mesh) == resolution
    turned = replace(mesh, faces=mesh.faces[::-1].copy(), panel_faces=mesh.panel_faces[::-1].copy())
    assert template_of(turned) is None


def test_reference_member_is_not_distorted() -> None:
    mesh = template("tee", TEE.reference, 1400)
    scale = np.sqrt(signed_areas(mesh.uv, mesh.panel_faces) / mesh.face_areas)
    np.testing.assert_allclose(scale, scale[0], rtol=1e-9)


def test_uv_is_free_of_flips_and_overlap() -> None:
    mesh = template("tee", {}, 4000)
    assert (signed_areas(mesh.uv, mesh.panel_faces) > 0.0).all()
    assert mesh.uv.min() >= 0.0
    assert mesh.uv.max() <= 1.0
    boxes = [mesh.uv[mesh.panel_vertex_panel == k] for k in range(4)]
    for a, b in itertools.combinations(boxes, 2):
        apart = (a.max(axis=0) + 0.02 < b.min(axis=0)) | (b.max(axis=0) + 0.02 < a.min(axis=0))
        assert apart.any()


@pytest.mark.parametrize("preset", ["top", "long_dress"])
def test_meshes_and_templates_of_all_resolutions_share_one_layout(preset: str) -> None:
    """On every mesh the same point has the same uv, to a quarter of a texel of a 128 x 128 map."""
    parameters = TEE.preset(preset)
    fine = template("tee", parameters, 4000)
    for other in (template("tee", parameters, 1400), triangulate(TEE.pattern(**parameters), 0.03)):
        errors = []
        for k in range(4):
            of_panel = np.flatnonzero(fine.panel_vertex_panel == k)
            faces = fine.panel_faces[fine.face_panel == k] - of_panel[0]
            chosen = other.panel_vertex_panel == k
            found = interpolate(
                fine.panel_vertices[of_panel], faces, fine.uv[of_panel], other.panel_vertices[chosen]
            )
            errors.append(np.linalg.norm(found - other.uv[chosen], axis=1))
        assert np.sqrt(np.mean(np.concatenate(errors) ** 2)) < 0.25 / 128
        assert np.concatenate(errors).max() < 1.5 / 128


def test_resolutions_have_names() -> None:
    assert template("tee", {}, "coarse").num_vertices == template("tee", {}, "403").num_vertices
    for wrong in (500, "huge"):
        with pytest.raises(InputError, match=f"resolution = {wrong} is not known; allowed: 403, 1400"):
            template("tee", {}, wrong)
    with pytest.raises(InputError, match=r"sleeve_length = 9.0 is out of range"):
        template("tee", {"sleeve_length": 9.0}, 403)


def test_stored_topologies_belong_to_the_design_as_it_is_drawn() -> None:
    pattern = reference("tee").pattern
    for key, edge_length in {**EDGE_LENGTHS, BACKGROUND: BACKGROUND_EDGE_LENGTH}.items():
        with np.load(asset_path("tee", str(key))) as stored:
            assert str(stored["digest"]) == digest(pattern, edge_length), "run python -m muslin.garments.bake"
    stored_cut = topology("tee", "403", EDGE_LENGTHS[403])
    fresh = cut_pattern(pattern, EDGE_LENGTHS[403], seed=0)
    np.testing.assert_allclose(stored_cut.panel_vertices, fresh.panel_vertices, atol=1e-6)
    assert stored_cut.sampling == fresh.sampling
    np.testing.assert_array_equal(stored_cut.panel_starts, fresh.panel_starts)


def test_pattern_of_another_structure_gets_its_own_layout() -> None:
    tee = TEE.pattern()
    front = Pattern("tee", tee.panels[:1], ())
    mesh = triangulate(front, 0.05)
    scale = signed_areas(mesh.uv, mesh.panel_faces) / mesh.face_areas
    np.testing.assert_allclose(scale, scale[0], rtol=1e-9)


def square_mesh() -> tuple[np.ndarray, np.ndarray, int]:
    cut = cut_pattern(catalogue.get("tee").pattern(), 0.04, 0)
    return cut.vertices_of(0), cut.faces_of(0), len(cut.sampling.points(TEE.pattern(), "front"))


def test_carry_reproduces_small_affine_maps_and_the_identity() -> None:
    points, faces, fixed = square_mesh()
    np.testing.assert_allclose(carry(points, faces, points[:fixed]), points, atol=1e-14)
    # An affine displacement is harmonic and, to first order, leaves the stiffness even.
    map_ = np.eye(2) + 1e-3 * np.array([[1.0, 0.4], [-0.3, -2.0]])
    carried = carry(points, faces, points[:fixed] @ map_.T)
    np.testing.assert_allclose(carried, points @ map_.T, atol=1e-5)


def test_locate_finds_the_triangle_and_extrapolates_outside() -> None:
    points, faces, _ = square_mesh()
    rng = np.random.default_rng(5)
    face, weights = rng.integers(len(faces), size=300), rng.dirichlet([1.0, 1.0, 1.0], size=300)
    queries = np.einsum("qi,qik->qk", weights, points[faces[face]])
    found, barycentric = locate(points, faces, queries)
    np.testing.assert_array_equal(found, face)
    np.testing.assert_allclose(barycentric, weights, atol=1e-9)
    outside = np.array([[0.0, 0.5], [3.0, -2.0]])
    found, barycentric = locate(points, faces, outside)
    np.testing.assert_allclose(np.einsum("qi,qik->qk", barycentric, points[faces[found]]), outside, atol=1e-9)
    assert (barycentric.min(axis=1) < 0.0).all()
    assert locate(points, faces, np.empty((0, 2)))[1].shape == (0, 3)
