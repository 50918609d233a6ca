"""Curves of panels, found in meshes alone, against the patterns that the meshes were cut from."""

from itertools import pairwise

import numpy as np
import pytest

from muslin.eval.metrics.panel_curves import (
    arc_lengths,
    corresponding_chains,
    curve_distances,
    curve_length_errors,
    mismatched_seam_vertices,
    pattern_corners,
    pattern_curves,
    unsewn,
)
from muslin.garments.designs.tee import TEE
from muslin.garments.mesh import GarmentMesh
from muslin.garments.seams import EdgeRef
from muslin.garments.triangulate import triangulate

PATTERN = TEE.pattern(**TEE.preset("tshirt"))


@pytest.fixture(scope="module")
def tee() -> GarmentMesh:
    return triangulate(PATTERN, 0.04)


def strip(left: np.ndarray, right: np.ndarray, sewn: bool = False) -> GarmentMesh:
    """Two panels beside each other, [0, 1]^2 and [2, 3] x [0, 1], with vertices at the heights `left` along
    the right side of the first and `right` along the left side of the second, `sewn` if these are equal."""
    points, faces, panels = [], [], []
    for k, (heights, far, near) in enumerate(((left, 0.0, 1.0), (right, 3.0, 2.0))):
        start, n = sum(len(p) for p in points), len(heights)
        points.append(np.array([[far, 0.0], [far, 1.0], *([near, h] for h in heights)]))
        fan = [[0, 2 + i, 3 + i] for i in range(n - 1)] + [[0, n + 1, 1]]
        made = start + np.array(fan)
        faces.append(made if k == 0 else made[:, ::-1])
        panels += [k] * len(fan)
    vertices, triangles = np.concatenate(points), np.concatenate(faces).astype(np.int32)
    sewn_vertex = np.arange(len(vertices), dtype=np.int32)
    if sewn:
        first = len(points[0])
        sewn_vertex[first + 2 :] = np.arange(2, first)
        sewn_vertex[first : first + 2] = [first, first + 1]
    return GarmentMesh(
        faces=sewn_vertex[triangles],
        panel_faces=triangles,
        panel_vertices=vertices,
        panel_to_vertex=sewn_vertex,
        face_panel=np.array(panels, dtype=np.int32),
        panel_names=("first", "second"),
        uv=vertices / 3.0,
        name="strip",
        parameters={},
    )


def disc(n: int) -> GarmentMesh:
    """A fan of n triangles in the unit circle."""
    turn = 2.0 * np.pi * np.arange(n) / n
    vertices = np.concatenate([np.stack([np.cos(turn), np.sin(turn)], axis=1), np.zeros((1, 2))])
    i = np.arange(n, dtype=np.int32)
    faces = np.stack([np.full(n, n, dtype=np.int32), i, (i + 1) % n], axis=1).astype(np.int32)
    return GarmentMesh(
        faces=faces,
        panel_faces=faces,
        panel_vertices=vertices,
        panel_to_vertex=np.arange(n + 1, dtype=np.int32),
        face_panel=np.zeros(n, dtype=np.int32),
        panel_names=("disc",),
        uv=0.5 * (vertices + 1.0),
        name="disc",
        parameters={},
    )


def test_curves_of_a_tee_are_the_edges_of_its_pattern(tee: GarmentMesh):
    curves = pattern_curves(tee)
    found = {}
    for number, chain in enumerate(curves.chains):
        panel = PATTERN.panels[tee.panel_vertex_panel[chain[0]]]
        ends = tee.panel_vertices[chain[[0, -1]]]
        (edge,) = [e for e in panel.edges if np.allclose([e.curve.start, e.curve.end], ends, atol=1e-9)]
        found[number] = EdgeRef(panel.name, edge.name)
        length = arc_lengths(tee.panel_vertices, chain)[-1]
        # A polyline between points of the curve is shorter, by a share (h / R)^2 / 24 at most.
        assert 0.97 * edge.curve.length <= length <= edge.curve.length + 1e-9
    assert len(set(found.values())) == sum(len(panel.edges) for panel in PATTERN.panels)
    seams = {frozenset((seam.first, seam.second)) for seam in PATTERN.seams}
    assert seams == {frozenset((found[k], found[p])) for k, p in enumerate(curves.partner) if p >= 0}
    assert {found[k] for k, p in enumerate(curves.partner) if p < 0} == set(PATTERN.free_edges)


def test_a_mesh_keeps_its_own_curves(tee: GarmentMesh):
    curves = pattern_curves(tee)
    for mesh in (tee, unsewn(tee)):
        for chain, own in zip(corresponding_chains(mesh, tee, curves), curves.chains, strict=True):
            np.testing.assert_array_equal(chain, own)
        assert curve_length_errors(mesh, tee).max() == 0.0
        assert curve_distances(mesh, tee).max() == 0.0
        assert mismatched_seam_vertices(mesh, tee) == 0


def test_another_sampling_keeps_seams_matched(tee: GarmentMesh):
    finer = triangulate(PATTERN, 0.02)
    assert mismatched_seam_vertices(finer, tee) == 0
    assert 0.0 < curve_length_errors(finer, tee).max() < 0.02


