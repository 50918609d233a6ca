"""Pairs of primitives that may come near each other on the way, as Warp kernels.

Vertices of the cloth come first in the joint array X, collider vertices after them. Every pair has at
least one cloth vertex; pairs that share a vertex are left out. Of two hot groups, which can come together by
`cost` on their way, those pairs are listed that are nearer than `radius` and what the two sides can move
towards each other: most neighbours in a sheet overlap by their boxes, and few can touch.
"""

import warp as wp

from muslin.sim.contact.broad_phase import Boxes
from muslin.sim.contact.distance import pair_distance

wp.set_module_options({"enable_backward": False})


@wp.struct
class GroupPrimitives:
    """Vertices, edges and faces in the order of their groups: those of group g are rows [g] to [g + 1] of
    their offsets."""

    vertex_offsets: wp.array(dtype=wp.int32)
    vertices: wp.array2d(dtype=wp.int32)
    edge_offsets: wp.array(dtype=wp.int32)
    edges: wp.array2d(dtype=wp.int32)
    face_offsets: wp.array(dtype=wp.int32)
    faces: wp.array2d(dtype=wp.int32)


@wp.struct
class FoundPairs:
    """Pairs of primitives, the pair of groups that each was found in, their distances, and their `count`.

    `count` goes on past the room for pairs, so that the caller sees by how much it was too short.
    """

    pairs: wp.array(dtype=wp.vec4i)
    owner: wp.array(dtype=wp.int32)
    distance: wp.array(dtype=wp.float64)
    count: wp.array(dtype=wp.int32)


@wp.kernel
def keep_cold_pairs(
    pairs: wp.array(dtype=wp.vec4i),
    owner: wp.array(dtype=wp.int32),
    distance: wp.array(dtype=wp.float64),
    hot: wp.array(dtype=wp.int32),
    kept: FoundPairs,
):
    """Copies the pairs whose groups are not hot."""
    k = wp.tid()
    if hot[owner[k]] == 0:
        slot = wp.atomic_add(kept.count, 0, 1)
        kept.pairs[slot] = pairs[k]
        kept.owner[slot] = owner[k]
        kept.distance[slot] = distance[k]


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
def distance_if_near(
    is_edge_edge: bool,
    pair: wp.vec4i,
    x: wp.array(dtype=wp.vec3d),
    p: wp.array(dtype=wp.vec3d),
    radius: wp.float64,
    cost: wp.float64,
) -> wp.float64:
    """Distance of a pair that can come nearer than `radius` on its way by p, no longer than `cost`; or -1."""
    x0 = x[pair[0]]
    x1 = x[pair[1]]
    x2 = x[pair[2]]
    x3 = x[pair[3]]
    if apart(is_edge_edge, x0, x1, x2, x3, radius + cost):
        return wp.float64(-1.0)
    d = pair_distance(is_edge_edge, x0, x1, x2, x3)
    if d < radius:
        return d
    # What the two sides can at most move towards each other.
    m = (p[pair[0]] + p[pair[1]] + p[pair[2]] + p[pair[3]]) * wp.float64(0.25)
    r0 = wp.length_sq(p[pair[0]] - m)
    r1 = wp.length_sq(p[pair[1]] - m)
    r2 = wp.length_sq(p[pair[2]] - m)
    r3 = wp.length_sq(p[pair[3]] - m)
    reach = wp.sqrt(r0) + wp.sqrt(wp.max(r1, wp.max(r2, r3)))
    if is_edge_edge:
        reach = wp.sqrt(wp.max(r0, r1)) + wp.sqrt(wp.max(r2, r3))
    if d < radius + wp.min(cost, reach):
        return d
    return wp.float64(-1.0)


@wp.func
def append(pair: wp.vec4i, owner: int, distance: wp.float64, found: FoundPairs):
    slot = wp.atomic_add(found.count, 0, 1)
    if slot < found.pairs.shape[0]:
        found.pairs[slot] = pair
        found.owner[slot] = owner
        found.distance[slot] = distance


