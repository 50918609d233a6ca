"""Room for cloth where a body cuts into itself: armpits, elbows, crotch.

Between two surfaces of a body that overlap, cloth has no place to be. The collider therefore differs from the
body there, and only there: a vertex whose surroundings along its outward normal are taken by another part of
the body within the gap g is drawn inwards, where cloth is near,

    s = (g - t) / 2 for 0 <= t < g,     s = g / 2 + depth for a vertex inside another part (t = -depth < 0),

t the free distance along the normal, so that the two drawn-in surfaces leave g + depth between
them. The displacement is continuous in t: when limbs part, the collider turns back into the body and the
cloth between them comes out on the right side. In a crease the ray that measures the depth may run along the
other part and meet it far away: s grows by no more than the way along the surface, `STEEPEST`, at which
surfaces that cut each other at a right angle part. Faces of the body with a vertex so moved are the masked
faces of the frame.
"""

import igl
import numpy as np
import scipy.sparse
import warp as wp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from muslin.sim.body.interior import MASK_GAP_M

wp.set_module_options({"enable_backward": False})

ROOM = 4.0e-3
"""Metres of free distance that cloth of fine triangles needs between two parts of a body."""

LIMB = 0.03
"""Radius of a thin limb, metres: cloth is straight along edges, and needs more room the longer they are."""

REACH = 0.08
"""Metres: overlaps deeper than this are no soft contact but limbs that pass through the body."""

NEAR_CLOTH = 0.03
"""Metres: where no cloth is this near, the collider is the body."""

SAME = 1.0e-8
"""Metres below which collider and body do not differ: the rounding of a move that is made in parts."""

SURE = 1.0e-4
"""Metres, along a ray, within which a point counts as on a surface, not inside: rounding decides there."""

PAST = wp.constant(wp.float32(1.0e-4))
"""Metres by which a ray goes on past a surface that it has met: single precision would meet it again."""

MAX_HITS = 12

STEEPEST = 1.0
"""Most that the displacement may grow per metre along the surface."""


@wp.kernel
def free_distance(
    mesh: wp.uint64,
    points: wp.array(dtype=wp.vec3),
    normals: wp.array(dtype=wp.vec3),
    near: wp.array(dtype=wp.int32),
    gap: float,
    reach: float,
    out: wp.array(dtype=float),
):
    """t of each vertex: free distance along its normal, at most `reach`; minus its depth if inside.

    Those not `near` are not looked at: `reach`.
    """
    i = wp.tid()
    if near[i] == 0:
        out[i] = reach
        return
    n = normals[i]
    origin = points[i] + n * PAST
    # The signed crossings of a ray from a point to infinity are the winding number there.
    winding = float(0.0)
    first = reach
    travelled = float(0.0)
    for _ in range(MAX_HITS):
        hit = wp.mesh_query_ray(mesh, origin + n * travelled, n, 10.0)
        if not hit.result:
            break
        if wp.dot(hit.normal, n) > 0.0:
            winding += 1.0
        else:
            winding -= 1.0
            if winding < 0.0 and first == reach:
                first = travelled + hit.t
        travelled += hit.t + PAST
    if winding > 0.5:
        back = wp.mesh_query_ray(mesh, points[i] - n * PAST, -n, reach)
        # No other surface behind within reach: the count of crossings erred, or a limb passes right through.
        depth = -reach
        if back.result:
            depth = back.t
        out[i] = -depth
    else:
        out[i] = wp.min(first, reach)


