"""Whether a triangle that remeshing would make keeps clear of everything else.

Checked against the surface as it was before any change, and the body. Let an operation and those before it in
the same place move the surface by up to d, and demand that its triangles stay 2 d + s away from the old
surface elsewhere. Then two new triangles with d1, d2 stay apart: their distance D is at least 2 d1 + s - d2
and 2 d2 + s - d1, since each lies within its d of the old surface, so 2 D >= d1 + d2 + 2 s > 0. Old faces
that lie under the triangle or next to it, nearer than twice the margin in panel space, are left out: a
surface touches itself there. Among those it must not cross the faces around its corners (`local_crossing`),
nor turn much (`turns_little`).
"""

import numpy as np
import warp as wp
from numpy.typing import NDArray

from muslin.sim.contact.distance import pair_distance

wp.set_module_options({"enable_backward": False})

LEAST = wp.constant(wp.float64(2.0e-4))  # s, metres
SINGLE = wp.constant(1.0e-5)  # metres
LEAST_TURN = wp.constant(wp.float64(0.5))  # cosine of the largest angle between a new face and the old ones


@wp.struct
class Surroundings:
    """The cloth before remeshing, in the world and in panel space, and the body, with trees over their
    triangles."""

    x: wp.array(dtype=wp.vec3d)
    faces: wp.array2d(dtype=wp.int32)
    point: wp.array(dtype=wp.vec2d)
    panel_faces: wp.array2d(dtype=wp.int32)
    panel: wp.array(dtype=wp.int32)
    tree: wp.uint64
    body_x: wp.array(dtype=wp.vec3d)
    body_faces: wp.array2d(dtype=wp.int32)
    body_tree: wp.uint64


@wp.struct
class Place:
    """Where a new triangle lies in panel space: corners, old faces in or near which they are, panel."""

    a: wp.vec2d
    b: wp.vec2d
    c: wp.vec2d
    home: wp.vec3i
    panel: int


class Tree:
    """Boxes around triangles, in a hierarchy; keep it as long as its `id` is used."""

    def __init__(self, positions: NDArray[np.float64], faces: NDArray[np.int32]) -> None:
        corners = positions[faces]
        # In single precision, each box a little larger than its triangle.
        slack = 1e-6 * (1.0 + np.abs(corners).max(initial=0.0))
        low, high = (
            (corners.min(axis=1) - slack).astype(np.float32),
            (corners.max(axis=1) + slack).astype(np.float32),
        )
        self._bounds = [wp.array(bound, dtype=wp.vec3, device="cpu") for bound in (low, high)]
        self._bvh = wp.Bvh(*self._bounds) if len(faces) else None

    @property
    def id(self) -> wp.uint64:
        """What kernels call it; 0 for a tree without triangles."""
        return wp.uint64(0) if self._bvh is None else self._bvh.id


