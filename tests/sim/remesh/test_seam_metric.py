"""Seams: the sides pair up, agree along the seam, and a cut leaves the sizing of the sheet as it was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template
from muslin.sim.remesh.metric import edge_lengths, eigenvalues, quadratic_form, uniform
from muslin.sim.remesh.seam_metric import SeamEdges, agree_on_seams, sewn_edge_lengths
from muslin.sim.remesh.settings import RemeshSettings
from muslin.sim.remesh.sizing import face_sizing, sizing_field
from tests.sim.meshes import sheet

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def tee() -> GarmentMesh:
    return template("tee", {}, resolution=1400)


@pytest.fixture(scope="module")
def field(tee: GarmentMesh) -> Array:
    """A tensor of its own at every panel vertex, positive definite."""
    root = np.random.default_rng(0).normal(size=(len(tee.panel_vertices), 2, 2))
    return 100.0 * (root @ root.transpose(0, 2, 1) + 0.1 * np.eye(2))


def cut(mesh: GarmentMesh, angle: float) -> GarmentMesh:
    """A sheet cut in the middle along y and sewn again; the second panel lies elsewhere, turned."""
    c, s = np.cos(angle), np.sin(angle)
    middle = 0.5 * mesh.panel_vertices[:, 0].max()
    second = mesh.panel_vertices[mesh.faces].mean(axis=1)[:, 0] > middle
    n = mesh.num_vertices
    both = np.concatenate(
        [mesh.panel_vertices, mesh.panel_vertices @ np.array([[c, s], [-s, c]]) + [1.0, 0.2]]
    )
    faces = np.where(second[:, None], mesh.faces + n, mesh.faces)
    used, compact = np.unique(faces, return_inverse=True)
    result = replace(
        mesh,
        panel_faces=compact.reshape(faces.shape).astype(np.int32),
        panel_vertices=both[used],
        panel_to_vertex=(used % n).astype(np.int32),
        face_panel=second.astype(np.int32),
        panel_names=("left", "right"),
        uv=np.zeros((len(used), 2)),
    )
    result.validate()
    return result


def along_both_sides(mesh: GarmentMesh, metric: Array) -> tuple[Array, Array]:
    """(S,) sizes of the seam edges per metre, here and on the other side."""
    seams = SeamEdges.of(mesh)
    sides = []
    for ends in ((seams.tail, seams.head), (seams.twin_tail, seams.twin_head)):
        u = mesh.panel_vertices[ends[1]] - mesh.panel_vertices[ends[0]]
        size = edge_lengths(mesh.panel_vertices, np.stack(ends, axis=1), metric)
        sides.append(size / np.linalg.norm(u, axis=1))
    return sides[0], sides[1]


def test_seam_edges_are_those_with_two_places_in_panel_space(tee: GarmentMesh) -> None:
    seams = SeamEdges.of(tee)
    places: dict[tuple[int, int], set[tuple[int, int]]] = {}
    for face in tee.panel_faces.tolist():
        for a, b in zip(face, face[1:] + face[:1], strict=True):
            edge = sorted([(int(tee.panel_to_vertex[a]), a), (int(tee.panel_to_vertex[b]), b)])
            places.setdefault((edge[0][0], edge[1][0]), set()).add((edge[0][1], edge[1][1]))
    expected = {edge for edge, copies in places.items() if len(copies) == 2}
    found = np.sort(np.stack([tee.panel_to_vertex[seams.tail], tee.panel_to_vertex[seams.head]], 1), axis=1)
    assert {tuple(edge) for edge in found.tolist()} == expected
    assert len(found) == 2 * len(expected) > 100
    assert np.array_equal(tee.panel_to_vertex[seams.tail], tee.panel_to_vertex[seams.twin_head])
    assert np.array_equal(tee.panel_to_vertex[seams.head], tee.panel_to_vertex[seams.twin_tail])
    for ends in (seams.tail, seams.head):
        assert len(np.unique(ends)) == len(ends)


def test_a_sheet_without_seams_has_none_and_keeps_its_metric(sheet_mesh: GarmentMesh) -> None:
    assert len(SeamEdges.of(sheet_mesh).tail) == 0
    metric = np.tile(uniform(1e-3), (len(sheet_mesh.panel_vertices), 1, 1))
    np.testing.assert_array_equal(agree_on_seams(sheet_mesh, metric), metric)
    plain = edge_lengths(sheet_mesh.panel_vertices, sheet_mesh.edges, metric)
    np.testing.assert_allclose(sewn_edge_lengths(sheet_mesh, metric), plain, rtol=1e-14)


def test_a_sewn_edge_is_as_long_as_on_its_longer_side(tee: GarmentMesh, field: Array) -> None:
    found = sewn_edge_lengths(tee, field)
    expected: dict[tuple[int, ...], float] = {}
    for face in tee.panel_faces:
        for a, b in zip(face, np.roll(face, -1), strict=True):
            size = edge_lengths(tee.panel_vertices, np.array([(a, b)]), field)[0]
            edge = tuple(sorted((int(tee.panel_to_vertex[a]), int(tee.panel_to_vertex[b]))))
            expected[edge] = max(size, expected.get(edge, 0.0))
    np.testing.assert_allclose(found, [expected[tuple(e)] for e in tee.edges.tolist()], rtol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1.1, 3.0])
def test_the_sides_of_a_straight_seam_agree_exactly(angle: float) -> None:
    mesh = cut(sheet("structured", 0.4, 0.3, 0.05), angle)
    root = np.random.default_rng(1).normal(size=(len(mesh.panel_vertices), 2, 2))
    metric = root @ root.transpose(0, 2, 1) + 0.1 * np.eye(2)
    here, there = along_both_sides(mesh, metric)
    assert np.abs(here / there - 1.0).max() > 0.1
    raised = agree_on_seams(mesh, metric)
    here, there = along_both_sides(mesh, raised)
    np.testing.assert_allclose(here, there, rtol=1e-12)


def test_agreement_adds_along_the_seam_and_nowhere_else(tee: GarmentMesh, field: Array) -> None:
    rise = agree_on_seams(tee, field) - field
    assert eigenvalues(rise)[:, 1].min() > -1e-10 * np.abs(field).max()
    seams = SeamEdges.of(tee)
    off = np.setdiff1d(np.arange(len(field)), np.concatenate([seams.tail, seams.head]))
    np.testing.assert_array_equal(rise[off], 0.0)
    first = ~np.isin(seams.tail, seams.head)  # a vertex of one seam edge
    t = (tee.panel_vertices[seams.head] - tee.panel_vertices[seams.tail])[first]
    added = rise[seams.tail[first]]
    assert len(added) > 3
    across = t @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    np.testing.assert_allclose(quadratic_form(added, across), 0.0, atol=1e-12)
    here = quadratic_form(field[seams.tail[first]], t) / (t * t).sum(axis=1)
    assert (quadratic_form(added, t) > 0.01 * here * (t * t).sum(axis=1)).any()


def test_the_sides_of_a_garment_s_seams_agree_but_for_their_bends(tee: GarmentMesh, field: Array) -> None:
    here, there = along_both_sides(tee, field)
    before = np.abs(np.log(here / there))
    here, there = along_both_sides(tee, agree_on_seams(tee, field))
    after = np.abs(np.log(here / there))
    assert np.median(before) > 0.3
    assert np.median(after) < 0.05
    assert after.mean() < 0.1 * before.mean()
    assert after.max() < 0.5


def test_the_sizing_of_a_garment_agrees_on_its_seams(tee: GarmentMesh) -> None:
    """A garment hung as a tube of folds, whose panels have nothing in common but their seams."""
    rng = np.random.default_rng(2)
    positions = rng.normal(scale=0.003, size=(tee.num_vertices, 3))
    positions[tee.panel_to_vertex, :2] += tee.panel_vertices
    positions[:, 2] += 0.03 * np.sin(40.0 * positions[:, 0])
    settings = RemeshSettings(0.3, 0.005)
    metric = sizing_field(tee, positions, settings)
    here, there = along_both_sides(tee, metric)
    assert np.percentile(np.abs(np.log(here / there)), 90) < 0.05
    larger = sewn_edge_lengths(tee, metric)
    assert np.isfinite(larger).all()
    assert larger.min() > 0.0


def test_a_seam_leaves_the_tensors_of_the_faces_as_in_the_uncut_sheet() -> None:
    """Normals come from the sewn mesh; gradients turn with the panel."""
    whole = sheet("structured", 0.4, 0.3, 0.05)
    sewn = cut(whole, 0.9)
    rng = np.random.default_rng(3)
    positions = np.column_stack([whole.panel_vertices, rng.normal(scale=0.01, size=whole.num_vertices)])
    settings = RemeshSettings(0.3, 0.005, 0.5, size_min=0.001)
    velocities = rng.normal(size=positions.shape)
    expected = face_sizing(whole, positions, settings, velocities)
    found = face_sizing(sewn, positions, settings, velocities)
    c, s = np.cos(0.9), np.sin(0.9)
    r = np.array([[c, -s], [s, c]])
    second = sewn.face_panel == 1
    np.testing.assert_allclose(found[~second], expected[~second], rtol=1e-9, atol=1e-7)
    np.testing.assert_allclose(found[second], r @ expected[second] @ r.T, rtol=1e-9, atol=1e-6)
