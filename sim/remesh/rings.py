"""Boundaries of panels as rings of nodes, holes joined to what surrounds them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from muslin.garments.errors import InputError


@dataclass(frozen=True, eq=False)
class Rings:
    """One closed ring of nodes a piece of cloth, its inside to the left, for `passes.clip_ears`.

    vertex          (N,) panel vertex of each node; the ends of a bridge to a hole have two nodes
    before, after   (N,) neighbours of each node in its ring
    first, length   (K,) a node of each ring, and how many it has
    panel           (K,) panel of each ring
    """

    vertex: NDArray[np.int64]
    before: NDArray[np.int64]
    after: NDArray[np.int64]
    first: NDArray[np.int64]
    length: NDArray[np.int64]
    panel: NDArray[np.int64]


def rings(points: NDArray[np.float64], after: NDArray[np.int32], panel: NDArray[np.int32]) -> Rings:
    """Rings of the boundary points (R, 2), metres, of panels (R,), each followed by after[r].

    Loops that run clockwise are holes of the loop of their panel that contains them; each is joined by a
    bridge, run through in both directions, to the nearest point that it can be seen from. InputError if a
    hole has nothing around it.
    """
    count = len(after)
    graph = coo_matrix((np.ones(count, dtype=np.int8), (np.arange(count), after)), shape=(count, count))
    loops, loop = connected_components(graph, directed=False)
    following = points[after]
    doubled = points[:, 0] * following[:, 1] - points[:, 1] * following[:, 0]
    area = np.bincount(loop, doubled, loops)
    vertex, successor = np.arange(count), after.astype(np.int64)
    outer = np.flatnonzero(area > 0.0)
    for hole in np.flatnonzero(area <= 0.0):
        inside = np.flatnonzero(loop == hole)
        ring_panel = panel[inside[0]]
        around = np.flatnonzero((panel[vertex] == ring_panel) & np.isin(loop, outer))
        a, b = _bridge(points, vertex, successor, inside, around, panel)
        # Nodes a of the hole and b around it get twins: … b -> a … a' -> b' …
        twins = np.array([len(vertex), len(vertex) + 1])
        vertex = np.append(vertex, vertex[[a, b]])
        successor = np.append(successor, [twins[1], successor[b]])
        before_a = int(np.flatnonzero(successor[: twins[0]] == a)[0])
        successor[before_a] = twins[0]
        successor[b] = a
        loop = np.append(loop, [loop[b], loop[b]])
        loop[inside] = loop[b]
    before = np.empty(len(vertex), dtype=np.int64)
    before[successor] = np.arange(len(vertex))
    first = np.array([np.flatnonzero(loop == k)[0] for k in outer])
    length = np.array([np.count_nonzero(loop == k) for k in outer])
    return Rings(vertex, before, successor, first, length, panel[vertex[first]].astype(np.int64))


def _bridge(
    points: NDArray[np.float64],
    vertex: NDArray[np.int64],
    after: NDArray[np.int64],
    inside: NDArray[np.int64],
    around: NDArray[np.int64],
    panel: NDArray[np.int32],
) -> tuple[int, int]:
    """Nodes of a hole and of a ring around it: the nearest two with no boundary of the panel between them."""
    gap = np.linalg.norm(points[vertex[inside]][:, None] - points[vertex[around]], axis=2)
    tails = np.flatnonzero(panel[vertex] == panel[vertex[inside[0]]])
    p, q = points[vertex[tails]], points[vertex[after[tails]]]
    for flat in np.argsort(gap, axis=None):
        i, j = np.unravel_index(flat, gap.shape)
        a, b = int(inside[i]), int(around[j])
        x, y = points[vertex[a]], points[vertex[b]]
        apart = (vertex[tails] != vertex[a]) & (vertex[tails] != vertex[b])
        apart &= (vertex[after[tails]] != vertex[a]) & (vertex[after[tails]] != vertex[b])
        crosses = (_side(x, y, p) * _side(x, y, q) <= 0.0) & (_side(p, q, x) * _side(p, q, y) <= 0.0)
        if not (crosses & apart).any():
            return a, b
    raise InputError("a panel has a hole that no boundary surrounds; boundaries must not cross themselves")


def _side(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Which side of a-b each c lies on: twice the signed area of the triangle."""
    u, v = b - a, c - a
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