def test_a_circle_without_corners_is_one_curve():
    source, mesh = disc(64), disc(8)
    assert not pattern_corners(source).any()
    assert [len(chain) for chain in pattern_curves(source).chains] == [65]
    expected = 1.0 - 8.0 * np.sin(np.pi / 8.0) / (64.0 * np.sin(np.pi / 64.0))
    assert curve_length_errors(mesh, source) == pytest.approx(expected)
    # The source's vertex over the middle of a chord is its sagitta away.
    assert curve_distances(mesh, source) == pytest.approx(1.0 - np.cos(np.pi / 8.0))
    assert not pattern_corners(disc(8)).any()
    assert pattern_corners(disc(5)).sum() == 5


def test_the_end_of_a_dart_is_a_corner():
    # A hexagon round its centre, one triangle cut out and its two sides sewn together.
    mesh = disc(6)
    faces = np.delete(mesh.panel_faces, 5, axis=0)
    panel_to_vertex = np.array([0, 1, 2, 3, 4, 0, 5], dtype=np.int32)
    dart = GarmentMesh(
        faces=panel_to_vertex[faces],
        panel_faces=faces,
        panel_vertices=mesh.panel_vertices,
        panel_to_vertex=panel_to_vertex,
        face_panel=np.zeros(5, dtype=np.int32),
        panel_names=("dart",),
        uv=mesh.uv,
        name="dart",
        parameters={},
    )
    dart.validate()
    curves = pattern_curves(dart)
    ends = {(int(chain[0]), int(chain[-1])): k for k, chain in enumerate(curves.chains)}
    assert curves.partner[ends[5, 6]] == ends[6, 0]
    assert curves.partner[ends[6, 0]] == ends[5, 6]
    assert all(curves.partner[k] == -1 for pair, k in ends.items() if 6 not in pair)


def test_mismatched_seam_vertices_are_counted_on_both_sides():
    even = np.linspace(0.0, 1.0, 5)
    source = strip(even, even, sewn=True)
    source.validate()
    seam = [k for k, partner in enumerate(pattern_curves(source).partner) if partner >= 0]
    assert len(seam) == 2
    finer = np.linspace(0.0, 1.0, 9)
    assert mismatched_seam_vertices(strip(finer, finer), source) == 0
    assert mismatched_seam_vertices(strip(finer, even), source) == 4
    assert mismatched_seam_vertices(strip(even, finer), source) == 4
    moved = even + np.array([0.0, 0.1, 0.0, 0.02, 0.0])  # 0.4 and 0.08 of an edge
    assert mismatched_seam_vertices(strip(moved, even), source) == 2


def test_a_curve_on_a_boundary_of_its_own_is_missing():
    whole = strip(np.linspace(0.0, 1.0, 5), np.linspace(0.0, 1.0, 5))
    # Without its third triangle, the first panel falls apart but for one vertex.
    torn = np.delete(np.arange(len(whole.panel_faces)), 2)
    faces = whole.panel_faces[torn].copy()
    vertices = np.concatenate([whole.panel_vertices, whole.panel_vertices[:1]])
    faces[[2, 3], 0] = len(vertices) - 1
    mesh = GarmentMesh(
        faces=faces,
        panel_faces=faces,
        panel_vertices=vertices,
        panel_to_vertex=np.arange(len(vertices), dtype=np.int32),
        face_panel=whole.face_panel[torn],
        panel_names=whole.panel_names,
        uv=vertices / 3.0,
        name="torn",
        parameters={},
    )
    errors = curve_length_errors(mesh, whole)
    curves = pattern_curves(whole)
    (side,) = [k for k, c in enumerate(curves.chains) if set(whole.panel_vertices[c][:, 0]) == {1.0}]
    assert errors[side] == np.inf
    assert np.isfinite(np.delete(errors, side)).sum() >= 5


def test_distances_of_curves_against_points_all_along_them(tee: GarmentMesh):
    mesh = triangulate(PATTERN, 0.025)
    curves = pattern_curves(tee)
    found = curve_distances(mesh, tee)
    for k, chain in enumerate(corresponding_chains(mesh, tee, curves)):
        pair = mesh.panel_vertices[chain], tee.panel_vertices[curves.chains[k]]
        fine = [np.concatenate([np.linspace(p, q, 200) for p, q in pairwise(line)]) for line in pair]
        largest = max(
            np.linalg.norm(line[:, None] - other, axis=2).min(axis=1).max()
            for line, other in ((pair[0], fine[1]), (pair[1], fine[0]))
        )
        # The nearest point of a line is at most half the spacing of its points away from one of them.
        half = 0.5 * max(np.linalg.norm(np.diff(line, axis=0), axis=1).max() for line in fine)
        assert found[k] <= largest <= np.hypot(found[k], half) + 1e-12


def test_lengths_along_a_chain():
    points = np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 5.0]])
    assert arc_lengths(points, np.array([0, 1, 2], dtype=np.int32)).tolist() == [0.0, 5.0, 6.0]
