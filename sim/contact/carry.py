"""Where a time step begins: cloth goes along with the collider near it, as a Warp kernel.

A collider that moves first and pushes cloth out of its way afterwards moves by one gap at a time. So cloth
and collider start with a move that hardly changes their distances: with c the motion of the closest point of
the collider, d its distance and u the way that the velocity takes a vertex, the vertex moves by

    p = c + min(1, d / (2 |u - c|)) (u - c),

relative to the collider by no more than half its distance. c alone is the motion to fall back on where two
layers of cloth would meet: vertices near each other share it. Gravity is not in u, since what lies on a body
does not fall.
"""

import numpy as np
import warp as wp
from numpy.typing import NDArray

wp.set_module_options({"enable_backward": False})

NEAR = 0.1
"""Metres within which a vertex goes along; farther ones fly on."""


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
    a = num_cloth + wp.mesh_get_index(mesh, hit.face * 3)
    b = num_cloth + wp.mesh_get_index(mesh, hit.face * 3 + 1)
    c = num_cloth + wp.mesh_get_index(mesh, hit.face * 3 + 2)
    v = wp.float64(hit.u)
    w = wp.float64(hit.v)
    z = wp.float64(1.0) - v - w
    d = wp.length(here - (x[a] * v + x[b] * w + x[c] * z))
    motion = told[a] * v + told[b] * w + told[c] * z
    relative = u - motion
    share = wp.min(wp.float64(1.0), wp.float64(0.5) * d / wp.max(wp.length(relative), wp.float64(1.0e-12)))
    base[i] = motion
    p[i] = motion + relative * share


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
