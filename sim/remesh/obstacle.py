"""A collider as cloth nearby sees it: the nearest point of it, on the CPU."""

import numpy as np
import warp as wp
from numpy.typing import NDArray

CLOSEST = 1e-9
"""Metres. Smaller distances count as this much, along the normal of the face, for they have no direction."""


@wp.kernel(enable_backward=False)
def _query(
    mesh: wp.uint64,
    points: wp.array(dtype=wp.vec3f),
    reach: float,
    face: wp.array(dtype=wp.int32),
    weights: wp.array(dtype=wp.vec3f),
):
    i = wp.tid()
    found = wp.mesh_query_point_no_sign(mesh, points[i], reach)
    face[i] = -1
    if found.result:
        face[i] = found.face
        weights[i] = wp.vec3f(found.u, found.v, 1.0 - found.u - found.v)


class Obstacle:
    """Triangles `faces` (M, 3) over vertices (N, 3), metres, in a tree that moves along with them."""

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.integer]) -> None:
        self.vertices = np.array(vertices, dtype=np.float64)
        self.faces = np.array(faces, dtype=np.int32)
        self._mesh = None
        if len(self.faces):
            points = wp.array(self.vertices, dtype=wp.vec3f, device="cpu")
            indices = wp.array(self.faces.ravel(), dtype=wp.int32, device="cpu")
            self._mesh = wp.Mesh(points, indices, bvh_constructor="sah")

    @property
    def tree(self) -> wp.uint64:
        """What kernels call its tree, for `wp.mesh_query_aabb`; 0 without triangles."""
        return wp.uint64(0) if self._mesh is None else self._mesh.id

    def move(self, vertices: NDArray[np.float64]) -> None:
        """Put the vertices (N, 3) elsewhere; a twentieth of the cost of a new tree."""
        self.vertices = np.array(vertices, dtype=np.float64)
        if self._mesh is not None:
            self._mesh.points.assign(self.vertices.astype(np.float32))
            self._mesh.refit()

    def nearest(
        self, points: NDArray[np.float64], reach: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Unit vectors (Q, 3) from the obstacle's nearest point to each of `points` (Q, 3), and the distances
        (Q,), metres; where nothing is within `reach`, zero and infinity.

        The tree is of single precision: which point is nearest is known to about 1e-7 of the coordinates,
        its place on the face and the distance from there are computed in double precision.
        """
        away, distance = np.zeros((len(points), 3)), np.full(len(points), np.inf)
        if self._mesh is None or not len(points):
            return away, distance
        queries = wp.array(points, dtype=wp.vec3f, device="cpu")
        face = wp.empty(len(points), dtype=wp.int32, device="cpu")
        weights = wp.empty(len(points), dtype=wp.vec3f, device="cpu")
        wp.launch(_query, len(points), [self._mesh.id, queries, reach, face, weights], device="cpu")
        found = np.flatnonzero(face.numpy() >= 0)
        hit = self.vertices[self.faces[face.numpy()[found]]]
        nearest = (weights.numpy()[found].astype(np.float64)[:, :, None] * hit).sum(axis=1)
        away[found] = points[found] - nearest
        distance[found] = np.linalg.norm(away[found], axis=1)
        touching = distance[found] < CLOSEST
        if touching.any():
            corners = hit[touching]
            away[found[touching]] = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            distance[found[touching]] = CLOSEST
        away[found] /= np.linalg.norm(away[found], axis=1)[:, None]
        return away, distance