def differs(vertices: NDArray[np.float64], collider: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which vertices (N,) of the collider are elsewhere than those of the body."""
    moved = np.abs(vertices - collider) > SAME
    return np.asarray(moved.any(axis=1))


def room_for(rest_area: NDArray[np.float64]) -> float:
    """The gap g, m, that cloth of triangles of such areas, m^2, needs: `ROOM` + L^2 / (8 `LIMB`).

    The second term is the height of an arc of that radius over an edge of the mean length L.
    """
    return ROOM + 4.0 / np.sqrt(3.0) * float(rest_area.mean()) / (8.0 * LIMB)


@wp.func
def winding_along(mesh: wp.uint64, origin: wp.vec3, direction: wp.vec3) -> float:
    """Winding number of a closed surface at a point: the signed crossings of a ray from there.

    Zero, as if outside, for points on the surface itself.
    """
    winding = float(0.0)
    travelled = float(0.0)
    for _ in range(2 * MAX_HITS):
        hit = wp.mesh_query_ray(mesh, origin + direction * travelled, direction, 10.0)
        if not hit.result:
            break
        if travelled == 0.0 and hit.t < SURE:
            return 0.0
        winding += wp.sign(wp.dot(hit.normal, direction))
        travelled += hit.t + PAST
    return winding


@wp.kernel
def faces_with_body_in_front(
    mesh: wp.uint64,
    points: wp.array(dtype=wp.vec3),
    faces: wp.array2d(dtype=wp.int32),
    chosen: wp.array(dtype=wp.int32),
    gap: float,
    found: wp.array(dtype=wp.int32),
):
    """found = 1 where a corner or the centroid of a face, moved by `gap` along its normal, is inside.

    By two opposite rays that must agree: one may run along an edge or through two faces at once, and one
    meets a surface that is close by.
    """
    k = wp.tid()
    a = points[faces[chosen[k], 0]]
    b = points[faces[chosen[k], 1]]
    c = points[faces[chosen[k], 2]]
    front = wp.normalize(wp.cross(b - a, c - a)) * gap
    way = wp.normalize(wp.vec3(0.31, 0.83, 0.46))
    for j in range(int(0), int(4)):
        p = (a + b + c) / 3.0
        if j == 1:
            p = a
        elif j == 2:
            p = b
        elif j == 3:
            p = c
        p += front
        if winding_along(mesh, p, way) > 0.5 and winding_along(mesh, p, -way) > 0.5:
            found[k] = 1
            return


class SelfClearance:
    """Turns a body into its collider, frame by frame.

    `faces` (M, 3) must bound a closed body; `room` is the gap g, metres.
    """

    def __init__(
        self, vertices: NDArray[np.float64], faces: NDArray[np.int32], device: str, room: float = ROOM
    ) -> None:
        self.faces = faces
        self.room = room
        self.device = device
        self._points = wp.array(vertices.astype(np.float32), dtype=wp.vec3, device=device)
        self._normals = wp.zeros(len(vertices), dtype=wp.vec3, device=device)
        self._near = wp.zeros(len(vertices), dtype=wp.int32, device=device)
        self._free = wp.zeros(len(vertices), dtype=float, device=device)
        self._triangles = wp.array(faces, dtype=wp.int32, ndim=2, device=device)
        self._mesh = wp.Mesh(self._points, self._triangles.flatten())
        self._edges = igl.edges(faces.astype(np.int64))
        adjacency = igl.adjacency_matrix(faces.astype(np.int64)).astype(np.float64)
        degree = scipy.sparse.diags_array(1.0 / np.asarray(adjacency.sum(axis=1)).ravel())
        self._average = degree @ adjacency

    def collider(
        self,
        vertices: NDArray[np.float64],
        cloth: NDArray[np.float64],
        standing: NDArray[np.float64] | None = None,
    ) -> NDArray[np.float64]:
        """Vertices (N, 3) of the collider of a body in one pose, for a cloth (V, 3) near it, metres.

        A vertex moves only if there is cloth near it, and every face around it has the body in front. So the
        faces on which collider and body differ may be masked:
        `muslin.sim.body.interior.masked_face_is_interior`.
        `standing` (N, 3): where the vertices are while the cloth is at `cloth`, if not at `vertices`; a body
        that moves faster than `NEAR_CLOTH` a step would otherwise be out of reach of its own clothes.
        """
        beside = vertices if standing is None else standing
        around = (beside > cloth.min(axis=0) - NEAR_CLOTH) & (beside < cloth.max(axis=0) + NEAR_CLOTH)
        near = around.all(axis=1)
        normals = igl.per_vertex_normals(vertices, self.faces.astype(np.int64))
        free = self._free_distance(vertices, normals, near)
        inwards = np.where(free < 0.0, 0.5 * self.room - free, 0.5 * np.maximum(self.room - free, 0.0))
        self._flatten(inwards, vertices, near)
        moved = inwards > 0.0
        crowded = np.flatnonzero(moved)
        distance, _ = cKDTree(cloth).query(beside[crowded], distance_upper_bound=NEAR_CLOTH)
        moved[crowded[~np.isfinite(distance)]] = False
        faces = np.flatnonzero(moved[self.faces].any(axis=1))
        if len(faces) == 0:
            return vertices
        exposed = faces[~self._have_body_in_front(faces)]
        moved[self.faces[exposed].ravel()] = False
        inwards = np.where(moved, inwards, 0.0)
        for _ in range(3):
            inwards = np.where(moved, np.maximum(inwards, self._average @ inwards), 0.0)
        return vertices - inwards[:, None] * normals

    def _have_body_in_front(self, faces: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Whether each of `faces` (K,) has, of the body as it is in the mesh."""
        found = wp.zeros(len(faces), dtype=wp.int32, device=self.device)
        chosen = wp.array(faces, dtype=wp.int32, device=self.device)
        args = [self._mesh.id, self._points, self._triangles, chosen, MASK_GAP_M, found]
        wp.launch(faces_with_body_in_front, len(faces), args, device=self.device)
        return found.numpy() > 0

    def _flatten(
        self, inwards: NDArray[np.float64], vertices: NDArray[np.float64], near: NDArray[np.bool_]
    ) -> None:
        """Lower `inwards` (N,) to the largest function below it that is nowhere steeper than `STEEPEST`.

        Between vertices that are `near` (N,): of the others nothing is known.
        """
        edges = self._edges[(inwards[self._edges] > 0.0).any(axis=1) & near[self._edges].all(axis=1)]
        rise = STEEPEST * np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
        here, there = np.concatenate([edges, edges[:, ::-1]]).T
        rise = np.concatenate([rise, rise])
        while True:
            allowed = inwards[there] + rise
            if (inwards[here] <= allowed + SAME).all():
                return
            np.minimum.at(inwards, here, allowed)

    def masked_faces(self, vertices: NDArray[np.float64], collider: NDArray[np.float64]) -> NDArray[np.int32]:
        """Indices of the faces on which `collider` differs from the body."""
        moved = differs(vertices, collider)
        return np.flatnonzero(moved[self.faces].any(axis=1)).astype(np.int32)

    def _free_distance(
        self, vertices: NDArray[np.float64], normals: NDArray[np.float64], near: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        """t (N,) of the vertices `near` (N,), metres; `REACH` for the others."""
        self._points.assign(vertices.astype(np.float32))
        self._normals.assign(normals.astype(np.float32))
        self._mesh.refit()
        self._near.assign(near.astype(np.int32))
        args = [self._mesh.id, self._points, self._normals, self._near, self.room, REACH, self._free]
        wp.launch(free_distance, len(vertices), args, device=self.device)
        return self._free.numpy().astype(np.float64)
