"""Single splits, flips and collapses against lists of triangles changed by hand, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from muslin.garments.merge import merge_meshes
from muslin.garments.mesh import GarmentMesh
from muslin.sim.elastic import principal_stretches
from muslin.sim.remesh.metric import edge_lengths
from muslin.sim.remesh.panel_mesh import DEAD
from muslin.sim.remesh.sewn_mesh import PINNED, GarmentState
from tests.sim.meshes import sheet
from tests.sim.remesh.draped import NOBODY, Draped, at_vertices, flat_sheet, sewn_dart, waved_tube
from tests.sim.remesh.panels import one_panel, tube
from tests.sim.remesh.single import Table, canonical
from tests.sim.remesh.tables import check_sewn

Array = NDArray[np.float64]
Face = tuple[int, ...]


def coarse(mesh: GarmentMesh) -> Array:
    """A metric in which all edges are short."""
    return np.tile(np.eye(2), (len(mesh.panel_vertices), 1, 1))


def table_of(draped: Draped, metric: Array | None = None, seed: int = 0) -> tuple[Table, GarmentState]:
    state = draped.state(seed)
    return Table(state, coarse(draped.mesh) if metric is None else metric, draped.body), state


def faces_of(mesh: GarmentMesh) -> set[Face]:
    return {canonical(face) for face in mesh.panel_faces.tolist()}


def other_side(mesh: GarmentMesh, a: int, b: int) -> tuple[int, int] | None:
    """The boundary edge that is sewn to a-b, in the direction of a-b, if there is one."""
    vertex = mesh.panel_to_vertex
    for c, d in mesh.panel_boundary_edges.tolist():
        if vertex[d] == vertex[a] and vertex[c] == vertex[b] and (d, c) != (a, b):
            return d, c
    return None


def split_faces(faces: set[Face], a: int, b: int, m: int) -> set[Face]:
    """Triangles with m put on the edge a-b."""
    made = set()
    for face in faces:
        if {a, b} <= set(face):
            made |= {canonical([m if v == end else v for v in face]) for end in (a, b)}
        else:
            made.add(face)
    return made


def collapse_faces(faces: set[Face], gone: int, kept: int) -> set[Face]:
    """Triangles with `kept` in place of `gone`, those with both left out."""
    return {
        canonical([kept if v == gone else v for v in face]) for face in faces if not {gone, kept} <= set(face)
    }


def momentum(table: Table) -> Array:
    alive = table.mesh.copy.numpy() >= 0
    return table.mesh.area.numpy()[alive] @ table.mesh.v.numpy()[alive]


CASES = {"tube": waved_tube, "dart": sewn_dart, "sheet": flat_sheet}


@pytest.mark.parametrize("name", CASES)
def test_splits_put_a_vertex_in_the_middle_and_change_nothing_else(name: str) -> None:
    draped = CASES[name](0)
    mesh = draped.mesh
    rng = np.random.default_rng(1)
    edges = np.concatenate([mesh.panel_boundary_edges, mesh.panel_faces[:, :2]])
    for a, b in edges[rng.choice(len(edges), 25, replace=False)].tolist():
        table, state = table_of(draped)
        moving = momentum(table)
        size_p, size_v = len(mesh.panel_vertices), mesh.num_vertices
        assert table.split(a, b)
        check_sewn(table.mesh)
        expected = split_faces(faces_of(mesh), a, b, size_p)
        mate = other_side(mesh, a, b) if [a, b] in mesh.panel_boundary_edges.tolist() else None
        if mate is not None:
            expected = split_faces(expected, *mate, size_p + 1)
        assert table.faces() == expected
        for m, ends in enumerate([(a, b)] if mate is None else [(a, b), mate]):
            point, uv = (array.numpy()[size_p + m] for array in (table.mesh.panels.point, table.mesh.uv))
            np.testing.assert_allclose(point, mesh.panel_vertices[list(ends)].mean(axis=0), atol=1e-16)
            np.testing.assert_allclose(uv, mesh.uv[list(ends)].mean(axis=0), atol=1e-16)
            assert table.mesh.vertex.numpy()[size_p + m] == size_v
        ends_v = mesh.panel_to_vertex[[a, b]]
        for array, given in (
            (table.mesh.x, state.positions),
            (table.mesh.v, state.velocities),
            (table.mesh.held, state.held),
        ):
            np.testing.assert_array_equal(array.numpy()[:size_v], given)
            np.testing.assert_allclose(array.numpy()[size_v], given[ends_v].mean(axis=0), atol=1e-16)
        np.testing.assert_allclose(momentum(table), moving, atol=1e-15)


def illegal_by_angles(points: Array, metric: Array, a: int, b: int, c: int, d: int) -> bool:
    """Whether the angles at c and d, seen in the mean metric of the four, sum to more than pi."""
    root = np.linalg.cholesky(metric[[a, b, c, d]].mean(axis=0))
    angles = 0.0
    for tip in (c, d):
        u, v = (root.T @ (points[end] - points[tip]) for end in (a, b))
        angles += np.arccos(u @ v / (np.linalg.norm(u) * np.linalg.norm(v)))
    return angles > np.pi + 1e-7


def is_convex(points: Array, a: int, b: int, c: int, d: int) -> bool:
    def doubled(p: int, q: int, r: int) -> float:
        u, v = points[q] - points[p], points[r] - points[p]
        return float(u[0] * v[1] - u[1] * v[0])

    return doubled(d, c, a) > 0.0 and doubled(c, d, b) > 0.0


def test_flips_are_those_that_the_angles_ask_for() -> None:
    draped = flat_sheet(3)
    mesh = draped.mesh
    stretched = np.tile(np.diag([8.0**2, 24.0**2]), (len(mesh.panel_vertices), 1, 1))
    faces = faces_of(mesh)
    directed = {(f[k], f[(k + 1) % 3]): f[(k + 2) % 3] for f in faces for k in range(3)}
    flipped = 0
    for (a, b), c in directed.items():
        if a > b or (b, a) not in directed:
            continue
        d = directed[b, a]
        table, state = table_of(draped, stretched)
        moving = momentum(table)
        size_ab, size_cd = edge_lengths(mesh.panel_vertices, np.array([[a, b], [c, d]]), stretched)
        points = mesh.panel_vertices
        wanted = illegal_by_angles(points, stretched, a, b, c, d) and is_convex(points, a, b, c, d)
        wanted = wanted and size_cd <= max(1.0, size_ab)
        assert table.flip(a, b) == wanted
        if wanted:
            flipped += 1
            check_sewn(table.mesh)
            changed = {canonical([a, b, c]), canonical([b, a, d])}
            assert table.faces() == faces - changed | {canonical([d, c, a]), canonical([c, d, b])}
            np.testing.assert_array_equal(table.mesh.x.numpy()[: mesh.num_vertices], state.positions)
            np.testing.assert_allclose(momentum(table), moving, atol=1e-15)
            # What the change of masses took away, the four give back alike; nobody else notices.
            gain = table.mesh.v.numpy()[: mesh.num_vertices] - state.velocities
            others = np.setdiff1d(np.arange(mesh.num_vertices), [a, b, c, d])
            assert (gain[others] == 0.0).all()
            np.testing.assert_allclose(gain[[a, b, c]], gain[[d, d, d]], atol=1e-15)
    assert 20 < flipped < len(directed) // 2 - 20


def collapse_is_allowed(mesh: GarmentMesh, metric: Array, gone: int, kept: int) -> bool:
    """On a flat sheet without seams: by lists of triangles."""
    faces, points = faces_of(mesh), mesh.panel_vertices
    around = [face for face in faces if gone in face]
    boundary = mesh.panel_boundary_edges
    rim = set(boundary.ravel().tolist())
    shared = [face for face in around if kept in face]
    if gone in rim:
        ends = [set(edge) - {gone} for edge in boundary.tolist() if gone in edge]
        if {kept} not in ends:
            return False
        (p,), (q,) = ends
        u, v = points[p] - points[gone], points[q] - points[gone]
        if u @ v > -(1.0 - 1e-12) * np.linalg.norm(u) * np.linalg.norm(v):
            return False
    if gone not in rim and len(shared) != 2:
        return False
    opposite = {v for face in shared for v in face} - {gone, kept}
    ring, other = ({v for f in faces if end in f for v in f} - {gone, kept} for end in (gone, kept))
    if ring & other != opposite:
        return False
    made = collapse_faces(faces, gone, kept)
    if {v for face in made for v in face} != set(range(len(points))) - {gone}:
        return False
    edges = np.array([[kept, v] for v in ring])
    if (edge_lengths(points, edges, metric) > 0.9).any():
        return False
    for face in made - faces:
        a, b, c = points[list(face)]
        m = metric[list(face)].mean(axis=0)
        u, v, w = b - a, c - b, a - c
        doubled = u[0] * -w[1] - u[1] * -w[0]
        lengths = sum(e @ m @ e for e in (u, v, w))
        if 2.0 * np.sqrt(3.0 * np.linalg.det(m)) * doubled / lengths <= 0.05:
            return False
    return True


def test_collapses_are_those_that_lists_of_triangles_allow() -> None:
    draped = flat_sheet(5)
    mesh = draped.mesh
    metric = np.tile(np.diag([14.0**2, 11.0**2]), (len(mesh.panel_vertices), 1, 1))
    done = asked = 0
    for face in mesh.panel_faces[::3].tolist():
        for a, b in zip(face, [*face[1:], face[0]], strict=True):
            for gone, kept in ((a, b), (b, a)):
                table, state = table_of(draped, metric)
                moving = momentum(table)
                allowed = collapse_is_allowed(mesh, metric, gone, kept)
                asked += 1
                assert table.collapse(a, b, gone) == allowed
                if allowed:
                    done += 1
                    assert table.faces() == collapse_faces(faces_of(mesh), gone, kept)
                    np.testing.assert_allclose(momentum(table), moving, atol=1e-15)
                    if done % 10 == 0:
                        check_sewn(table.mesh)
                    others = np.setdiff1d(np.arange(mesh.num_vertices), [gone, kept])
                    velocities = table.mesh.v.numpy()[: mesh.num_vertices]
                    np.testing.assert_array_equal(velocities[others], state.velocities[others])
    assert 30 < done < asked - 30


@pytest.mark.parametrize("name", ["tube", "dart"])
def test_collapses_on_a_seam_take_both_sides_along(name: str) -> None:
    """All lies in one place, where nothing turns or crosses. The ends of seams stay; next to the tip of the
    dart three of its vertices would lie on a line."""
    draped = replace(CASES[name](0), positions=np.zeros((CASES[name](0).mesh.num_vertices, 3)))
    mesh = draped.mesh
    vertex = mesh.panel_to_vertex
    fixed = set(mesh.boundary_edges.ravel().tolist())
    tip = 0 if name == "dart" else -1
    done = 0
    for a, b in mesh.panel_boundary_edges.tolist():
        mate = other_side(mesh, a, b)
        if mate is None:
            continue
        for gone, kept, gone2, kept2 in ((a, b, *mate), (b, a, *mate[::-1])):
            table, _ = table_of(draped)
            moving = momentum(table)
            allowed = vertex[gone] not in fixed and tip not in (gone, kept)
            assert table.collapse(a, b, gone) == allowed
            if allowed:
                done += 1
                check_sewn(table.mesh)
                expected = collapse_faces(faces_of(mesh), gone, kept)
                assert table.faces() == collapse_faces(expected, gone2, kept2)
                np.testing.assert_allclose(momentum(table), moving, atol=1e-15)
    assert done >= 30


def test_seams_within_a_panel_are_made_coarser() -> None:
    """What lies beyond the seam of a tube is next to a triangle there, however far it is in panel space."""
    draped = waved_tube(0)
    found = 0
    for a, b in draped.mesh.panel_boundary_edges.tolist():
        if other_side(draped.mesh, a, b) is not None:
            table, _ = table_of(draped)
            found += table.collapse(a, b, a)
    assert found >= 10


def test_what_is_locked_stays() -> None:
    draped = flat_sheet(5)
    state = draped.state()
    a, b = next(edge for edge in draped.mesh.edges.tolist() if not set(edge) & rim_of(draped.mesh))
    for lock, expected in ((0, True), (1, False), (int(PINNED), False)):
        locked = state.locked.copy()
        locked[a] = lock
        table = Table(replace(state, locked=locked), coarse(draped.mesh), NOBODY)
        assert table.collapse(a, b, a) == expected


def rim_of(mesh: GarmentMesh) -> set[int]:
    return set(mesh.panel_boundary_edges.ravel().tolist())


def test_a_collapse_that_would_close_a_tube_is_refused() -> None:
    """Three columns: those beside the seam are joined to each other and to the seam already. All lies in one
    place, where nothing turns or crosses, and only connectivity can speak against it."""
    for around, expected in ((3, False), (4, True)):
        mesh = tube(0.3, 0.4, around, 4)
        state = Draped(mesh, np.zeros((mesh.num_vertices, 3))).state()
        beside, seam = 5 + 2, 2
        assert Table(state, coarse(mesh), NOBODY).collapse(seam, beside, beside) == expected


def bump(width: float, count: int, height: float) -> Draped:
    """A square with one vertex in the middle raised."""
    mesh = sheet("alternating", width, width, width / count)
    centre = int(np.argmin(np.linalg.norm(mesh.panel_vertices - mesh.panel_vertices.mean(axis=0), axis=1)))
    positions = at_vertices(mesh, lambda p: np.stack([p[:, 0], np.zeros(len(p)), -p[:, 1]], axis=1))
    positions[centre, 1] = height
    return Draped(mesh, positions)


def neighbours(mesh: GarmentMesh, v: int) -> list[int]:
    return sorted({int(w) for face in mesh.panel_faces if v in face for w in face} - {v})


def collapsible(state: GarmentState, gone: int, body: tuple[Array, NDArray[np.int32]] = NOBODY) -> bool:
    """Whether a vertex may go onto any of its neighbours."""
    found = False
    for kept in neighbours(state.mesh, gone):
        faces = state.mesh.panel_faces
        forward = any((f == gone).any() and f[(np.argmax(f == gone) + 1) % 3] == kept for f in faces)
        a, b = (gone, kept) if forward else (kept, gone)
        found |= Table(state, coarse(state.mesh), body).collapse(a, b, gone)
    return found


@pytest.mark.parametrize(("gap", "expected"), [(1e-3, False), (0.08, True)])
def test_a_collapse_through_another_layer_is_refused(gap: float, expected: bool) -> None:
    """Two bumps, one over the other: without its tip the upper one would cut the lower one off."""
    upper = bump(0.4, 8, 0.005)
    peak = int(upper.positions[:, 1].argmax())
    assert collapsible(upper.state(), peak)
    both = merge_meshes(["upper", "lower"], [upper.mesh, upper.mesh])
    positions = np.concatenate([upper.positions, upper.positions - [0.0, gap, 0.0]])
    assert collapsible(Draped(both, positions).state(), peak) == expected


def test_a_collapse_onto_a_body_is_refused() -> None:
    """A tent over a tip that reaches higher than its floor."""
    tent = bump(0.4, 8, 0.005)
    peak = int(tent.positions[:, 1].argmax())
    foot = tent.positions[peak] * [1.0, 0.0, 1.0]
    for tip, expected in ((0.003, False), (-0.003, True)):
        assert collapsible(tent.state(), peak, spike(foot, tip)) == expected


def spike(foot: Array, tip: float) -> tuple[Array, NDArray[np.int32]]:
    """A slender pyramid that stands 5 cm below `foot` and reaches `tip` metres above it."""
    base = [[-0.002, -0.05, -0.002], [0.002, -0.05, -0.002], [0.0, -0.05, 0.002], [0.0, tip, 0.0]]
    return foot + np.array(base), np.array([[0, 1, 2], [1, 0, 3], [2, 1, 3], [0, 2, 3]], np.int32)


def square(lift: float) -> Draped:
    """Two triangles whose longer diagonal is their edge, folded along it, its ends higher by `lift`."""
    points = np.array([[-0.05, 0.0], [0.0, -0.02], [0.05, 0.0], [0.0, 0.02]])
    mesh = one_panel(points, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    height = np.array([lift, 0.0, lift, 0.0])
    return Draped(mesh, np.stack([points[:, 0], height, -points[:, 1]], axis=1))


def test_a_flip_that_would_pierce_a_tip_is_refused() -> None:
    """The ridge of a roof; a tip under it is where the diagonal across it would be."""
    roof = square(0.005)
    for tip, expected in ((0.003, False), (-0.002, True)):
        table = Table(roof.state(), coarse(roof.mesh), spike(np.zeros(3), tip))
        assert table.flip(2, 0) == expected


def test_a_flip_that_folds_cloth_over_is_refused() -> None:
    for lift, expected in ((0.005, True), (0.12, False)):
        roof = square(lift)
        assert Table(roof.state(), coarse(roof.mesh), NOBODY).flip(2, 0) == expected


@pytest.mark.parametrize(("slope", "expected"), [(30.0, True), (65.0, False)])
def test_a_flip_that_stretches_is_refused(slope: float, expected: bool) -> None:
    """A roof without strain. The faces across its ridge lie lower in the middle and are longer by
    sqrt(1 + (2/5)^2 sin^2 slope): 1.02 and 1.06."""
    roof = square(0.0)
    width = np.array([0.0, 0.02, 0.0, -0.02])
    angle = np.radians(slope)
    positions = np.stack([roof.positions[:, 0], -np.abs(width) * np.sin(angle), width * np.cos(angle)], 1)
    assert principal_stretches(roof.mesh, positions) == pytest.approx(1.0)
    table = Table(replace(roof.state(), positions=positions), coarse(roof.mesh), NOBODY)
    assert table.flip(2, 0) == expected


def test_dead_faces_are_marked() -> None:
    """What `faces` leaves out is what was removed."""
    draped = flat_sheet(5)
    table, _ = table_of(draped)
    a, b = next(edge for edge in draped.mesh.edges.tolist() if not set(edge) & rim_of(draped.mesh))
    assert table.collapse(a, b, a)
    corners = table.mesh.panels.corner.numpy()[: 3 * len(draped.mesh.faces)]
    assert (corners == int(DEAD)).sum() == 6
