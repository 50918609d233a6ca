"""Pairs that may come near each other on the way, as Warp kernels: swept boxes first, distances then.

Vertices of the cloth come first in the joint array X, collider vertices after them. Every pair has at
least one cloth vertex; pairs that share a vertex are left out. Vertex i moves by anything between b_i and
p_i. Boxes of these ways are float32 and padded outwards by more than their rounding. Of the pairs whose boxes
overlap those are kept whose distance now is less than `radius` and what the two sides can move towards each
other, their common motion taken away: most neighbours in a sheet overlap, and few can touch.

Primitives with a `hot` vertex are looked for, those without one are what they were when they were looked for
last. Only vertices of the cloth are ever hot.
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
def way_together(is_edge_edge: bool, pair: wp.vec4i, way: wp.array(dtype=wp.float64)) -> wp.float64:
    """What two sides whose vertices go no further than `way` can at most move towards each other, m."""
    if is_edge_edge:
        return wp.max(way[pair[0]], way[pair[1]]) + wp.max(way[pair[2]], way[pair[3]])
    return way[pair[0]] + wp.max(way[pair[1]], wp.max(way[pair[2]], way[pair[3]]))


@wp.func
def apart(is_edge_edge: bool, x0: wp.vec3d, x1: wp.vec3d, x2: wp.vec3d, x3: wp.vec3d, d: wp.float64) -> bool:
    """True only if a pair is further apart than d: by their extents along the line between their centres.

    Much cheaper than the distance, and enough for most of those neighbours in a sheet that are near by box.
    """
    half = wp.float64(0.5)
    if is_edge_edge:
        m = (x2 + x3 - x0 - x1) * half
        extent = (wp.abs(wp.dot(m, x1 - x0)) + wp.abs(wp.dot(m, x3 - x2))) * half
        square = wp.length_sq(m)
        gap = square - extent
        return gap > wp.float64(0.0) and gap * gap > d * d * square
    m = x0 - (x1 + x2 + x3) / wp.float64(3.0)
    square = wp.length_sq(m)
    nearest = wp.max(wp.dot(m, x1 - x0), wp.max(wp.dot(m, x2 - x0), wp.dot(m, x3 - x0)))
    return nearest < wp.float64(0.0) and nearest * nearest > d * d * square


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
def spend(
    b: wp.array(dtype=wp.vec3d),
    p: wp.array(dtype=wp.vec3d),
    shared: wp.vec3d,
    num_cloth: int,
    budget: wp.float64,
    way: wp.array(dtype=wp.float64),
    travelled: wp.array(dtype=wp.float64),
    hot: wp.array(dtype=wp.int32),
    count: wp.array(dtype=wp.int32),
):
    """The way of each vertex, added to what it has travelled.

    Hot is who has gone further than `budget`: count = [of cloth, of collider].
    """
    i = wp.tid()
    far = wp.sqrt(wp.max(wp.length_sq(p[i] - shared), wp.length_sq(b[i] - shared)))
    way[i] = far
    far += travelled[i]
    travelled[i] = far
    hot[i] = 0
    if far > budget:
        if i < num_cloth:
            hot[i] = 1
            wp.atomic_add(count, 0, 1)
        else:
            wp.atomic_add(count, 1, 1)


@wp.kernel
def rest(hot: wp.array(dtype=wp.int32), travelled: wp.array(dtype=wp.float64)):
    """Vertices that have been looked for start again from no way."""
    i = wp.tid()
    if hot[i] != 0:
        travelled[i] = wp.float64(0.0)


@wp.kernel
def keep_cold_pairs(
    pairs: wp.array(dtype=wp.vec4i),
    distance: wp.array(dtype=wp.float64),
    hot: wp.array(dtype=wp.int32),
    count: wp.array(dtype=wp.int32),
    out: wp.array(dtype=wp.vec4i),
    out_distance: wp.array(dtype=wp.float64),
):
    """Copies the pairs without a hot vertex."""
    k = wp.tid()
    i = pairs[k]
    if hot[i[0]] + hot[i[1]] + hot[i[2]] + hot[i[3]] == 0:
        slot = wp.atomic_add(count, 0, 1)
        out[slot] = i
        out_distance[slot] = distance[k]


@wp.struct
class Ways:
    """Where vertices are, x, what they may move by, from b to p, their boxes, how far they go beside what all
    have in common, and who is hot."""

    x: wp.array(dtype=wp.vec3d)
    b: wp.array(dtype=wp.vec3d)
    p: wp.array(dtype=wp.vec3d)
    low: wp.array(dtype=wp.vec3d)
    high: wp.array(dtype=wp.vec3d)
    way: wp.array(dtype=wp.float64)
    hot: wp.array(dtype=wp.int32)


@wp.func
def append_if_near(
    is_edge_edge: bool,
    pair: wp.vec4i,
    ways: Ways,
    radius: wp.float64,
    count: wp.array(dtype=wp.int32),
    pairs: wp.array(dtype=wp.vec4i),
    distance: wp.array(dtype=wp.float64),
):
    """Appends a pair that can come nearer than `radius` on its way.

    `count` goes on past the capacity of `pairs`, so that the caller sees by how much it was too short.
    """
    x0 = ways.x[pair[0]]
    x1 = ways.x[pair[1]]
    x2 = ways.x[pair[2]]
    x3 = ways.x[pair[3]]
    if apart(is_edge_edge, x0, x1, x2, x3, radius + way_together(is_edge_edge, pair, ways.way)):
        return
    d = pair_distance(is_edge_edge, x0, x1, x2, x3)
    if d < radius or d < radius + pair_reach(is_edge_edge, pair, ways.b, ways.p):
        slot = wp.atomic_add(count, 0, 1)
        if slot < pairs.shape[0]:
            pairs[slot] = pair
            distance[slot] = d


@wp.kernel
def faces_near_hot_vertices(
    bvh: wp.uint64,
    faces: wp.array2d(dtype=wp.int32),
    ways: Ways,
    radius: wp.float64,
    count: wp.array(dtype=wp.int32),
    pairs: wp.array(dtype=wp.vec4i),
    distance: wp.array(dtype=wp.float64),
):
    """Appends (v, f0, f1, f2) for every hot vertex and the faces near it."""
    v = wp.tid()
    if ways.hot[v] == 0:
        return
    query = wp.bvh_query_aabb(bvh, to_single(ways.low[v], -radius), to_single(ways.high[v], radius))
    f = int(0)
    while wp.bvh_query_next(query, f):
        pair = wp.vec4i(v, faces[f, 0], faces[f, 1], faces[f, 2])
        if pair[1] != v and pair[2] != v and pair[3] != v:
            append_if_near(False, pair, ways, radius, count, pairs, distance)


@wp.kernel
def vertices_near_hot_faces(
    bvh: wp.uint64,
    first: int,
    faces: wp.array2d(dtype=wp.int32),
    ways: Ways,
    radius: wp.float64,
    count: wp.array(dtype=wp.int32),
    pairs: wp.array(dtype=wp.vec4i),
    distance: wp.array(dtype=wp.float64),
):
    """Appends (v, f0, f1, f2) for every hot face and cold vertices near it; `first`: the BVH's vertex 0."""
    f = wp.tid()
    a = faces[f, 0]
    b = faces[f, 1]
    c = faces[f, 2]
    if ways.hot[a] + ways.hot[b] + ways.hot[c] == 0:
        return
    low = box_low(ways.low[a], box_low(ways.low[b], ways.low[c]))
    high = box_high(ways.high[a], box_high(ways.high[b], ways.high[c]))
    query = wp.bvh_query_aabb(bvh, to_single(low, -radius), to_single(high, radius))
    k = int(0)
    while wp.bvh_query_next(query, k):
        v = first + k
        if ways.hot[v] == 0 and a != v and b != v and c != v:
            append_if_near(False, wp.vec4i(v, a, b, c), ways, radius, count, pairs, distance)


