"""The same points of cloth on two triangulations of one pattern: those with equal panel-space coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh

PARAMETER_DIGITS = 6  # of metres, to which parameters of one member of a design agree


@dataclass(frozen=True, eq=False)
class Correspondence:
    """Where on a source mesh the vertices of a target mesh lie.

    corners    (V, 3) int32, vertices of a triangle of the source; of an edge on the boundary of a panel, the
               second one twice
    weights    (V, 3) float64, barycentric coordinates in it: not negative, of sum one
    distance   (V,) float64, panel-space distance of the vertex to that point, metres: zero but where the two
               meshes sample a curved boundary of a panel differently
    """

    corners: NDArray[np.int32]
    weights: NDArray[np.float64]
    distance: NDArray[np.float64]

    def carry(self, values: NDArray[np.floating]) -> NDArray[np.float64]:
        """Values (V_source, ...) at the vertices of the source, interpolated linearly at those of the target;
        (V, ...)."""
        return np.einsum("vk,vk...->v...", self.weights, values[self.corners].astype(np.float64))


def correspondence(source: GarmentMesh, target: GarmentMesh) -> Correspondence:
    """For each vertex of `target` the point of `source` in the same panel at equal panel-space coordinates.

    The nearest point where the source has none such, because the two sample a curved boundary differently. A
    vertex on the boundary of a panel gets a point on that boundary, so seams lead to seams and hems to hems;
    of the several panel-space points of a seam vertex the one that is nearest to its image counts.
    Raises InputError unless both are meshes of one pattern: equal name, parameters and panels, and no point
    further off than half the longest edge of the two, as far as a chord strays from its curve.
    """
    _require_one_pattern(source, target)
    count = len(target.panel_vertices)
    corners = np.empty((count, 3), dtype=np.int32)
    weights = np.empty((count, 3))
    distance = np.empty(count)
    on_boundary = np.zeros(count, dtype=bool)
    on_boundary[target.panel_boundary_edges] = True
    edges = source.panel_boundary_edges[:, [0, 1, 1]]
    for panel, name in enumerate(target.panel_names):
        there = source.panel_names.index(name)
        for boundary, elements in ((False, source.panel_faces), (True, edges)):
            here = np.flatnonzero((target.panel_vertex_panel == panel) & (on_boundary == boundary))
            mine = elements[source.panel_vertex_panel[elements[:, 0]] == there]
            corners[here], weights[here], distance[here] = _nearest(
                source.panel_vertices, mine, target.panel_vertices[here]
            )
    limit = 0.5 * max(_longest_edge(source), _longest_edge(target))
    if distance.max() > limit:
        raise InputError(
            f"the panels of two meshes of '{target.name}' differ by {distance.max():.3g} m in panel space; "
            f"meshes of one pattern differ by {limit:.3g} m at most"
        )
    order = np.lexsort((distance, target.panel_to_vertex))
    _, first = np.unique(target.panel_to_vertex[order], return_index=True)
    chosen = order[first]
    return Correspondence(source.panel_to_vertex[corners[chosen]], weights[chosen], distance[chosen])


def _nearest(
    points: NDArray[np.float64], elements: NDArray[np.int32], queries: NDArray[np.float64]
) -> tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]:
    """Corners (Q, 3) of the nearest element, barycentric coordinates (Q, 3) in it and distance (Q,), metres.

    points (N, 2), queries (Q, 2); elements (M, 3): triangles, or edges a, b, b.
    """
    if len(queries) == 0:
        return np.empty((0, 3), np.int32), np.empty((0, 3)), np.empty(0)
    space, asked = (np.pad(np.asarray(p, dtype=np.float64), ((0, 0), (0, 1))) for p in (points, queries))
    squared, found, nearest = igl.point_mesh_squared_distance(asked, space, elements.astype(np.int64))
    corners, nearest = elements[found], np.ascontiguousarray(nearest)
    a, b, c = (np.ascontiguousarray(space[corners[:, k]]) for k in range(3))
    if (elements[:, 1] == elements[:, 2]).all():
        t = ((nearest - a) * (b - a)).sum(axis=1) / ((b - a) ** 2).sum(axis=1)
        weights = np.stack([1.0 - t, t, np.zeros_like(t)], axis=1)
    else:
        weights = igl.barycentric_coordinates(nearest, a, b, c)
    weights = np.maximum(weights, 0.0)
    return corners, weights / weights.sum(axis=1, keepdims=True), np.sqrt(np.maximum(squared, 0.0))


def _require_one_pattern(source: GarmentMesh, target: GarmentMesh) -> None:
    for what, a, b in (
        ("names", source.name, target.name),
        ("parameters", _rounded(source.parameters), _rounded(target.parameters)),
        ("panels", sorted(source.panel_names), sorted(target.panel_names)),
    ):
        if a != b:
            raise InputError(
                f"two meshes are of different patterns, so their points do not correspond; {what}: {a}, {b}"
            )


def _rounded(parameters: dict[str, float]) -> dict[str, float]:
    return {key: round(value, PARAMETER_DIGITS) for key, value in parameters.items()}


def _longest_edge(mesh: GarmentMesh) -> float:
    corners = mesh.panel_vertices[mesh.panel_faces]
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max())
