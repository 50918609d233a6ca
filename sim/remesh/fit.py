"""Fitting another triangulation to a drape, so that all topologies of a design describe one deformation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.linalg import splu

from muslin.garments.locate import barycentric
from muslin.garments.mesh import GarmentMesh
from muslin.sim.remesh.distortion import MAX_DISTORTION
from muslin.sim.remesh.panel_space import PanelSpace
from muslin.sim.remesh.topology import Remeshed, remesh
from muslin.sim.remesh.untangle import untangle

Array = NDArray[np.float64]


def fit(remeshed: Remeshed, positions: Array) -> Remeshed:
    """The same topology at the positions that describe the drape of `positions` (V, 3), metres, best: see
    `Projection`."""
    return Projection(remeshed).fit(positions)


class Projection:
    """The L2 projection over panel space, of any drape of the source onto another topology:

        min_x  int |sum_i phi_i(p) x_i - y(p)|^2 dp,   that is   M x = b,
        M_ij = int phi_i phi_j,   b_i = int phi_i y,

    phi_i the hat functions of the new mesh, one a sewn vertex, so that seams stay sewn; y(p) the source's
    surface. Interpolation instead puts vertices on the surface and cuts all corners between them on the inner
    side of bends.

    Integrals are sums over the three edge midpoints, exact for squares, of triangles into which those of the
    new mesh are divided until they are as small as the source's. So M is exact, and what is linear over panel
    space is kept exactly. Where a new panel reaches beyond the source's, by what its boundary bulges between
    samples, y goes on as it is in the nearest triangle.

    The surface no longer goes through the source's vertices, and no bound keeps it off the body: `untangle`.
    """

    def __init__(self, remeshed: Remeshed) -> None:
        self.remeshed = remeshed
        mesh, source = remeshed.mesh, remeshed.source
        face, weights, area = _quadrature(mesh, float(source.face_areas.mean()))
        phi = _matrix(mesh.faces[face], weights, mesh.num_vertices)
        weighted = phi.multiply(area[:, None]).T.tocsr()
        self._right = weighted @ _matrix(*_in_source(remeshed, face, weights), source.num_vertices)
        self._mass = splu(csc_matrix(weighted @ phi))

    def fit(self, positions: Array) -> Remeshed:
        """The topology at the positions for a drape of the source, (V, 3), metres."""
        solved = self._mass.solve(self._right @ np.asarray(positions, dtype=np.float64))
        return replace(self.remeshed, positions=solved)


def transfer_error(remeshed: Remeshed, positions: Array) -> Array:
    """(P,) metres: how far each panel vertex of the source is from the new surface at the same place in panel
    space, |sum_i phi_i(p) x_i - y(p)|; `positions` (V, 3) are the source's."""
    source = remeshed.source
    face, weights = PanelSpace(remeshed.mesh).locate(source.panel_vertices, source.panel_vertex_panel)
    there = np.einsum("pk,pkj->pj", weights, remeshed.positions[remeshed.mesh.faces[face]])
    return np.linalg.norm(there - positions[source.panel_to_vertex], axis=1)


def topologies(
    mesh: GarmentMesh,
    positions: Array,
    target: float | Mapping[str, float] | Array,
    count: int,
    *,
    seed: int = 0,
    max_distortion: float = MAX_DISTORTION,
    body_vertices: Array | None = None,
    body_faces: NDArray[np.int32] | None = None,
) -> Iterator[Remeshed]:
    """`count` topologies of one drape, of the seeds `seed`, `seed` + 1, …, one after another: `remesh` to the
    target, `fit` to the drape of `positions` (V, 3), metres, and `untangle` it from itself and from the body,
    if one is given."""
    for k in range(count):
        drawn = remesh(mesh, positions, target, seed=seed + k, max_distortion=max_distortion)
        yield untangle(fit(drawn, positions), positions, body_vertices, body_faces)


def _quadrature(mesh: GarmentMesh, area: float) -> tuple[NDArray[np.int64], Array, Array]:
    """Faces (Q,), barycentric coordinates (Q, 3) and areas (Q,), m^2, of points over all panels: each face is
    divided into n^2, of at most `area` m^2, and has a point at every edge midpoint of each."""
    divisions = np.maximum(np.ceil(np.sqrt(mesh.face_areas / area)), 1.0).astype(np.int64)
    faces, weights, areas = [], [], []
    for n in np.unique(divisions):
        chosen = np.flatnonzero(divisions == n)
        points = _midpoints(int(n))
        faces.append(np.repeat(chosen, len(points)))
        weights.append(np.tile(points, (len(chosen), 1)))
        areas.append(np.repeat(mesh.face_areas[chosen] / len(points), len(points)))
    return np.concatenate(faces), np.concatenate(weights), np.concatenate(areas)


def _midpoints(n: int) -> Array:
    """(3 n^2, 3) barycentric coordinates of the edge midpoints of each of n^2 equal parts of a triangle."""
    i, j = (index.ravel() for index in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    upright = np.stack([i, j], axis=1)[i + j < n]
    inverted = np.stack([i, j], axis=1)[i + j < n - 1] + 1
    middle = np.array([[0.5, 0.0], [0.0, 0.5], [0.5, 0.5]])
    parts = np.concatenate([upright[:, None] + middle, inverted[:, None] - middle]).reshape(-1, 2) / n
    return np.column_stack([1.0 - parts.sum(axis=1), parts])


def _in_source(
    remeshed: Remeshed, face: NDArray[np.int64], weights: Array
) -> tuple[NDArray[np.int32], Array]:
    """Vertices (Q, 3) of the source's surface and their weights (Q, 3) at points of new faces."""
    source, mesh = remeshed.source, remeshed.mesh
    place = np.einsum("qk,qkj->qj", weights, mesh.panel_vertices[mesh.panel_faces[face]])
    found, _ = PanelSpace(source).locate(place, mesh.face_panel[face])
    within = barycentric(source.panel_vertices[source.panel_faces[found]], place)
    return source.faces[found], within


def _matrix(vertices: NDArray[np.int32], weights: Array, count: int) -> csr_matrix:
    """(Q, count) of weights (Q, 3) at vertices (Q, 3)."""
    rows = np.repeat(np.arange(len(vertices)), 3)
    return csr_matrix((weights.ravel(), (rows, vertices.ravel())), shape=(len(vertices), count))
