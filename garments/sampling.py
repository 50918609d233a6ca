"""Sampling of panel boundaries so that the two sides of every seam match vertex for vertex."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from muslin.garments.pattern import Pattern
from muslin.garments.seams import EdgeRef


@dataclass(frozen=True)
class BoundarySampling:
    """How many segments each edge of a pattern has, and which boundary vertices are sewn together.

    segments: segments of each edge; equal on both sides of a seam
    A panel's boundary vertices run counter-clockwise from the start of its first edge; the vertices of all
    panels are numbered one panel after the other.
    """

    segments: dict[EdgeRef, int]

    @staticmethod
    def of(pattern: Pattern, edge_length: float) -> BoundarySampling:
        """Segments of about `edge_length` metres; at least one an edge."""
        length = {
            EdgeRef(panel.name, edge.name): edge.curve.length
            for panel in pattern.panels
            for edge in panel.edges
        }
        for seam in pattern.seams:
            length[seam.first] = length[seam.second] = 0.5 * (length[seam.first] + length[seam.second])
        return BoundarySampling({ref: max(1, round(value / edge_length)) for ref, value in length.items()})

    def points(self, pattern: Pattern, panel_name: str) -> NDArray[np.float64]:
        """(B, 2) boundary vertices of one panel, equally spaced in arc length along each edge, metres."""
        parts = []
        for edge in pattern.panel(panel_name).edges:
            count = self.segments[EdgeRef(panel_name, edge.name)]
            parts.append(edge.curve.at_fraction(np.arange(count) / count))
        return np.concatenate(parts)

    def edge_vertices(self, pattern: Pattern) -> dict[EdgeRef, NDArray[np.int64]]:
        """For each edge its boundary vertices from start to end, numbered over all panels."""
        vertices = {}
        offset = 0
        for panel in pattern.panels:
            refs = [EdgeRef(panel.name, edge.name) for edge in panel.edges]
            total = sum(self.segments[ref] for ref in refs)
            first = 0
            for ref in refs:
                count = self.segments[ref]
                vertices[ref] = offset + np.arange(first, first + count + 1) % total
                first += count
            offset += total
        return vertices

    def sewn(self, pattern: Pattern) -> NDArray[np.int32]:
        """(B_total,) group of each boundary vertex; vertices sewn together share one, corners too."""
        vertices = self.edge_vertices(pattern)
        total = sum(self.segments.values())
        pairs = [(vertices[seam.first], vertices[seam.second][::-1]) for seam in pattern.seams]
        rows = np.concatenate([np.empty(0, dtype=np.int64), *(first for first, _ in pairs)])
        columns = np.concatenate([np.empty(0, dtype=np.int64), *(second for _, second in pairs)])
        graph = coo_matrix((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(total, total))
        return connected_components(graph, directed=False)[1].astype(np.int32)
