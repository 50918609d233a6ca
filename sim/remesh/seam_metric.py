"""Metrics on seams: both sides of a seam are one row of edges, and must agree on how long these are.

The panels of the two sides are turned against each other, so their tensors cannot be compared. What has a
meaning on both is the length along the seam: m = t^T M t, 1/m^2, t the unit vector along it in the panel.

Two ways to make them agree: `sewn_edge_lengths` takes the larger size of the two sides, which is what decides
whether an edge of the garment is split. `agree_on_seams` raises the tensors themselves beforehand, so that
the triangles behind the seam suit its edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from muslin.garments.half_edges import opposite
from muslin.garments.mesh import GarmentMesh
from muslin.sim.remesh.metric import edge_lengths, quadratic_form

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class SeamEdges:
    """Half edges of panels that are sewn to another: `tail` and `head` (S,) panel vertices in the direction
    of the face, and `twin_tail`, `twin_head` (S,), those of the other side's, which runs the other way; so
    tail and twin_head are one vertex of the garment. Both sides are listed."""

    tail: Index
    head: Index
    twin_tail: Index
    twin_head: Index

    @staticmethod
    def of(mesh: GarmentMesh) -> SeamEdges:
        start, end = _half_edges(mesh.panel_faces)
        copies = np.bincount(mesh.panel_to_vertex, minlength=mesh.num_vertices)[mesh.panel_to_vertex]
        # A dart begins at a vertex that has no copy.
        near = (copies[start] > 1) | (copies[end] > 1)
        start, end = start[near], end[near]
        sewn_start, sewn_end = (mesh.panel_to_vertex[side] for side in (start, end))
        twin = opposite(sewn_start, sewn_end, mesh.num_vertices)
        sewn = (twin >= 0) & ((start[twin] != end) | (end[twin] != start))
        twin = twin[sewn]
        return SeamEdges(start[sewn], end[sewn], start[twin], end[twin])


def sewn_edge_lengths(mesh: GarmentMesh, metric: Array) -> Array:
    """(E,) sizes of `mesh.edges` in a metric (P, 2, 2) on panel vertices; of the two sides of a seam, the
    larger."""
    start, end = _half_edges(mesh.panel_faces)
    size = edge_lengths(mesh.panel_vertices, np.stack([start, end], axis=1), metric)
    a, b = (mesh.panel_to_vertex[side].astype(np.int64) for side in (start, end))
    weights = np.array([mesh.num_vertices, 1])
    edge = np.searchsorted(mesh.edges @ weights, np.minimum(a, b) * mesh.num_vertices + np.maximum(a, b))
    lengths = np.zeros(len(mesh.edges))
    np.maximum.at(lengths, edge, size)
    return lengths


def agree_on_seams(mesh: GarmentMesh, metric: Array) -> Array:
    """(P, 2, 2) metric, nowhere smaller, in which both sides of a seam ask for the same along it.

        M' = M + (m' - m) t t^T,  m = t^T M t

    asks for m' along t, for no more than m' - m in addition in any direction, and for nothing across. A seam
    vertex takes m' from the other side along the seam edge ahead, then along the one behind. On a straight
    seam both are one direction and the sides agree exactly; where a seam bends or ends, all but for the turn
    from edge to edge.

    (The bound of smallest determinant, M + (m' - m) / m^2 (M t)(M t)^T, makes a tenth fewer triangles at
    seams, but M t may lie far off t: where seams bend, what it adds for one edge spoils the next one.)
    """
    seams = SeamEdges.of(mesh)
    points, raised = mesh.panel_vertices, metric.copy()
    own, other = points[seams.head] - points[seams.tail], points[seams.twin_head] - points[seams.twin_tail]
    own /= np.linalg.norm(own, axis=1)[:, None]
    other /= np.linalg.norm(other, axis=1)[:, None]
    # A panel vertex is at most once a tail, and at most once a head.
    for vertex, beyond in ((seams.tail, seams.twin_head), (seams.head, seams.twin_tail)):
        more = quadratic_form(raised[beyond], other) - quadratic_form(raised[vertex], own)
        raised[vertex] += np.maximum(more, 0.0)[:, None, None] * own[:, :, None] * own[:, None, :]
    return raised


def _half_edges(faces: NDArray[np.int32]) -> tuple[Index, Index]:
    """Start and end (3 F,) of the edges of faces (F, 3)."""
    return faces.ravel().astype(np.int64), np.roll(faces, -1, axis=1).ravel().astype(np.int64)
