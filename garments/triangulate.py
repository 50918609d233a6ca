"""From a pattern to the sewn garment mesh."""

from __future__ import annotations

import math

from muslin.garments.cut import cut_pattern
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.pattern import Pattern
from muslin.garments.uv_layout import uv_coordinates


def triangulate(pattern: Pattern, edge_length: float, seed: int = 0) -> GarmentMesh:
    """Sewn mesh of the pattern with edges of about `edge_length` metres.

    Both sides of a seam match vertex for vertex, corners where several panels meet become one vertex.
    Different seeds give different interior vertices of the same quality, the same seed gives the same mesh.
    Patterns of a design in the catalogue get the uv layout of that design, others their own panels side by
    side. Raises InputError for an unsound pattern or an edge length too coarse for it.
    """
    if not (math.isfinite(edge_length) and edge_length > 0.0):
        raise InputError(f"edge_length = {edge_length} m; it must be a finite number greater than zero")
    pattern.validate()
    cut = cut_pattern(pattern, edge_length, seed)
    return cut.mesh(pattern, cut.panel_vertices, uv_coordinates(pattern, cut))