@wp.func
def pierces(p: wp.vec3d, q: wp.vec3d, a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> bool:
    """Whether the segment p-q passes through the triangle a, b, c."""
    none = wp.float64(0.0)
    n = wp.cross(b - a, c - a)
    above, below = wp.dot(n, p - a), wp.dot(n, q - a)
    if above * below > none or above == below:
        return False
    x = p + (q - p) * (above / (above - below))
    u, v = wp.dot(n, wp.cross(b - a, x - a)), wp.dot(n, wp.cross(c - b, x - b))
    return u >= none and v >= none and wp.dot(n, wp.cross(a - c, x - c)) >= none


@wp.func
def triangles_within(
    a: wp.vec3d, b: wp.vec3d, c: wp.vec3d, p: wp.vec3d, q: wp.vec3d, r: wp.vec3d, d: wp.float64
) -> bool:
    """Whether two triangles cross or come nearer than d: by edges through either, and all fifteen pairs of a
    vertex and a face or two edges."""
    if pierces(a, b, p, q, r) or pierces(b, c, p, q, r) or pierces(c, a, p, q, r):
        return True
    if pierces(p, q, a, b, c) or pierces(q, r, a, b, c) or pierces(r, p, a, b, c):
        return True
    if pair_distance(False, a, p, q, r) < d or pair_distance(False, b, p, q, r) < d:
        return True
    if pair_distance(False, c, p, q, r) < d or pair_distance(False, p, a, b, c) < d:
        return True
    if pair_distance(False, q, a, b, c) < d or pair_distance(False, r, a, b, c) < d:
        return True
    return edge_within(a, b, p, q, r, d) or edge_within(b, c, p, q, r, d) or edge_within(c, a, p, q, r, d)


@wp.func
def edge_within(a: wp.vec3d, b: wp.vec3d, p: wp.vec3d, q: wp.vec3d, r: wp.vec3d, d: wp.float64) -> bool:
    """Whether an edge comes nearer than d to one of a triangle."""
    if pair_distance(True, a, b, p, q) < d or pair_distance(True, a, b, q, r) < d:
        return True
    return pair_distance(True, a, b, r, p) < d


@wp.func
def shares_vertex(faces: wp.array2d(dtype=wp.int32), f: int, g: int) -> bool:
    """Whether two faces have a vertex in common, or are one."""
    for i in range(3):
        for j in range(3):
            if faces[f, i] == faces[g, j]:
                return True
    return False


@wp.func
def is_beyond_seam(around: Surroundings, f: int, g: int) -> bool:
    """Whether two faces have a sewn vertex in common, but other copies of it."""
    for i in range(3):
        for j in range(3):
            if (
                around.faces[f, i] == around.faces[g, j]
                and around.panel_faces[f, i] != around.panel_faces[g, j]
            ):
                return True
    return False


@wp.func
def flat(p: wp.vec2d) -> wp.vec3d:
    """A point of panel space as one of a plane in space."""
    return wp.vec3d(p[0], p[1], wp.float64(0.0))


@wp.func
def lies_next_to(around: Surroundings, place: Place, f: int, reach: wp.float64) -> bool:
    """Whether an old face near the corners of a triangle lies under it, or nearer than `reach` in panel
    space; beyond a seam, of this panel or another, it does."""
    near = shares_vertex(around.faces, f, place.home[0]) or shares_vertex(around.faces, f, place.home[1])
    if not near and not shares_vertex(around.faces, f, place.home[2]):
        return False
    if around.panel[f] != place.panel:
        return True
    for k in range(3):
        if is_beyond_seam(around, f, place.home[k]):
            return True
    p = flat(around.point[around.panel_faces[f, 0]])
    q = flat(around.point[around.panel_faces[f, 1]])
    r = flat(around.point[around.panel_faces[f, 2]])
    return triangles_within(flat(place.a), flat(place.b), flat(place.c), p, q, r, reach)


@wp.func
def is_clear(
    around: Surroundings, a: wp.vec3d, b: wp.vec3d, c: wp.vec3d, place: Place, moved: wp.float64
) -> bool:
    """Whether the triangle a, b, c at `place`, of an operation that moves the surface by `moved`, keeps clear
    of the body and of all old faces but those that it lies on or next to."""
    margin = wp.float64(2.0) * moved + LEAST
    reach = wp.vec3d(margin, margin, margin)
    low = wp.vec3(wp.min(wp.min(a, b), c) - reach)
    high = wp.vec3(wp.max(wp.max(a, b), c) + reach)
    f = int(0)
    query = wp.bvh_query_aabb(around.tree, low, high)
    while wp.bvh_query_next(query, f):
        p = around.x[around.faces[f, 0]]
        q = around.x[around.faces[f, 1]]
        r = around.x[around.faces[f, 2]]
        far = wp.float64(2.0) * margin
        if triangles_within(a, b, c, p, q, r, margin) and not lies_next_to(around, place, f, far):
            return False
    if around.body_tree != wp.uint64(0):
        # Its tree holds vertices in single precision, off by a ten-millionth of their coordinates.
        slack = wp.vec3(SINGLE, SINGLE, SINGLE)
        in_box = wp.mesh_query_aabb(around.body_tree, low - slack, high + slack)
        while wp.mesh_query_aabb_next(in_box, f):
            p = around.body_x[around.body_faces[f, 0]]
            q = around.body_x[around.body_faces[f, 1]]
            r = around.body_x[around.body_faces[f, 2]]
            # The body does not change: `LEAST` is enough.
            if triangles_within(a, b, c, p, q, r, LEAST):
                return False
    return True


@wp.func
def turns_little(old: wp.vec3d, new: wp.vec3d) -> bool:
    """Whether the normal of a new face is within 60 degrees of that of what it replaces, so that neighbouring
    faces do not fold over each other."""
    return wp.dot(old, new) >= LEAST_TURN * wp.length(old) * wp.length(new)
