"""The canonical uv layout: one map from a design's reference panels to the panels of each of its members.

The atlas shows the reference member of a design. A member's panel is the image of the reference panel under a map
that takes equal fractions of arc length on each edge to each other and carries the inside along (`carry`), piecewise
linear on a fine background mesh of the reference. Templates are carried from the reference to a member by this map,
meshes of a member get their uv by its inverse; so all of them, at every resolution, share one layout.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from muslin.garments import catalogue
from muslin.garments.atlas import Atlas
from muslin.garments.carry import carry
from muslin.garments.cut import Cut, cut_pattern
from muslin.garments.locate import locate
from muslin.garments.pattern import Pattern

BACKGROUND_EDGE_LENGTH = 0.02  # metres, of the mesh that carries the map


@dataclass(frozen=True, eq=False)
class ReferencePanels:
    """Reference pattern of a design, its atlas and the fine mesh that carries the map."""

    pattern: Pattern
    atlas: Atlas
    background: Cut

    def carried(self, member: Pattern, panel: int) -> NDArray[np.float64]:
        """Background vertices (P_k, 2) of one panel carried to the same panel of a member, metres."""
        boundary = self.background.sampling.points(member, member.panels[panel].name)
        return carry(self.background.vertices_of(panel), self.background.faces_of(panel), boundary)


@lru_cache(maxsize=8)
def reference_panels(design_name: str) -> ReferencePanels:
    """The reference panels of a design in the catalogue."""
    design = catalogue.get(design_name)
    pattern = design.pattern(**design.reference)
    return ReferencePanels(pattern, Atlas.of(pattern), cut_pattern(pattern, BACKGROUND_EDGE_LENGTH, seed=0))


def uv_coordinates(pattern: Pattern, cut: Cut) -> NDArray[np.float64]:
    """uv (P, 2) in [0, 1]^2 of the panel vertices of a cut of the pattern.

    A pattern with the panels, edges and seams of a design in the catalogue gets that design's layout; any other
    pattern an atlas of its own panels.
    """
    reference = _reference_of(pattern)
    if reference is None:
        atlas = Atlas.of(pattern)
        return np.concatenate([atlas.place(cut.vertices_of(k), k) for k in range(len(pattern.panels))])
    uv = []
    for k, panel in enumerate(pattern.panels):
        boundary = cut.sampling.points(reference.pattern, panel.name)
        faces = reference.background.faces_of(k)
        carried = reference.carried(pattern, k)
        interior = interpolate(
            carried, faces, reference.background.vertices_of(k), cut.vertices_of(k)[len(boundary) :]
        )
        uv.append(reference.atlas.place(np.concatenate([boundary, interior]), k))
    return np.concatenate(uv)


def interpolate(
    points: NDArray[np.float64],
    faces: NDArray[np.int32],
    values: NDArray[np.float64],
    queries: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Values (Q, k) at queries (Q, 2) of the piecewise linear function with `values` (N, k) at points (N, 2)."""
    face, weights = locate(points, faces, queries)
    return np.einsum("qi,qik->qk", weights, values[faces[face]])


def _reference_of(pattern: Pattern) -> ReferencePanels | None:
    if pattern.name not in catalogue.names():
        return None
    reference = reference_panels(pattern.name)
    same = _structure(pattern) == _structure(reference.pattern) and pattern.seams == reference.pattern.seams
    return reference if same else None


def _structure(pattern: Pattern) -> list[tuple[str, list[str]]]:
    return [(panel.name, [edge.name for edge in panel.edges]) for panel in pattern.panels]
