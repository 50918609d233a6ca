"""The canonical uv layout: one map from a design's reference panels to the panels of each of its members.

The atlas shows the reference member of a design. A member's panel is the image of the reference panel under a
map that takes equal fractions of arc length on each edge to each other and carries the inside along
(`carry`). Templates are carried from the reference to a member. Meshes cut from a member get their uv by the
inverse of the map, piecewise linear on a background mesh of the reference. So all of them, at every
resolution, share one layout, up to the discretisation of the map.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.garments import catalogue
from muslin.garments.atlas import Atlas
from muslin.garments.carry import carry
from muslin.garments.cut import Cut
from muslin.garments.locate import locate
from muslin.garments.pattern import Pattern
from muslin.garments.topology import Reference, reference, topology

BACKGROUND, BACKGROUND_EDGE_LENGTH = "background", 0.02  # mesh that carries the inverse map; metres


def uv_coordinates(pattern: Pattern, cut: Cut) -> NDArray[np.float64]:
    """uv (P, 2) in [0, 1]^2 of the panel vertices of a cut of the pattern.

    A pattern with the panels, edges and seams of a design in the catalogue gets that design's layout; any
    other pattern an atlas of its own panels.
    """
    shared = _reference_of(pattern)
    if shared is None:
        atlas = Atlas.of(pattern)
        return np.concatenate([atlas.place(cut.vertices_of(k), k) for k in range(len(pattern.panels))])
    background = topology(pattern.name, BACKGROUND, BACKGROUND_EDGE_LENGTH)
    uv = []
    for k, panel in enumerate(pattern.panels):
        rest, faces = background.vertices_of(k), background.faces_of(k)
        carried = carry(rest, faces, background.sampling.points(pattern, panel.name))
        boundary = cut.sampling.points(shared.pattern, panel.name)
        interior = interpolate(carried, faces, rest, cut.vertices_of(k)[len(boundary) :])
        uv.append(shared.atlas.place(np.concatenate([boundary, interior]), k))
    return np.concatenate(uv)


def interpolate(
    points: NDArray[np.float64],
    faces: NDArray[np.int32],
    values: NDArray[np.float64],
    queries: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Values (Q, k) at queries (Q, 2) of the piecewise linear function that is `values` (N, k) at points."""
    face, weights = locate(points, faces, queries)
    return np.einsum("qi,qik->qk", weights, values[faces[face]])


def _reference_of(pattern: Pattern) -> Reference | None:
    if pattern.name not in catalogue.names():
        return None
    shared = reference(pattern.name)
    same = _structure(pattern) == _structure(shared.pattern) and pattern.seams == shared.pattern.seams
    return shared if same else None


def _structure(pattern: Pattern) -> list[tuple[str, list[str]]]:
    return [(panel.name, [edge.name for edge in panel.edges]) for panel in pattern.panels]
