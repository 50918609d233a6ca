"""The curves that bound panels, found in a mesh alone: pattern corners, seams, hems, and their lengths.

A *pattern corner* is a vertex of a panel's boundary at which one curve ends and the next begins; a *curve* is
a maximal chain of boundary edges between two of them, or a whole closed boundary without any.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from muslin.eval.metrics.triangle_quality import angles
from muslin.garments.boundary_angles import boundary_angles
from muslin.garments.mesh import GarmentMesh

TURN = np.radians(60.0)  # of a boundary at a corner; curves of coarse meshes turn by up to 45 degrees
SAME_PLACE = 0.1  # mean edges of a curve within which vertices of the two sides of a seam match

Chain = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Curves:
    """Curves of a mesh.

    chains: panel vertices of each in order, counter-clockwise round their panel, corners at both ends
    partner: the curve each is sewn to, -1 for a free one; a partner runs the other way
    """

    chains: tuple[Chain, ...]
    partner: tuple[int, ...]


@lru_cache(maxsize=4)
def unsewn(mesh: GarmentMesh) -> GarmentMesh:
    """The same panels, not sewn: its vertices are the panel vertices, its boundary that of the panels.

    The last few are kept, since finding the boundary takes longer than everything done with it.
    """
    return replace(
        mesh, faces=mesh.panel_faces, panel_to_vertex=np.arange(len(mesh.panel_vertices), dtype=np.int32)
    )


def pattern_corners(mesh: GarmentMesh) -> NDArray[np.bool_]:
    """(P,) whether a panel vertex is a pattern corner.

    A vertex v on a panel's boundary is one if the boundary turns by |pi - beta_v| >= TURN there, or if the
    seam does not go on through v: one of the two boundary edges at v is sewn and the other is free, or the
    two edges they are sewn to do not meet in one panel vertex other than v (as at the end of a dart). If v
    is one, so is every panel vertex that is sewn to v, so that seams are cut alike on both sides.
    """
    panels = unsewn(mesh)
    edges = panels.boundary_edges
    other = _partner_edges(mesh, edges)
    arriving = np.full(len(mesh.panel_vertices), -1)
    arriving[edges[:, 1]] = np.arange(len(edges))
    before, after = other[arriving[edges[:, 0]]], other
    # The partner runs the other way: what is sewn to the edge that arrives begins where what is sewn to the
    # edge that leaves ends.
    meet = edges[before, 0] == edges[after, 1]
    goes_on = (before >= 0) & (after >= 0) & meet & (edges[after, 1] != edges[:, 0])
    goes_on |= (before < 0) & (after < 0)
    turn = np.abs(np.pi - boundary_angles(mesh, angles(mesh.panel_vertices, mesh.panel_faces))[edges[:, 0]])
    corner = edges[~goes_on | (turn >= TURN), 0]
    sewn = np.zeros(mesh.num_vertices, dtype=bool)
    sewn[mesh.panel_to_vertex[corner]] = True
    on_boundary = np.zeros(len(mesh.panel_vertices), dtype=bool)
    on_boundary[edges] = True
    return sewn[mesh.panel_to_vertex] & on_boundary


def pattern_curves(mesh: GarmentMesh) -> Curves:
    """All curves of a mesh, panel boundary after panel boundary."""
    panels = unsewn(mesh)
    corner = pattern_corners(mesh)
    chains = []
    for loop in panels.boundary_loops:
        ends = np.flatnonzero(corner[loop])
        start = int(ends[0]) if len(ends) else 0
        ring = np.append(np.roll(loop, -start), loop[start])
        cuts = [0, *(np.flatnonzero(corner[ring[1:-1]]) + 1).tolist(), len(ring) - 1]
        chains += [ring[a : b + 1] for a, b in pairwise(cuts)]
    edges = panels.boundary_edges
    other = _partner_edges(mesh, edges)
    edge_from = np.full(len(mesh.panel_vertices), -1)
    edge_from[edges[:, 0]] = np.arange(len(edges))
    curve_of = np.full(len(edges), -1)
    for number, chain in enumerate(chains):
        curve_of[edge_from[chain[:-1]]] = number
    first = other[[edge_from[chain[0]] for chain in chains]]
    return Curves(tuple(chains), tuple(np.where(first >= 0, curve_of[first], -1).tolist()))


def corresponding_chains(mesh: GarmentMesh, source: GarmentMesh, curves: Curves) -> tuple[Chain | None, ...]:
    """For each of the curves of `source`, the chain of `mesh` that took its place, None where there is none.

    It runs along the boundary of the panel of the same index from the boundary vertex nearest to the curve's
    start to the one nearest to its end; all round where these are the same.
    """
    panels = unsewn(mesh)
    edges = panels.boundary_edges
    following = np.full(len(mesh.panel_vertices), -1, dtype=np.int32)
    following[edges[:, 0]] = edges[:, 1]
    edge_panel = mesh.panel_vertex_panel[edges[:, 0]]
    found: list[Chain | None] = []
    for chain in curves.chains:
        candidates = edges[edge_panel == source.panel_vertex_panel[chain[0]], 0]
        if len(candidates) == 0:
            found.append(None)
            continue
        points = mesh.panel_vertices[candidates]
        start, end = (
            int(candidates[np.argmin(((points - source.panel_vertices[v]) ** 2).sum(axis=1))])
            for v in (chain[0], chain[-1])
        )
        found.append(_walk(following, start, end))
    return tuple(found)


def arc_lengths(points: NDArray[np.float64], chain: Chain) -> NDArray[np.float64]:
    """Distance from the start of a chain (n,) along it to each of its vertices; (n,), metres."""
    steps = np.linalg.norm(np.diff(points[chain], axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def curve_length_errors(mesh: GarmentMesh, source: GarmentMesh) -> NDArray[np.float64]:
    """|l - L| / L of each curve of `source`; l its length in `mesh`, L in `source`, both in panel space.

    Infinite for a curve that `mesh` does not have.
    """
    curves = pattern_curves(source)
    errors = np.full(len(curves.chains), np.inf)
    for k, chain in enumerate(corresponding_chains(mesh, source, curves)):
        if chain is not None:
            length = arc_lengths(source.panel_vertices, curves.chains[k])[-1]
            errors[k] = abs(arc_lengths(mesh.panel_vertices, chain)[-1] - length) / length
    return errors


def curve_distances(mesh: GarmentMesh, source: GarmentMesh) -> NDArray[np.float64]:
    """How far each curve of `source` and what took its place in `mesh` are apart in panel space, metres.

    max( max_i d(a_i, B), max_j d(b_j, A) ), a_i and b_j the vertices of the polylines A and B, d the distance
    to the nearest point of the other. Infinite for a curve that `mesh` does not have.
    """
    curves = pattern_curves(source)
    distances = np.full(len(curves.chains), np.inf)
    for k, chain in enumerate(corresponding_chains(mesh, source, curves)):
        if chain is not None:
            a, b = mesh.panel_vertices[chain], source.panel_vertices[curves.chains[k]]
            distances[k] = max(_to_polyline(a, b).max(), _to_polyline(b, a).max())
    return distances


def mismatched_seam_vertices(mesh: GarmentMesh, source: GarmentMesh) -> int:
    """Vertices on the seams of `source` that have no vertex of `mesh` opposite.

    Vertex i of one side lies at the share s_i of that side's length from its start, j of the other at t_j
    from its end. i has one opposite if |s_i - t_j| <= SAME_PLACE / n for some j, n the number of edges of its
    side; both sides are counted. A curve that `mesh` does not have leaves every vertex of the other side
    without one. `mesh` need not be sewn.
    """
    curves = pattern_curves(source)
    shares = [
        None if chain is None else (s := arc_lengths(mesh.panel_vertices, chain)) / s[-1]
        for chain in corresponding_chains(mesh, source, curves)
    ]
    count = 0
    for k, partner in enumerate(curves.partner):
        own, opposite = shares[k], shares[partner]
        if partner < 0 or own is None:
            continue
        if opposite is None:
            count += len(own)
            continue
        apart = np.abs(own[:, None] - (1.0 - opposite)[None]).min(axis=1)
        count += int((apart * (len(own) - 1) > SAME_PLACE).sum())
    return count


def _partner_edges(mesh: GarmentMesh, edges: NDArray[np.int32]) -> NDArray[np.int64]:
    """(B,) for each boundary edge of the panels the one it is sewn to, -1 for a free one."""
    ends = np.sort(mesh.panel_to_vertex[edges].astype(np.int64), axis=1)
    key = ends[:, 0] * mesh.num_vertices + ends[:, 1]
    order = np.argsort(key, kind="stable")
    paired = np.flatnonzero(key[order[:-1]] == key[order[1:]])
    partner = np.full(len(edges), -1, dtype=np.int64)
    partner[order[paired]], partner[order[paired + 1]] = order[paired + 1], order[paired]
    return partner


def _to_polyline(points: NDArray[np.float64], line: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of points (n, 2) to a polyline (m, 2); (n,)."""
    start, along = line[:-1], np.diff(line, axis=0)
    offset = points[:, None] - start
    square = (along**2).sum(axis=1)
    t = (offset * along).sum(axis=2) / np.where(square > 0.0, square, 1.0)
    return np.linalg.norm(offset - np.clip(t, 0.0, 1.0)[..., None] * along, axis=2).min(axis=1)


def _walk(following: NDArray[np.int32], start: int, end: int) -> Chain | None:
    """Boundary vertices from start to end, at least one edge; None if the boundary does not lead there."""
    chain = [start]
    for _ in range(len(following)):
        chain.append(int(following[chain[-1]]))
        if chain[-1] == end:
            return np.array(chain, dtype=np.int32)
        if chain[-1] in (start, -1):
            break
    return None