@wp.func
def overlap(low: wp.vec3d, high: wp.vec3d, other_low: wp.vec3d, other_high: wp.vec3d) -> bool:
    if low[0] > other_high[0] or other_low[0] > high[0]:
        return False
    if low[1] > other_high[1] or other_low[1] > high[1]:
        return False
    return low[2] <= other_high[2] and other_low[2] <= high[2]


@wp.kernel
def find_near_faces(
    hot_pairs: wp.array(dtype=wp.int32),
    groups: wp.array(dtype=wp.vec2i),
    primitives: GroupPrimitives,
    group_boxes: Boxes,
    face_boxes: Boxes,
    x: wp.array(dtype=wp.vec3d),
    p: wp.array(dtype=wp.vec3d),
    radius: wp.float64,
    cost: wp.array(dtype=wp.float64),
    found: FoundPairs,
):
    """Appends (v, f0, f1, f2) for the vertices of one of two hot groups and the faces of the other near them.

    Launched twice per pair of groups, for one and the other way.
    """
    owner = hot_pairs[wp.tid() // 2]
    g = groups[owner][0]
    h = groups[owner][1]
    if wp.tid() % 2 == 1:
        if g == h:
            return
        g = h
        h = groups[owner][0]
    price = cost[owner]
    around = wp.vec3d(radius + price, radius + price, radius + price)
    group_low = group_boxes.low[h] - around
    group_high = group_boxes.high[h] + around
    if not overlap(group_boxes.low[g], group_boxes.high[g], group_low, group_high):
        return
    for j in range(primitives.vertex_offsets[g], primitives.vertex_offsets[g + 1]):
        v = primitives.vertices[j, 0]
        if overlap(x[v], x[v], group_low, group_high):
            low = x[v] - around
            high = x[v] + around
            for f in range(primitives.face_offsets[h], primitives.face_offsets[h + 1]):
                if overlap(low, high, face_boxes.low[f], face_boxes.high[f]):
                    pair = wp.vec4i(v, primitives.faces[f, 0], primitives.faces[f, 1], primitives.faces[f, 2])
                    if pair[1] != v and pair[2] != v and pair[3] != v:
                        d = distance_if_near(False, pair, x, p, radius, price)
                        if d >= wp.float64(0.0):
                            append(pair, owner, d, found)


@wp.kernel
def find_near_edges(
    hot_pairs: wp.array(dtype=wp.int32),
    groups: wp.array(dtype=wp.vec2i),
    primitives: GroupPrimitives,
    group_boxes: Boxes,
    edge_boxes: Boxes,
    x: wp.array(dtype=wp.vec3d),
    p: wp.array(dtype=wp.vec3d),
    radius: wp.float64,
    cost: wp.array(dtype=wp.float64),
    found: FoundPairs,
):
    """Appends (a0, a1, b0, b1) for the edges of two hot groups that are near each other, each pair once."""
    owner = hot_pairs[wp.tid()]
    g = groups[owner][0]
    h = groups[owner][1]
    price = cost[owner]
    around = wp.vec3d(radius + price, radius + price, radius + price)
    group_low = group_boxes.low[h] - around
    group_high = group_boxes.high[h] + around
    if not overlap(group_boxes.low[g], group_boxes.high[g], group_low, group_high):
        return
    for e in range(primitives.edge_offsets[g], primitives.edge_offsets[g + 1]):
        low = edge_boxes.low[e]
        high = edge_boxes.high[e]
        if overlap(low, high, group_low, group_high):
            low = low - around
            high = high + around
            a0 = primitives.edges[e, 0]
            a1 = primitives.edges[e, 1]
            first = primitives.edge_offsets[h]
            if g == h:
                first = e + 1
            for f in range(first, primitives.edge_offsets[h + 1]):
                if overlap(low, high, edge_boxes.low[f], edge_boxes.high[f]):
                    b0 = primitives.edges[f, 0]
                    b1 = primitives.edges[f, 1]
                    if a0 != b0 and a0 != b1 and a1 != b0 and a1 != b1:
                        pair = wp.vec4i(a0, a1, b0, b1)
                        d = distance_if_near(True, pair, x, p, radius, price)
                        if d >= wp.float64(0.0):
                            append(pair, owner, d, found)
