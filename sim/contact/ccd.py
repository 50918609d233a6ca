"""Additive continuous collision detection, as a Warp kernel.

Conservative advancement with distances only: while a pair is at distance d, no two of its points can meet
before the time d / l, l the sum of the largest displacements of its two sides once the common motion is taken
away. It stops when d has shrunk to the fraction `GAP` of its start, so a step never touches.

A step can be limited for all vertices alike (`largest_safe_step`), or for each on its own: `cut_fractions`
lowers the fractions f of the vertices of every pair that would touch, until all pairs are safe on
x + b + f (p - b). b is a motion that should be safe, such as that of the collider nearby.

Source: Li, Kaufman, Jiang 2021, "Codimensional incremental potential contact", algorithm 1.
"""

import warp as wp

from muslin.sim.contact.distance import pair_distance

wp.set_module_options({"enable_backward": False})

GAP = 0.2
"""Fraction of the starting distance that every pair keeps."""

MAX_ADVANCES = 200

CUT = 0.8
"""What a cut leaves of the safe way: cuts that leave all of it come near a safe step, but never there."""


@wp.func
def advance_pair(
    is_edge_edge: bool,
    x0: wp.vec3d,
    x1: wp.vec3d,
    x2: wp.vec3d,
    x3: wp.vec3d,
    m0: wp.vec3d,
    m1: wp.vec3d,
    m2: wp.vec3d,
    m3: wp.vec3d,
    limit: wp.float64,
) -> wp.float64:
    """Largest t up to `limit` such that a pair that moves by t m keeps GAP of its distance all the way."""
    mean = (m0 + m1 + m2 + m3) * wp.float64(0.25)
    p0 = m0 - mean
    p1 = m1 - mean
    p2 = m2 - mean
    p3 = m3 - mean
    l0 = wp.length(p0)
    l1 = wp.length(p1)
    l2 = wp.length(p2)
    l3 = wp.length(p3)
    reach = l0 + wp.max(l1, wp.max(l2, l3))
    if is_edge_edge:
        reach = wp.max(l0, l1) + wp.max(l2, l3)
    gap = wp.float64(GAP)
    one = wp.float64(1.0)
    d = pair_distance(is_edge_edge, x0, x1, x2, x3)
    keep = gap * d
    if reach * limit <= d - keep:
        return limit
    t = wp.float64(0.0)
    advance = (one - gap) * d / reach
    for _ in range(MAX_ADVANCES):
        s = t + advance
        y0 = x0 + p0 * s
        y1 = x1 + p1 * s
        y2 = x2 + p2 * s
        y3 = x3 + p3 * s
        d = pair_distance(is_edge_edge, y0, y1, y2, y3)
        # The first advance is safe by construction; rounding must not turn it into a step of zero.
        if d < keep and t > wp.float64(0.0):
            break
        t = s
        if t >= limit:
            return limit
        advance = wp.float64(0.9) * (d - wp.float64(0.5) * keep) / reach
    return t


@wp.kernel
def largest_safe_step(
    x: wp.array(dtype=wp.vec3d),
    p: wp.array(dtype=wp.vec3d),
    pairs: wp.array(dtype=wp.vec4i),
    is_edge_edge: bool,
    step: wp.array(dtype=wp.float64),
):
    """step[0] = min(step[0], largest t such that the pair keeps GAP of its distance on x + [0, t] p)."""
    i = pairs[wp.tid()]
    a = step[0]
    t = advance_pair(is_edge_edge, x[i[0]], x[i[1]], x[i[2]], x[i[3]], p[i[0]], p[i[1]], p[i[2]], p[i[3]], a)
    if t < a:
        wp.atomic_min(step, 0, t)


@wp.func
def part_of_way(b: wp.vec3d, p: wp.vec3d, f: wp.float64) -> wp.vec3d:
    """b + f (p - b)"""
    return b + (p - b) * f


@wp.kernel
def cut_fractions(
    x: wp.array(dtype=wp.vec3d),
    b: wp.array(dtype=wp.vec3d),
    p: wp.array(dtype=wp.vec3d),
    pairs: wp.array(dtype=wp.vec4i),
    owner: wp.array(dtype=wp.int32),
    most: wp.array(dtype=wp.float64),
    distance: wp.array(dtype=wp.float64),
    is_edge_edge: bool,
    first: bool,
    before: wp.array(dtype=wp.float64),
    fraction: wp.array(dtype=wp.float64),
    out: wp.array(dtype=wp.float64),
    cut: wp.array(dtype=wp.int32),
):
    """Of every pair that is not safe on x + b + f (p - b), the f of its vertices go down with its safe step.

    In the `first` pass all go p, and no pair comes together by more than the `most` of its owner from its
    `distance` or more. Later `fraction` f (V + N,) is read, and pairs whose vertices have it from `before`
    are known to be safe. `out` starts as a copy of f; cut[0] counts the pairs.
    """
    k = wp.tid()
    if first and (wp.float64(1.0) - wp.float64(GAP)) * distance[k] > most[owner[k]]:
        return
    i = pairs[k]
    i0 = i[0]
    i1 = i[1]
    i2 = i[2]
    i3 = i[3]
    same = before[i0] == fraction[i0] and before[i1] == fraction[i1]
    if same and before[i2] == fraction[i2] and before[i3] == fraction[i3]:
        return
    m0 = part_of_way(b[i0], p[i0], fraction[i0])
    m1 = part_of_way(b[i1], p[i1], fraction[i1])
    m2 = part_of_way(b[i2], p[i2], fraction[i2])
    m3 = part_of_way(b[i3], p[i3], fraction[i3])
    one = wp.float64(1.0)
    t = advance_pair(is_edge_edge, x[i0], x[i1], x[i2], x[i3], m0, m1, m2, m3, one)
    if t < one:
        wp.atomic_add(cut, 0, 1)
        for j in range(int(0), int(4)):
            wp.atomic_min(out, i[j], wp.float64(CUT) * t * fraction[i[j]])


@wp.kernel
def go_part_of_way(
    b: wp.array(dtype=wp.vec3d), p: wp.array(dtype=wp.vec3d), fraction: wp.array(dtype=wp.float64)
):
    """p = b + f (p - b)"""
    i = wp.tid()
    if fraction[i] < wp.float64(1.0):
        p[i] = part_of_way(b[i], p[i], fraction[i])
