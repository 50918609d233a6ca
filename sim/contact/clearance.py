"""Room for cloth where a body cuts into itself: armpits, elbows, crotch.

Between two surfaces of a body that overlap, cloth has no place to be. The collider therefore differs from the
body there, and only there: a vertex whose surroundings along its outward normal are taken by another part of
the body within the gap g is drawn inwards, where cloth is near, by

    s = (g - t) / 2,    t the free distance along the normal, or minus the depth inside another part,

so that the two drawn-in surfaces leave g between them. That is continuous in t: when limbs part, the collider
turns back into the body and the cloth between them comes out on the right side. Where limbs bend, skin is
folded and its normals point anywhere: s is made in parts of at most `STRIDE`, along the normals and by the
free distances that the collider then has, with some smoothing in between.
"""

from typing import NamedTuple

import igl
import numpy as np
import scipy.ndimage
import scipy.sparse
import warp as wp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from muslin.sim.body.interior import CREASE_M, GAP_SHARES, MASK_GAP_M

wp.set_module_options({"enable_backward": False})

ROOM = 4.0e-3
"""Metres of free distance that cloth of fine triangles needs between two parts of a body."""

LIMB = 0.03
"""Radius of a thin limb, metres: cloth is straight along edges, and needs more room the longer they are."""

REACH = 0.08
"""Metres along the normal: free distances, and depths, beyond this are not told apart."""

NEAR_CLOTH = 0.03
"""Metres: where no cloth is this near, and no vertex has further to go, the collider is the body."""

SAME = 1.0e-8
"""Metres below which collider and body do not differ: the rounding of a move that is made in parts."""

SURE = 1.0e-4
"""Metres, along a ray, within which a point counts as on a surface, not inside: rounding decides there."""

PAST = wp.constant(wp.float32(1.0e-4))
"""Metres by which a ray goes on past a surface that it has met: single precision would meet it again."""

FAR = wp.constant(wp.float32(10.0))
"""Metres: nothing of a body is further away."""

MAX_HITS = 24

STRIDE = 6.0e-3
"""Metres by which a vertex is drawn inwards at a time."""

LAST_STRIDE = 1.0e-3
"""Metres: the stride in which no vertex goes further is the last."""

TINY = 1.0e-300
"""Where faces have no area, their vertices have no normal."""

AROUND = 0.01
"""Metres within which positions are averaged: what is smaller than that folds no skin."""

RINGS = 4
"""Edges away at most, for what is within `AROUND` but belongs to another limb."""

SMOOTHING = 0.4
"""Share of the way to the mean of its surroundings that a vertex goes after each stride."""

BESIDE = 0.9
"""Share of `CREASE_M` within which vertices may give way: the verification's test is another one."""


@wp.func
def winding_along(mesh: wp.uint64, origin: wp.vec3, direction: wp.vec3) -> float:
    """Winding number of a closed surface at a point: the signed crossings of a ray from there.

    Zero, as if outside, for points on the surface itself.
    """
    winding = float(0.0)
    travelled = float(0.0)
    for _ in range(MAX_HITS):
        hit = wp.mesh_query_ray(mesh, origin + direction * travelled, direction, FAR)
        if not hit.result:
            break
        if travelled == 0.0 and hit.t < SURE:
            return 0.0
        winding += wp.sign(wp.dot(hit.normal, direction))
        travelled += hit.t + PAST
    return winding


@wp.func
def inside(mesh: wp.uint64, point: wp.vec3) -> bool:
    """Whether a point is inside a closed surface, by two of three rays.

    One may run along an edge, through two faces at once, or meet a surface that is close by.
    """
    first = winding_along(mesh, point, wp.normalize(wp.vec3(0.31, 0.83, 0.46))) > 0.5
    second = winding_along(mesh, point, wp.normalize(wp.vec3(-0.71, -0.22, 0.67))) > 0.5
    if first == second:
        return first
    return winding_along(mesh, point, wp.normalize(wp.vec3(0.52, -0.61, -0.60))) > 0.5


@wp.kernel
def free_distance(
    mesh: wp.uint64,
    points: wp.array(dtype=wp.vec3),
    rows: wp.array(dtype=wp.int32),
    normals: wp.array(dtype=wp.vec3),
    offset: float,
    reach: float,
    out: wp.array(dtype=float),
):
    """t of the vertices `rows`: free distance along their normals, at most `reach`, or minus their depth.

    Whether it is inside is asked `offset` in front of a vertex.
    """
    k = wp.tid()
    point = points[rows[k]]
    n = normals[k]
    out[k] = reach
    front = wp.mesh_query_ray(mesh, point + n * PAST, n, FAR)
    if not front.result:
        # From inside every ray meets the surface.
        return
    if inside(mesh, point + n * offset):
        # No surface behind within reach: a small fold, or a limb that passes right through.
        behind = wp.mesh_query_ray(mesh, point - n * PAST, -n, reach)
        out[k] = -PAST
        if behind.result:
            out[k] = -behind.t
    else:
        out[k] = wp.min(front.t, reach)


