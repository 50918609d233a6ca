"""Triangulation: area, angles, topology of the sewn mesh, matched seams, determinism, refusals."""

from __future__ import annotations

import numpy as np
import pytest

from muslin.garments import catalogue
from muslin.garments.curves import Line
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh, corner_angles, signed_areas
from muslin.garments.panels import Panel, PanelEdge
from muslin.garments.pattern import Pattern
from muslin.garments.planar import contains, triangulate_polygon
from muslin.garments.sampling import BoundarySampling
from muslin.garments.seams import EdgeRef, Seam
from muslin.garments.triangulate import triangulate

TEE = catalogue.get("tee")
CASES = [*((name, 0.04) for name in TEE.presets), ("tshirt", 0.02)]


@pytest.fixture(scope="module", params=CASES, ids=lambda case: f"{case[0]}-{case[1]}")
def case(request: pytest.FixtureRequest) -> tuple[Pattern, float, GarmentMesh]:
    name, edge_length = request.param
    pattern = TEE.pattern(**TEE.preset(name))
    return pattern, edge_length, triangulate(pattern, edge_length)


def test_panels_have_the_area_of_the_pattern(case: tuple[Pattern, float, GarmentMesh]) -> None:
    pattern, edge_length, mesh = case
    for index, panel in enumerate(pattern.panels):
        area = mesh.face_areas[mesh.face_panel == index].sum()
        # A chord of length h on a curve of radius R cuts off h^3 / 12 R; over a boundary this is O(h^2).
        assert area == pytest.approx(panel.area, rel=8.0 * edge_length**2)


def test_triangles_are_well_shaped(case: tuple[Pattern, float, GarmentMesh]) -> None:
    _, edge_length, mesh = case
    angles = np.degrees(corner_angles(mesh.panel_vertices, mesh.panel_faces))
    assert angles.min() >= 20.0
    assert angles.max() <= 125.0
    assert np.median(angles.min(axis=1)) > 48.0
    ends = mesh.panel_vertices[mesh.panel_faces]
    lengths = np.linalg.norm(ends - np.roll(ends, 1, axis=1), axis=2)
    assert lengths.mean() == pytest.approx(edge_length, rel=0.08)
    assert lengths.min() > 0.45 * edge_length
    assert lengths.max() < 1.8 * edge_length


def test_sewn_mesh_is_a_sphere_with_four_holes(case: tuple[Pattern, float, GarmentMesh]) -> None:
    """Neck, hem and two cuffs: Euler characteristic 2 - 4, four boundary loops of the right lengths."""
    pattern, _, mesh = case
    assert mesh.euler_characteristic == -2
    assert len(mesh.boundary_loops) == 4
    rest = np.zeros((mesh.num_vertices, 2))
    rest[mesh.panel_to_vertex] = mesh.panel_vertices
    edge_of = {}
    for a, b in zip(mesh.panel_faces.ravel(), np.roll(mesh.panel_faces, -1, axis=1).ravel(), strict=True):
        edge_of[mesh.panel_to_vertex[a], mesh.panel_to_vertex[b]] = (
            mesh.panel_vertices[b] - mesh.panel_vertices[a]
        )
    found = sorted(
        sum(np.linalg.norm(edge_of[a, b]) for a, b in zip(loop, np.roll(loop, -1), strict=True))
        for loop in mesh.boundary_loops
    )
    expected = sorted(
        sum(pattern.panel(panel).edge(edge).curve.length for panel, edge in loop)
        for loop in (
            [("front", "neck"), ("back", "neck")],
            [("front", "hem"), ("back", "hem")],
            [("sleeve_left", "cuff")],
            [("sleeve_right", "cuff")],
        )
    )
    np.testing.assert_allclose(found, expected, rtol=0.03)


def test_valences_are_sensible(case: tuple[Pattern, float, GarmentMesh]) -> None:
    _, _, mesh = case
    valence = np.bincount(mesh.edges.ravel())
    inner = np.setdiff1d(np.arange(mesh.num_vertices), np.concatenate(mesh.boundary_loops))
    assert valence[inner].min() >= 4
    assert valence.max() <= 10
    assert valence.min() >= 3


def test_seam_vertices_match_in_arc_length(case: tuple[Pattern, float, GarmentMesh]) -> None:
    """Both sides of a seam have edges of equal length, and corners join all panels that meet there."""
    _, _, mesh = case
    half = np.concatenate([mesh.panel_faces[:, [k, (k + 1) % 3]] for k in range(3)])
    lengths: dict[tuple[int, int], list[float]] = {}
    for a, b in half:
        u, v = sorted((int(mesh.panel_to_vertex[a]), int(mesh.panel_to_vertex[b])))
        lengths.setdefault((u, v), []).append(
            float(np.linalg.norm(mesh.panel_vertices[a] - mesh.panel_vertices[b]))
        )
    ratio = [max(pair) / min(pair) for pair in lengths.values() if len(pair) == 2]
    # Equal arcs, but the chord of the more curved side is a little shorter.
    assert max(ratio) < 1.06
    panels = np.zeros((mesh.num_vertices, len(mesh.panel_names)), dtype=int)
    np.add.at(panels, (mesh.panel_to_vertex, mesh.panel_vertex_panel), 1)
    assert panels.sum(axis=1).max() == 4
    for sleeve in ("sleeve_left", "sleeve_right"):
        k = mesh.panel_names.index(sleeve)
        underarm = np.flatnonzero((panels[:, :2] == 1).all(axis=1) & (panels[:, k] == 2))
        tip = np.flatnonzero((panels[:, :2] == 1).all(axis=1) & (panels[:, k] == 1))
        assert len(underarm) == 1
        assert len(tip) == 1


