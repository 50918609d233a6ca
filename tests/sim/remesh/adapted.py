"""What has to hold of a garment after it was remeshed in motion, whatever was done to it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from muslin.garments.mesh import GarmentMesh, signed_areas
from muslin.sim.dataset.intersections import count_intersections
from muslin.sim.remesh import adapt as adapting
from muslin.sim.remesh.adapt import Changes, adapt
from muslin.sim.remesh.metric import edge_lengths
from muslin.sim.remesh.obstacle import Obstacle
from muslin.sim.remesh.panel_mesh import DEAD
from muslin.sim.remesh.sewn_mesh import PINNED, GarmentState, SewnMesh
from tests.sim.remesh.tables import check_sewn

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Adapted:
    """A remeshed garment, the number that each vertex had, what was done, and the table behind it."""

    before: GarmentState
    after: GarmentState
    origin: NDArray[np.int32]
    changes: Changes
    table: SewnMesh
    body: tuple[Array, NDArray[np.int32]]


def adapted(
    state: GarmentState, metric: Array, body: tuple[Array, NDArray[np.int32]], aspect_min: float = 0.2
) -> Adapted:
    """`adapt`, and the table as it left it."""
    caught: list[SewnMesh] = []
    unload = adapting.unload

    def keep(table: SewnMesh, *rest):
        caught.append(table)
        return unload(table, *rest)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(adapting, "unload", keep)
        after, origin, changes = adapt(state, metric, Obstacle(*body), aspect_min)
    return Adapted(state, after, origin, changes, caught[0], body)


def check_adapted(done: Adapted) -> None:
    """All of it."""
    check_sewn(done.table)
    done.after.mesh.validate()
    check_panel_space(done.before.mesh, done.after.mesh)
    check_seams(done.before.mesh, done.after.mesh)
    check_conserved(done.before, done.after)
    check_kept(done)
    check_sizes(done)
    check_drift(done)
    counts = count_intersections(done.after.positions, done.after.mesh.faces, *done.body)
    assert (counts.cloth_cloth, counts.cloth_body) == (0, 0)


def check_panel_space(old: GarmentMesh, new: GarmentMesh) -> None:
    """Panels have the same area and boundary, no triangle is inverted, in panel space or in the layout."""
    assert new.euler_characteristic == old.euler_characteristic
    assert len(new.boundary_loops) == len(old.boundary_loops)
    for panel in range(len(old.panel_names)):
        whole, now = (math.fsum(mesh.face_areas[mesh.face_panel == panel]) for mesh in (old, new))
        assert abs(now - whole) <= 1e-14 * whole
    assert (new.face_areas > 0.0).all()
    if (signed_areas(old.uv, old.panel_faces) > 0.0).all():
        assert (signed_areas(new.uv, new.panel_faces) > 0.0).all()
    # What is new on a boundary lies on the old one, and of the old one only straight vertices are missing.
    for panel in range(len(old.panel_names)):
        given, found = (boundary_of(mesh, panel) for mesh in (old, new))
        ends = new.panel_vertices[np.unique(found)]
        start, stop = old.panel_vertices[given].swapaxes(0, 1)
        assert distance_to_segments(ends, start, stop).max() <= 1e-13
        present = {point.tobytes() for point in ends}
        for point in old.panel_vertices[turning(old, given)]:
            assert point.tobytes() in present


def boundary_of(mesh: GarmentMesh, panel: int) -> NDArray[np.int32]:
    """(B, 2) boundary edges of one panel, over panel vertices."""
    edges = mesh.panel_boundary_edges
    return edges[mesh.panel_vertex_panel[edges[:, 0]] == panel]


def turning(mesh: GarmentMesh, boundary: NDArray[np.int32]) -> NDArray[np.int64]:
    """Panel vertices of a boundary at which it turns by more than 1e-8."""
    after = np.zeros(len(mesh.panel_vertices), np.int64)
    after[boundary[:, 0]] = boundary[:, 1]
    a, b = boundary.T
    u, v = (mesh.panel_vertices[end] - mesh.panel_vertices[begin] for begin, end in ((a, b), (b, after[b])))
    sine = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    return b[np.abs(np.arctan2(sine, (u * v).sum(axis=1))) > 1e-8]


def distance_to_segments(points: Array, start: Array, stop: Array) -> Array:
    """(N,) distances of points (N, 2) from the nearest of the segments (S, 2), (S, 2)."""
    u = stop - start
    to = points[:, None] - start
    along = np.clip((to * u).sum(axis=2) / (u * u).sum(axis=1), 0.0, 1.0)
    return np.linalg.norm(to - along[:, :, None] * u, axis=2).min(axis=1)


def seam_sides(mesh: GarmentMesh) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """(S, 2), (S, 2) panel vertices of both sides of each seam edge, in one direction of the sewn edge."""
    edges = mesh.panel_boundary_edges
    sewn = mesh.panel_to_vertex[edges].astype(np.int64)
    key = np.sort(sewn, axis=1) @ np.array([mesh.num_vertices, 1])
    order = np.argsort(key, kind="stable")
    pair = np.flatnonzero(key[order][1:] == key[order][:-1])
    first, second = edges[order[pair]], edges[order[pair + 1]]
    return first, second[:, ::-1]


def check_seams(old: GarmentMesh, new: GarmentMesh) -> None:
    """Both sides of every seam edge end in the same sewn vertices; their lengths differ by no larger a share
    than somewhere before, by less than 1e-9 m where they did not, and all together they are as long."""
    one, other = seam_sides(new)
    np.testing.assert_array_equal(new.panel_to_vertex[one], new.panel_to_vertex[other])
    given, found = seam_lengths(old), seam_lengths(new)
    np.testing.assert_allclose(found.sum(), given.sum(), rtol=1e-12)
    eased = (np.abs(given[:, 0] - given[:, 1]) / given.sum(axis=1)).max(initial=0.0)
    assert (np.abs(found[:, 0] - found[:, 1]) <= eased * found.sum(axis=1) + 1e-9).all()


def seam_lengths(mesh: GarmentMesh) -> Array:
    """(S, 2) lengths of both sides of each seam edge, metres."""
    sides = seam_sides(mesh)
    return np.stack(
        [
            np.linalg.norm(mesh.panel_vertices[side[:, 1]] - mesh.panel_vertices[side[:, 0]], axis=1)
            for side in sides
        ],
        axis=1,
    )


def check_conserved(before: GarmentState, after: GarmentState) -> None:
    """Mass and linear momentum over the density."""
    area, given = after.mesh.vertex_areas, before.mesh.vertex_areas
    assert (area > 0.0).all()
    assert abs(math.fsum(area) - math.fsum(given)) <= 1e-13 * math.fsum(given)
    scale = np.abs(given[:, None] * before.velocities).sum()
    for k in range(3):
        momentum, was = (
            math.fsum(state.mesh.vertex_areas * state.velocities[:, k]) for state in (after, before)
        )
        assert abs(momentum - was) <= 1e-12 * scale


def check_kept(done: Adapted) -> None:
    """Vertices that are old are where they were, locked ones are all there, and no edge between led ones on
    the boundary was split."""
    before, after, origin = done.before, done.after, done.origin
    old = origin >= 0
    assert len(np.unique(origin[old])) == old.sum()
    assert after.positions[old].tobytes() == before.positions[origin[old]].tobytes()
    assert after.held[old].tobytes() == before.held[origin[old]].tobytes()
    np.testing.assert_array_equal(after.locked[old], before.locked[origin[old]])
    assert (after.locked[~old] == 0).all()
    assert set(np.flatnonzero(before.locked)) <= set(origin.tolist())
    led = before.mesh.boundary_edges[
        (before.locked[before.mesh.boundary_edges] == int(PINNED)).all(axis=1)
    ].tolist()
    edges = {tuple(edge) for edge in origin[after.mesh.boundary_edges].tolist()}
    assert {tuple(edge) for edge in led} <= edges


def check_sizes(done: Adapted) -> None:
    """All edges are of size <= 1 in the metric as it is carried: given at old vertices, lowered at the ends
    of led edges, and the mean of the ends of the edge that was split at new ones. On a seam both sides are,
    each in the metric of its panel."""
    panels = done.table.panels
    corner = panels.corner.numpy()[: 3 * int(panels.size.numpy()[1])].reshape(-1, 3)
    faces = corner[corner[:, 0] != int(DEAD)]
    half = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    assert edge_lengths(panels.point.numpy(), half, panels.metric.numpy()).max() <= 1.0 + 1e-12


def check_drift(done: Adapted) -> None:
    """Every point of the surface that was a vertex is within the drift of all corners of its face of where it
    was."""
    old, new = done.before, done.after
    alive = np.flatnonzero(done.table.copy.numpy() >= 0)
    drift = done.table.drift.numpy()[alive]
    for panel in range(len(old.mesh.panel_names)):
        points = np.flatnonzero(old.mesh.panel_vertex_panel == panel)
        faces = np.flatnonzero(new.mesh.face_panel == panel)
        face, weights = located(old.mesh.panel_vertices[points], new.mesh, faces)
        corners = new.mesh.faces[face]
        now = (weights[:, :, None] * new.positions[corners]).sum(axis=1)
        moved = np.linalg.norm(now - old.positions[old.mesh.panel_to_vertex[points]], axis=1)
        assert (moved <= drift[corners].min(axis=1) + 1e-9).all()


def located(points: Array, mesh: GarmentMesh, faces: NDArray[np.int64]) -> tuple[NDArray[np.int64], Array]:
    """(N,) which of some faces points (N, 2) of panel space lie in, or least outside, and (N, 3) where."""
    a, b, c = mesh.panel_vertices[mesh.panel_faces[faces]].swapaxes(0, 1)
    u, v, to = b - a, c - a, points[:, None] - a
    whole = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    second = (to[..., 0] * v[:, 1] - to[..., 1] * v[:, 0]) / whole
    third = (u[:, 0] * to[..., 1] - u[:, 1] * to[..., 0]) / whole
    weights = np.stack([1.0 - second - third, second, third], axis=2)
    best = weights.min(axis=2).argmax(axis=1)
    return faces[best], weights[np.arange(len(points)), best]