@wp.kernel
def faces_with_body_in_front(
    mesh: wp.uint64,
    points: wp.array(dtype=wp.vec3),
    faces: wp.array2d(dtype=wp.int32),
    chosen: wp.array(dtype=wp.int32),
    far: float,
    close: float,
    found: wp.array(dtype=wp.int32),
):
    """found = 1 where a corner or the centroid of a face, `far` or `close` in front of it, is inside."""
    k = wp.tid()
    a = points[faces[chosen[k], 0]]
    b = points[faces[chosen[k], 1]]
    c = points[faces[chosen[k], 2]]
    normal = wp.normalize(wp.cross(b - a, c - a))
    for j in range(int(0), int(8)):
        p = (a + b + c) / 3.0
        if j % 4 == 1:
            p = a
        elif j % 4 == 2:
            p = b
        elif j % 4 == 3:
            p = c
        if inside(mesh, p + normal * wp.where(j < 4, far, close)):
            found[k] = 1
            return


def room_for(rest_area: NDArray[np.float64]) -> float:
    """The gap g, m, that cloth of triangles of such areas, m^2, needs: `ROOM` + L^2 / (8 `LIMB`).

    The second term is the height of an arc of that radius over an edge of the mean length L.
    """
    return ROOM + 4.0 / np.sqrt(3.0) * float(rest_area.mean()) / (8.0 * LIMB)


