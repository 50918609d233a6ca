"""Candidate pairs whose swept, inflated boxes overlap, as Warp kernels.

Vertices of the cloth come first in the joint array X, collider vertices after them. Every pair has at least
one cloth vertex; pairs that share a vertex are left out, as are collider primitives that are switched off.
Boxes are float32 and padded outwards by more than their rounding.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})

PADDING = 1.0e-5
"""Metres added to every box against float32 rounding; holds for scenes within 50 m of the origin."""


@wp.func
def box_low(a: wp.vec3d, b: wp.vec3d) -> wp.vec3d:
    return wp.vec3d(wp.min(a[0], b[0]), wp.min(a[1], b[1]), wp.min(a[2], b[2]))


@wp.func
def box_high(a: wp.vec3d, b: wp.vec3d) -> wp.vec3d:
    return wp.vec3d(wp.max(a[0], b[0]), wp.max(a[1], b[1]), wp.max(a[2], b[2]))


@wp.func
def to_single(a: wp.vec3d, pad: wp.float64) -> wp.vec3:
    return wp.vec3(wp.float32(a[0] + pad), wp.float32(a[1] + pad), wp.float32(a[2] + pad))


@wp.kernel
def sweep_vertices(
    x: wp.array(dtype=wp.vec3d),
    p: wp.array(dtype=wp.vec3d),
    shift: wp.vec3d,
    low: wp.array(dtype=wp.vec3d),
    high: wp.array(dtype=wp.vec3d),
):
    """Box of each vertex from x to x + p - shift.

    Whether two points come together does not depend on a motion they share, so the sweep may leave one out.
    """
    i = wp.tid()
    a = x[i]
    b = a + p[i] - shift
    low[i] = box_low(a, b)
    high[i] = box_high(a, b)


@wp.kernel
def element_bounds(
    elements: wp.array2d(dtype=wp.int32),
    vertex_low: wp.array(dtype=wp.vec3d),
    vertex_high: wp.array(dtype=wp.vec3d),
    low: wp.array(dtype=wp.vec3),
    high: wp.array(dtype=wp.vec3),
):
    """Box of each triangle or edge."""
    i = wp.tid()
    a = vertex_low[elements[i, 0]]
    b = vertex_high[elements[i, 0]]
    for k in range(1, elements.shape[1]):
        a = box_low(a, vertex_low[elements[i, k]])
        b = box_high(b, vertex_high[elements[i, k]])
    pad = wp.float64(PADDING)
    low[i] = to_single(a, -pad)
    high[i] = to_single(b, pad)


@wp.kernel
def vertex_face_candidates(
    bvh: wp.uint64,
    vertices: wp.array(dtype=wp.int32),
    faces: wp.array2d(dtype=wp.int32),
    vertex_on: wp.array(dtype=wp.int32),
    face_on: wp.array(dtype=wp.int32),
    vertex_low: wp.array(dtype=wp.vec3d),
    vertex_high: wp.array(dtype=wp.vec3d),
    region_low: wp.vec3d,
    region_high: wp.vec3d,
    radius: wp.float64,
    count: wp.array(dtype=wp.int32),
    pairs: wp.array(dtype=wp.vec4i),
):
    """Appends (vertex, face) candidates as (p, a, b, c); `count` goes on past the capacity of `pairs`."""
    i = wp.tid()
    v = vertices[i]
    if vertex_on[v] == 0:
        return
    low = vertex_low[v]
    high = vertex_high[v]
    for k in range(3):
        if low[k] > region_high[k] or high[k] < region_low[k]:
            return
    query = wp.bvh_query_aabb(bvh, to_single(low, -radius), to_single(high, radius))
    f = int(0)
    while wp.bvh_query_next(query, f):
        if face_on[f] == 0:
            continue
        a = faces[f, 0]
        b = faces[f, 1]
        c = faces[f, 2]
        if a == v or b == v or c == v:
            continue
        slot = wp.atomic_add(count, 0, 1)
        if slot < pairs.shape[0]:
            pairs[slot] = wp.vec4i(v, a, b, c)


@wp.kernel
def edge_edge_candidates(
    bvh: wp.uint64,
    queries: wp.array2d(dtype=wp.int32),
    edges: wp.array2d(dtype=wp.int32),
    edge_on: wp.array(dtype=wp.int32),
    same_set: int,
    vertex_low: wp.array(dtype=wp.vec3d),
    vertex_high: wp.array(dtype=wp.vec3d),
    radius: wp.float64,
    count: wp.array(dtype=wp.int32),
    pairs: wp.array(dtype=wp.vec4i),
):
    """Appends (edge, edge) candidates as (a0, a1, b0, b1); with `same_set` each pair once."""
    i = wp.tid()
    a0 = queries[i, 0]
    a1 = queries[i, 1]
    low = box_low(vertex_low[a0], vertex_low[a1])
    high = box_high(vertex_high[a0], vertex_high[a1])
    query = wp.bvh_query_aabb(bvh, to_single(low, -radius), to_single(high, radius))
    e = int(0)
    while wp.bvh_query_next(query, e):
        if edge_on[e] == 0:
            continue
        if same_set == 1 and e <= i:
            continue
        b0 = edges[e, 0]
        b1 = edges[e, 1]
        if a0 == b0 or a0 == b1 or a1 == b0 or a1 == b1:
            continue
        slot = wp.atomic_add(count, 0, 1)
        if slot < pairs.shape[0]:
            pairs[slot] = wp.vec4i(a0, a1, b0, b1)
