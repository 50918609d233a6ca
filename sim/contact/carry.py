"""Where a time step begins: cloth goes along with the collider near it, as a Warp kernel.

A collider that moves first and pushes cloth out of its way afterwards moves by one gap at a time. So cloth
and collider start with a move that hardly changes their distances. With c1 the motion of the collider's
closest point and d1 its distance, c2 and d2 the same for the closest point on the opposite side of the
vertex, where there is one within `NEAR_OPPOSITE`,

    c = (d2 c1 + d1 c2) / (d1 + d2)

keeps the ratio of the two distances: between two walls that do not meet, it is always free. With u the way
that its velocity takes the vertex, it moves by

    p = c + min(1, d1 / (2 |u - c|)) (u - c),

relative to the collider by no more than half its distance. c alone is the motion to fall back on where two
layers of cloth would meet: vertices near each other share it. Gravity is not in u, since what lies on a body
does not fall.
"""

import numpy as np
import warp as wp
from numpy.typing import NDArray

from muslin.sim.contact.distance import point_triangle_weights

wp.set_module_options({"enable_backward": False})

NEAR = 0.1
"""Metres within which a vertex goes along; farther ones fly on."""

NEAR_OPPOSITE = 0.015
"""Metres within which the opposite side counts."""


@wp.func
def face_motion(
    mesh: wp.uint64,
    face: int,
    num_cloth: int,
    here: wp.vec3d,
    x: wp.array(dtype=wp.vec3d),
    told: wp.array(dtype=wp.vec3d),
    motion: wp.array(dtype=wp.vec3d),
    i: int,
) -> wp.vec3d:
    """Vector from a point to the closest one of a face, whose motion goes to motion[i]."""
    a = num_cloth + wp.mesh_get_index(mesh, face * 3)
    b = num_cloth + wp.mesh_get_index(mesh, face * 3 + 1)
    c = num_cloth + wp.mesh_get_index(mesh, face * 3 + 2)
    w = point_triangle_weights(here, x[a], x[b], x[c])
    motion[i] = -(told[a] * w[1] + told[b] * w[2] + told[c] * w[3])
    return -(here + x[a] * w[1] + x[b] * w[2] + x[c] * w[3])


@wp.kernel
def carried_moves(
    mesh: wp.uint64,
    x: wp.array(dtype=wp.vec3d),
    told: wp.array(dtype=wp.vec3d),
    free: wp.array(dtype=wp.vec3d),
    num_cloth: int,
    base: wp.array(dtype=wp.vec3d),
    p: wp.array(dtype=wp.vec3d),
):
    """base = c, p as above for cloth vertices, both `told` (V + N,) for those of the collider.

    `free` (V,): where its velocity takes each vertex, metres.
    """
    i = wp.tid()
    if i >= num_cloth:
        base[i] = told[i]
        p[i] = told[i]
        return
    here = x[i]
    u = free[i] - here
    base[i] = u
    p[i] = u
    point = wp.vec3(wp.float32(here[0]), wp.float32(here[1]), wp.float32(here[2]))
    hit = wp.mesh_query_point_no_sign(mesh, point, NEAR)
    if not hit.result:
        return
    towards = face_motion(mesh, hit.face, num_cloth, here, x, told, base, i)
    d = wp.length(towards)
    c = base[i]
    if d < wp.float64(NEAR_OPPOSITE):
        nearest = wp.float64(NEAR_OPPOSITE)
        side = wp.vec3(wp.float32(towards[0]), wp.float32(towards[1]), wp.float32(towards[2]))
        around = wp.vec3(1.0, 1.0, 1.0) * wp.float32(NEAR_OPPOSITE)
        query = wp.mesh_query_aabb(mesh, point - around, point + around)
        f = int(0)
        c2 = c
        while wp.mesh_query_aabb_next(query, f):
            a = wp.mesh_get_point(mesh, f * 3)
            if wp.dot(a - point, side) < 0.0:
                r = face_motion(mesh, f, num_cloth, here, x, told, base, i)
                if wp.dot(r, towards) < wp.float64(0.0) and wp.length(r) < nearest:
                    nearest = wp.length(r)
                    c2 = base[i]
        if nearest < wp.float64(NEAR_OPPOSITE):
            c = (c * nearest + c2 * d) / (d + nearest)
    relative = u - c
    share = wp.min(wp.float64(1.0), wp.float64(0.5) * d / wp.max(wp.length(relative), wp.float64(1.0e-12)))
    base[i] = c
    p[i] = c + relative * share


class Carry:
    """The collider's surface of `faces` (M, 3), asked for the motion of its closest points."""

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int32], device: str) -> None:
        self.device = device
        self._points = wp.array(vertices.astype(np.float32), dtype=wp.vec3, device=device)
        indices = wp.array(faces.ravel(), dtype=wp.int32, device=device)
        self._mesh = wp.Mesh(self._points, indices)

    def moves(self, x: wp.array, told: wp.array, free: wp.array, base: wp.array, p: wp.array) -> None:
        """Fill `base` and `p` (V + N,) for cloth and collider at `x`; see the head of this file."""
        num_cloth = len(free)
        self._points.assign(x.numpy()[num_cloth:].astype(np.float32))
        self._mesh.refit()
        args = [self._mesh.id, x, told, free, num_cloth, base, p]
        wp.launch(carried_moves, len(x), args, device=self.device)