class Collider(NamedTuple):
    """Vertices (N, 3) of a collider, metres, and which of them, (N,), may give way to cloth."""

    vertices: NDArray[np.float64]
    yielding: NDArray[np.bool_]


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
        self._triangles = wp.array(faces, dtype=wp.int32, ndim=2, device=device)
        self._mesh = wp.Mesh(self._points, self._triangles.flatten())
        self._average = _mean_within(vertices, faces.astype(np.int64), AROUND)
        corners = (faces.ravel(), np.repeat(np.arange(len(faces)), 3))
        self._faces_around = scipy.sparse.csr_array(
            (np.ones(faces.size), corners), shape=(len(vertices), len(faces))
        )

    def collider(
        self,
        vertices: NDArray[np.float64],
        cloth: NDArray[np.float64],
        standing: NDArray[np.float64] | None = None,
        share: float = 1.0,
    ) -> Collider:
        """The collider of a body (N, 3) in one pose, for a cloth (V, 3) near it, metres.

        A vertex moves only if there is cloth near it, and every face around it has the body in front. It may
        give way if it has moved, or if every face around it is at a crease: the faces on which collider and
        body then differ may be masked, `muslin.sim.body.interior.masked_face_is_interior`.
        `standing` (N, 3): where the vertices are while the cloth is at `cloth`, if not at `vertices`; a body
        that moves faster than `NEAR_CLOTH` a step would otherwise be out of reach of its own clothes.
        `share` of the room is left.
        """
        room = share * self.room
        beside = vertices if standing is None else standing
        far = NEAR_CLOTH + 0.5 * (room + REACH)
        near = np.flatnonzero(_in_reach(beside, cloth, far))
        free = np.full(len(vertices), REACH)
        free[near] = self._free_distance(vertices, near, self._faces_around[near])
        moved = free < room
        crowded = np.flatnonzero(moved)
        distance, _ = cKDTree(cloth).query(beside[crowded], distance_upper_bound=far)
        # Those with far to go must have gone before the cloth comes.
        moved[crowded[distance > NEAR_CLOTH + 0.5 * (room - free[crowded])]] = False
        faces = np.flatnonzero(moved[self.faces].any(axis=1))
        exposed = faces[~self._have_body_in_front(faces)]
        moved[self.faces[exposed].ravel()] = False
        yielding = moved | self._at_creases(vertices, np.flatnonzero(free < 0.0))
        return Collider(self._drawn_in(vertices, np.flatnonzero(moved), free[moved], room), yielding)

    def _drawn_in(
        self, vertices: NDArray[np.float64], rows: NDArray[np.intp], free: NDArray[np.float64], room: float
    ) -> NDArray[np.float64]:
        """`vertices` (N, 3), those of `rows` (K,), with `free` (K,) before them, drawn in to leave `room`."""
        if len(rows) == 0:
            return vertices
        x = vertices.copy()
        average, around = self._average[rows], self._faces_around[rows]
        strides = 2 + int(np.ceil(0.5 * (room - free.min()) / STRIDE))
        for _ in range(strides):
            inwards = np.clip(0.5 * (room - free), 0.0, STRIDE)
            x[rows] -= inwards[:, None] * self._normals(x, around)
            x[rows] += SMOOTHING * (average @ x - x[rows])
            if inwards.max() < LAST_STRIDE:
                break
            free = self._free_distance(x, rows, around)
        return x

    def _at_creases(self, vertices: NDArray[np.float64], inside: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Which vertices (N,) have only faces with a corner close to one of those `inside` the body."""
        if len(inside) == 0:
            return np.zeros(len(vertices), bool)
        distance, _ = cKDTree(vertices[inside]).query(vertices, distance_upper_bound=BESIDE * CREASE_M)
        close = np.isfinite(distance)
        found = np.ones(len(vertices), bool)
        found[self.faces[~close[self.faces].any(axis=1)].ravel()] = False
        return found

    def _have_body_in_front(self, faces: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Whether each of `faces` (K,) has, of the body as it is in the mesh."""
        found = wp.zeros(len(faces), dtype=wp.int32, device=self.device)
        chosen = wp.array(faces, dtype=wp.int32, device=self.device)
        gaps = [share * MASK_GAP_M for share in GAP_SHARES]
        args = [self._mesh.id, self._points, self._triangles, chosen, *gaps, found]
        wp.launch(faces_with_body_in_front, len(faces), args, device=self.device)
        return found.numpy() > 0

    def changed_faces(
        self, vertices: NDArray[np.float64], collider: NDArray[np.float64]
    ) -> NDArray[np.int32]:
        """Indices of the faces on which `collider` (N, 3) differs from the body."""
        moved = (np.abs(vertices - collider) > SAME).any(axis=1)
        return np.flatnonzero(moved[self.faces].any(axis=1)).astype(np.int32)

    def _free_distance(
        self, vertices: NDArray[np.float64], rows: NDArray[np.intp], around: scipy.sparse.csr_array
    ) -> NDArray[np.float64]:
        """t (K,) of `rows` (K,), which have the faces `around`, on a body (N, 3); metres."""
        self._points.assign(vertices.astype(np.float32))
        self._mesh.refit()
        free = wp.zeros(len(rows), dtype=float, device=self.device)
        chosen = wp.array(rows, dtype=wp.int32, device=self.device)
        normals = wp.array(self._normals(vertices, around), dtype=wp.vec3, device=self.device)
        offset = GAP_SHARES[-1] * MASK_GAP_M
        args = [self._mesh.id, self._points, chosen, normals, offset, REACH, free]
        wp.launch(free_distance, len(rows), args, device=self.device)
        return free.numpy().astype(np.float64)

    def _normals(self, vertices: NDArray[np.float64], around: scipy.sparse.csr_array) -> NDArray[np.float64]:
        """Normals (K, 3), by area, of the vertices that have the faces `around`, (K, M)."""
        used, column = np.unique(around.indices, return_inverse=True)
        a, b, c = vertices[self.faces[used]].swapaxes(0, 1)
        near = scipy.sparse.csr_array(
            (around.data, column, around.indptr), shape=(around.shape[0], len(used))
        )
        normals = near @ np.cross(b - a, c - a)
        return normals / (np.linalg.norm(normals, axis=1, keepdims=True) + TINY)


def _in_reach(points: NDArray[np.float64], cloth: NDArray[np.float64], reach: float) -> NDArray[np.bool_]:
    """Which `points` (P, 3) are in a cell, of side `reach` / 3, at most three from one with `cloth` (V, 3).

    All that are within `reach`, and some more.
    """
    low, side = cloth.min(axis=0), reach / 3.0
    occupied = np.floor((cloth - low) / side).astype(np.int64) + 3
    grid = np.zeros(occupied.max(axis=0) + 4, dtype=bool)
    grid[tuple(occupied.T)] = True
    grid = scipy.ndimage.maximum_filter(grid, 7)
    cells = np.floor((points - low) / side).astype(np.int64) + 3
    within = ((cells >= 0) & (cells < grid.shape)).all(axis=1)
    within[within] = grid[tuple(cells[within].T)]
    return within


def _mean_within(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], radius: float
) -> scipy.sparse.csr_array:
    """Mean (N, N), by area, over each vertex, its neighbours, and those within `radius` m and `RINGS`."""
    own = np.arange(len(vertices))
    edges = igl.edges(faces)
    rows, columns = np.concatenate([edges, edges[:, ::-1], np.column_stack([own, own])]).T
    ring = scipy.sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=(len(own), len(own)))
    around = ring
    for _ in range(RINGS - 1):
        around = ring @ around
    here, there = around.nonzero()
    close = np.linalg.norm(vertices[here] - vertices[there], axis=1) < radius
    rows, columns = np.concatenate([rows, here[close]]), np.concatenate([columns, there[close]])
    area = igl.massmatrix(vertices, faces, igl.MASSMATRIX_TYPE_BARYCENTRIC).diagonal()
    weight = scipy.sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=ring.shape)
    weight = (weight > 0.0) @ scipy.sparse.diags_array(area)
    return scipy.sparse.csr_array(scipy.sparse.diags_array(1.0 / weight.sum(axis=1)) @ weight)