def test_uv_lies_in_the_unit_square_without_flips_or_overlap(
    case: tuple[Pattern, float, GarmentMesh],
) -> None:
    _, _, mesh = case
    assert mesh.uv.min() >= 0.0
    assert mesh.uv.max() <= 1.0
    assert (signed_areas(mesh.uv, mesh.panel_faces) > 0.0).all()
    boxes = [
        (mesh.uv[mesh.panel_vertex_panel == k].min(axis=0), mesh.uv[mesh.panel_vertex_panel == k].max(axis=0))
        for k in range(len(mesh.panel_names))
    ]
    for i, (low, high) in enumerate(boxes):
        for other_low, other_high in boxes[i + 1 :]:
            assert (high < other_low).any() or (other_high < low).any()


def test_same_seed_same_bytes_other_seed_other_mesh() -> None:
    pattern = TEE.pattern()
    first, again, other = (
        triangulate(pattern, 0.05),
        triangulate(pattern, 0.05),
        triangulate(pattern, 0.05, seed=1),
    )
    assert first.panel_vertices.tobytes() == again.panel_vertices.tobytes()
    assert first.faces.tobytes() == again.faces.tobytes()
    assert not np.array_equal(first.panel_vertices[: len(other.panel_vertices)], other.panel_vertices)
    assert np.degrees(corner_angles(other.panel_vertices, other.panel_faces)).min() > 20.0


@pytest.mark.parametrize("seed", range(4))
def test_random_members_triangulate(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pattern = TEE.pattern(**{p.name: rng.uniform(p.low, p.high) for p in TEE.parameters.values()})
    mesh = triangulate(pattern, 0.04, seed)
    assert mesh.euler_characteristic == -2
    assert np.degrees(corner_angles(mesh.panel_vertices, mesh.panel_faces)).min() > 20.0


def tube(width: float, height: float) -> Pattern:
    names = ("bottom", "right", "top", "left")
    corners = ((0.0, 0.0), (width, 0.0), (width, height), (0.0, height))
    edges = tuple(PanelEdge(name, Line(corners[i], corners[(i + 1) % 4])) for i, name in enumerate(names))
    seam = Seam(EdgeRef("wrap", "left"), EdgeRef("wrap", "right"))
    return Pattern("tube", (Panel("wrap", edges),), (seam,))


def test_panel_sewn_to_itself_is_a_cylinder() -> None:
    mesh = triangulate(tube(0.6, 0.3), 0.05)
    assert mesh.euler_characteristic == 0
    assert len(mesh.boundary_loops) == 2
    assert mesh.face_areas.sum() == pytest.approx(0.18, abs=1e-12)
    assert mesh.vertex_areas.sum() == pytest.approx(0.18, abs=1e-12)


@pytest.mark.parametrize("edge_length", [0.0, -0.01, float("nan"), float("inf")])
def test_wrong_edge_lengths_are_refused(edge_length: float) -> None:
    with pytest.raises(InputError, match="greater than zero"):
        triangulate(TEE.pattern(), edge_length)


def test_too_coarse_an_edge_length_is_refused() -> None:
    with pytest.raises(InputError, match=r"smaller edge length|not manifold|names a vertex twice"):
        triangulate(tube(0.1, 0.3), 0.5)


def test_unsound_pattern_is_refused() -> None:
    short = tube(0.6, 0.3)
    seam = Seam(EdgeRef("wrap", "left"), EdgeRef("wrap", "top"))
    with pytest.raises(InputError, match=r"seam edges do not match: wrap\.left is 0\.3"):
        triangulate(Pattern("bad", short.panels, (seam,)), 0.05)


def test_sampling_pairs_every_seam_vertex() -> None:
    pattern = TEE.pattern()
    sampling = BoundarySampling.of(pattern, 0.03)
    group, vertices = sampling.sewn(pattern), sampling.edge_vertices(pattern)
    for seam in pattern.seams:
        np.testing.assert_array_equal(group[vertices[seam.first]], group[vertices[seam.second][::-1]])
    for panel in pattern.panels:
        assert len(sampling.points(pattern, panel.name)) == sum(
            sampling.segments[EdgeRef(panel.name, edge.name)] for edge in panel.edges
        )


def test_concave_polygon_is_filled_exactly() -> None:
    corners = np.array([[0, 0], [3, 0], [3, 1], [1, 1], [1, 3], [0, 3]], dtype=float)
    steps = np.arange(10)[:, None] / 10.0
    boundary = np.concatenate(
        [a + steps * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    )
    points, faces = triangulate_polygon(boundary, 0.2, np.random.default_rng(0), "L")
    assert signed_areas(points, faces).sum() == pytest.approx(5.0, abs=1e-12)
    np.testing.assert_array_equal(points[: len(boundary)], boundary)
    # Euler: a disc with n points, b of them on the boundary, has 2 n - b - 2 triangles.
    assert len(faces) == 2 * len(points) - len(boundary) - 2
    probes = np.array([[0.5, 0.5], [2.0, 2.0], [0.5, 2.9], [3.5, 0.5]])
    np.testing.assert_array_equal(contains(corners, probes), [True, False, True, False])
