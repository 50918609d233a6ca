"""Pairs that may come near each other on the way, as Warp kernels: swept boxes first, distances then.

Vertices of the cloth come first in the joint array X, collider vertices after them. Every pair has at least
one cloth vertex; pairs that share a vertex are left out. Vertex i moves by anything between b_i and p_i. Boxes
of these ways are float32 and padded outwards by more than their rounding. Of the pairs whose boxes overlap
those are kept whose distance now is less than `radius` and what the two sides can move towards each other,
their common motion taken away: most neighbours in a sheet overlap, and few can touch.
"""

import warp as wp

from muslin.sim.contact.distance import pair_distance

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


@wp.func
def pair_reach(
    is_edge_edge: bool, pair: wp.vec4i, b: wp.array(dtype=wp.vec3d), p: wp.array(dtype=wp.vec3d)
) -> wp.float64:
    """What the two sides of a pair can at most move towards each other, m."""
    m = (p[pair[0]] + p[pair[1]] + p[pair[2]] + p[pair[3]]) * wp.float64(0.25)
    r0 = wp.max(wp.length_sq(p[pair[0]] - m), wp.length_sq(b[pair[0]] - m))
    r1 = wp.max(wp.length_sq(p[pair[1]] - m), wp.length_sq(b[pair[1]] - m))
    r2 = wp.max(wp.length_sq(p[pair[2]] - m), wp.length_sq(b[pair[2]] - m))
    r3 = wp.max(wp.length_sq(p[pair[3]] - m), wp.length_sq(b[pair[3]] - m))
    if is_edge_edge:
        return wp.sqrt(wp.max(r0, r1)) + wp.sqrt(wp.max(r2, r3))
    return wp.sqrt(r0) + wp.sqrt(wp.max(r1, wp.max(r2, r3)))


@wp.func
def may_meet(
    is_edge_edge: bool,
    pair: wp.vec4i,
    x: wp.array(dtype=wp.vec3d),
    b: wp.array(dtype=wp.vec3d),
    p: wp.array(dtype=wp.vec3d),
    radius: wp.float64,
) -> bool:
    """Whether a pair can come nearer than `radius` on its way."""
    d = pair_distance(is_edge_edge, x[pair[0]], x[pair[1]], x[pair[2]], x[pair[3]])
    return d < radius or d < radius + pair_reach(is_edge_edge, pair, b, p)


@wp.kernel
def sweep_vertices(
    x: wp.array(dtype=wp.vec3d),
    b: wp.array(dtype=wp.vec3d),
    p: wp.array(dtype=wp.vec3d),
    shift: wp.vec3d,
    low: wp.array(dtype=wp.vec3d),
    high: wp.array(dtype=wp.vec3d),
):
    """Box of each vertex around x, x + b - shift and x + p - shift.

    Whether two points come together does not depend on a motion they share, so the sweep may leave one out.
    """
    i = wp.tid()
    a = x[i]
    end = a + p[i] - shift
    other = a + b[i] - shift
    low[i] = box_low(a, box_low(end, other))
    high[i] = box_high(a, box_high(end, other))


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
    x: wp.array(dtype=wp.vec3d),
    b: wp.array(dtype=wp.vec3d),
    p: wp.array(dtype=wp.vec3d),
    vertex_low: wp.array(dtype=wp.vec3d),
    vertex_high: wp.array(dtype=wp.vec3d),
    region_low: wp.vec3d,
    region_high: wp.vec3d,
    radius: wp.float64,
    count: wp.array(dtype=wp.int32),
    pairs: wp.array(dtype=wp.vec4i),
):
    """Appends vertex and face as (v, f0, f1, f2); `count` goes on past the capacity of `pairs`."""
    i = wp.tid()
    v = vertices[i]
    low = vertex_low[v]
    high = vertex_high[v]
    for k in range(3):
        if low[k] > region_high[k] or high[k] < region_low[k]:
            return
    query = wp.bvh_query_aabb(bvh, to_single(low, -radius), to_single(high, radius))
    f = int(0)
    while wp.bvh_query_next(query, f):
        pair = wp.vec4i(v, faces[f, 0], faces[f, 1], faces[f, 2])
        if pair[1] == v or pair[2] == v or pair[3] == v:
            continue
        if may_meet(False, pair, x, b, p, radius):
            slot = wp.atomic_add(count, 0, 1)
            if slot < pairs.shape[0]:
                pairs[slot] = pair


@wp.kernel
def edge_edge_candidates(
    bvh: wp.uint64,
    queries: wp.array2d(dtype=wp.int32),
    edges: wp.array2d(dtype=wp.int32),
    same_set: int,
    x: wp.array(dtype=wp.vec3d),
    b: wp.array(dtype=wp.vec3d),
    p: wp.array(dtype=wp.vec3d),
    vertex_low: wp.array(dtype=wp.vec3d),
    vertex_high: wp.array(dtype=wp.vec3d),
    radius: wp.float64,
    count: wp.array(dtype=wp.int32),
    pairs: wp.array(dtype=wp.vec4i),
):
    """Appends two edges as (a0, a1, b0, b1); with `same_set` each pair once."""
    i = wp.tid()
    a0 = queries[i, 0]
    a1 = queries[i, 1]
    low = box_low(vertex_low[a0], vertex_low[a1])
    high = box_high(vertex_high[a0], vertex_high[a1])
    query = wp.bvh_query_aabb(bvh, to_single(low, -radius), to_single(high, radius))
    e = int(0)
    while wp.bvh_query_next(query, e):
        if same_set == 1 and e <= i:
            continue
        b0 = edges[e, 0]
        b1 = edges[e, 1]
        if a0 == b0 or a0 == b1 or a1 == b0 or a1 == b1:
            continue
        pair = wp.vec4i(a0, a1, b0, b1)
        if may_meet(True, pair, x, b, p, radius):
            slot = wp.atomic_add(count, 0, 1)
            if slot < pairs.shape[0]:
                pairs[slot] = pair