@wp.kernel
def edges_near_hot_edges(
    bvh: wp.uint64,
    queries: wp.array2d(dtype=wp.int32),
    edges: wp.array2d(dtype=wp.int32),
    same_set: int,
    ways: Ways,
    radius: wp.float64,
    count: wp.array(dtype=wp.int32),
    pairs: wp.array(dtype=wp.vec4i),
    distance: wp.array(dtype=wp.float64),
):
    """Appends (a0, a1, b0, b1) for every hot edge and the edges near it; with `same_set` each pair once."""
    i = wp.tid()
    a0 = queries[i, 0]
    a1 = queries[i, 1]
    if ways.hot[a0] + ways.hot[a1] == 0:
        return
    low = box_low(ways.low[a0], ways.low[a1])
    high = box_high(ways.high[a0], ways.high[a1])
    query = wp.bvh_query_aabb(bvh, to_single(low, -radius), to_single(high, radius))
    e = int(0)
    while wp.bvh_query_next(query, e):
        b0 = edges[e, 0]
        b1 = edges[e, 1]
        if same_set == 1 and e <= i and ways.hot[b0] + ways.hot[b1] > 0:
            continue
        if a0 != b0 and a0 != b1 and a1 != b0 and a1 != b1:
            append_if_near(True, wp.vec4i(a0, a1, b0, b1), ways, radius, count, pairs, distance)
