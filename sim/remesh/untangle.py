"""A new triangulation of a drape that crosses neither itself nor the body, where the drape does not."""

from __future__ import annotations

from dataclasses import replace

import igl
import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.sim.dataset.intersections import Crossings, find_crossings
from muslin.sim.remesh.panel_space import PanelSpace
from muslin.sim.remesh.topology import Remeshed

ROUNDS, SUSPICIOUS = 40, 6
"""Rounds at most, and after how many the source itself is looked at; most drapes take two or three."""

CLEARANCE = 2e-4
"""Metres between two layers where they crossed: those of a source may touch to a hair, and larger triangles
cannot follow them to that."""

Array = NDArray[np.float64]


def untangle(
    remeshed: Remeshed,
    positions: Array,
    body_vertices: Array | None = None,
    body_faces: NDArray[np.int32] | None = None,
) -> Remeshed:
    """The same topology, its vertices moved as little as it takes to cross neither itself nor the body.

    positions: (V, 3) of the source, metres, which crosses neither; body_vertices (N, 3), body_faces (M, 3)

    Larger triangles cut corners, and so cut through what the source lies on. Where the new surface crosses
    something, at the point x = sum_k w_k x_k of one of its triangles, it is drawn to where the source has
    that point of panel space, y, and CLEARANCE c from the other layer along their normal n there (half of it
    each, if both are cloth), by the least move that does so,

        x_k += w_k / (w . w) (y + c n - x),

    averaged where a vertex has several; again, until nothing crosses.

    Raises InputError if the source itself crosses something, or if ROUNDS of it are not enough.
    """
    none = np.zeros((0, 3))
    body_x = none if body_vertices is None else np.asarray(body_vertices, dtype=np.float64)
    body_f = none.astype(np.int32) if body_faces is None else body_faces
    source = _Source(remeshed, np.asarray(positions, dtype=np.float64))
    x, faces = remeshed.positions.copy(), remeshed.mesh.faces
    crossings = find_crossings(x, faces, body_x, body_f)
    for number in range(ROUNDS):
        if not len(crossings):
            return replace(remeshed, positions=x)
        if number == SUSPICIOUS:
            _check_source(remeshed, positions, body_x, body_f)
        x += _moves(crossings, x, faces, source)
        crossings = find_crossings(x, faces, body_x, body_f)
    raise InputError(
        f"{len(crossings)} intersections are left in the new triangulation after {ROUNDS} rounds: its "
        "triangles are too large for the folds of this drape; choose a smaller area or another seed"
    )


def _check_source(
    remeshed: Remeshed, positions: Array, body_vertices: Array, body_faces: NDArray[np.int32]
) -> None:
    there = len(find_crossings(positions, remeshed.source.faces, body_vertices, body_faces))
    if there:
        raise InputError(
            f"the drape to be remeshed has {there} intersections itself; remesh one that is free of them"
        )


class _Source:
    """The drape that was remeshed, at any point of the new triangles."""

    def __init__(self, remeshed: Remeshed, positions: Array) -> None:
        self._mesh, self._faces = remeshed.mesh, remeshed.source.faces
        self._space = PanelSpace(remeshed.source)
        self._positions = positions
        self._normals = igl.per_vertex_normals(positions, self._faces.astype(np.int64))

    def at(self, face: NDArray[np.int64], weights: Array) -> tuple[Array, Array]:
        """Position and normal (n, 3) of the source at the panel-space points of new faces (n,)."""
        corners = self._mesh.panel_vertices[self._mesh.panel_faces[face]]
        place = np.einsum("nk,nkj->nj", weights, corners)
        found, inside = self._space.locate(place, self._mesh.face_panel[face])
        vertices = self._faces[found]
        return (
            np.einsum("nk,nkj->nj", inside, self._positions[vertices]),
            np.einsum("nk,nkj->nj", inside, self._normals[vertices]),
        )


def _moves(crossings: Crossings, x: Array, faces: NDArray[np.int32], source: _Source) -> Array:
    """(V, 3) the moves of one round."""
    is_cloth = crossings.faces < len(faces)
    now, there, normal = (np.zeros((2, len(crossings), 3)) for _ in range(3))
    for side in range(2):
        of = is_cloth[:, side]
        face, weights = crossings.faces[of, side], crossings.weights[of, side]
        now[side, of] = np.einsum("nk,nkj->nj", weights, x[faces[face]])
        there[side, of], normal[side, of] = source.at(face, weights)
    # One point of the body is where both meet.
    for side in range(2):
        there[side, ~is_cloth[:, side]] = now[1 - side, ~is_cloth[:, side]]
    apart = there[0] - there[1]
    both = is_cloth.all(axis=1)
    along = np.where(both[:, None], normal[1] * np.sign((apart * normal[1]).sum(axis=1))[:, None], apart)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), np.finfo(float).tiny)
    clearance = CLEARANCE * np.where(both, 0.5, 1.0)[:, None] * along
    total, count = np.zeros_like(x), np.zeros(len(x))
    for side, sign in ((0, 1.0), (1, -1.0)):
        of = is_cloth[:, side]
        corners, weights = faces[crossings.faces[of, side]], crossings.weights[of, side]
        move = (there[side] + sign * clearance - now[side])[of]
        share = weights / (weights**2).sum(axis=1, keepdims=True)
        np.add.at(total, corners, share[:, :, None] * move[:, None])
        np.add.at(count, corners, weights > 0.0)
    return total / np.maximum(count, 1.0)[:, None]
