"""Additive continuous collision detection, as a Warp kernel.

Conservative advancement with distances only: while a pair is at distance d, no two of its points can meet
before the time d / l, l the sum of the largest displacements of its two sides once the common motion is taken
away. It stops when d has shrunk to the fraction `GAP` of its start, so a step never touches.

Source: Li, Kaufman, Jiang 2021, "Codimensional incremental potential contact", algorithm 1.
"""

import warp as wp

from muslin.sim.contact.distance import pair_difference, pair_weights

wp.set_module_options({"enable_backward": False})

GAP = 0.2
"""Fraction of the starting distance that every pair keeps."""

MAX_ADVANCES = 200


@wp.kernel
def largest_safe_step(
    x: wp.array(dtype=wp.vec3d),
    p: wp.array(dtype=wp.vec3d),
    pairs: wp.array(dtype=wp.vec4i),
    is_edge_edge: bool,
    step: wp.array(dtype=wp.float64),
):
    """step[0] = min(step[0], largest t such that the pair keeps GAP of its distance on x + [0, t] p)."""
    k = wp.tid()
    pair = pairs[k]
    x0 = x[pair[0]]
    x1 = x[pair[1]]
    x2 = x[pair[2]]
    x3 = x[pair[3]]
    p0 = p[pair[0]]
    p1 = p[pair[1]]
    p2 = p[pair[2]]
    p3 = p[pair[3]]
    mean = (p0 + p1 + p2 + p3) * wp.float64(0.25)
    p0 = p0 - mean
    p1 = p1 - mean
    p2 = p2 - mean
    p3 = p3 - mean
    l0 = wp.length(p0)
    l1 = wp.length(p1)
    l2 = wp.length(p2)
    l3 = wp.length(p3)
    reach = l0 + wp.max(l1, wp.max(l2, l3))
    if is_edge_edge:
        reach = wp.max(l0, l1) + wp.max(l2, l3)
    limit = step[0]
    gap = wp.float64(GAP)
    one = wp.float64(1.0)
    d = wp.length(pair_difference(pair_weights(is_edge_edge, x0, x1, x2, x3), x0, x1, x2, x3))
    keep = gap * d
    if reach * limit <= d - keep:
        return
    t = wp.float64(0.0)
    advance = (one - gap) * d / reach
    for _ in range(MAX_ADVANCES):
        s = t + advance
        y0 = x0 + p0 * s
        y1 = x1 + p1 * s
        y2 = x2 + p2 * s
        y3 = x3 + p3 * s
        d = wp.length(pair_difference(pair_weights(is_edge_edge, y0, y1, y2, y3), y0, y1, y2, y3))
        # The first advance is safe by construction; rounding must not turn it into a step of zero.
        if d < keep and t > wp.float64(0.0):
            break
        t = s
        if t >= limit:
            return
        advance = wp.float64(0.9) * (d - wp.float64(0.5) * keep) / reach
    wp.atomic_min(step, 0, t)
