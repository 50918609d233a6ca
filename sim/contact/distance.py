"""Closest points of point-triangle and edge-edge pairs, as Warp functions.

A pair is four vertices X and four weights w with closest-point difference r = sum_i w_i X_i and distance
d = |r|. The weights are stationary at the closest points, so w_i r / d is the exact gradient of d with
respect to X_i wherever the closest points are unique.

Source: Ericson, "Real-Time Collision Detection", 2005, sections 5.1.5 and 5.1.9.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.func
def point_triangle_weights(p: wp.vec3d, a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> wp.vec4d:
    """(1, -u, -v, -w) with the closest point u a + v b + w c of the triangle."""
    zero = wp.float64(0.0)
    one = wp.float64(1.0)
    ab = b - a
    ac = c - a
    ap = p - a
    d1 = wp.dot(ab, ap)
    d2 = wp.dot(ac, ap)
    if d1 <= zero and d2 <= zero:
        return wp.vec4d(one, -one, zero, zero)
    bp = p - b
    d3 = wp.dot(ab, bp)
    d4 = wp.dot(ac, bp)
    if d3 >= zero and d4 <= d3:
        return wp.vec4d(one, zero, -one, zero)
    vc = d1 * d4 - d3 * d2
    if vc <= zero and d1 >= zero and d3 <= zero:
        v = d1 / (d1 - d3)
        return wp.vec4d(one, v - one, -v, zero)
    cp = p - c
    d5 = wp.dot(ab, cp)
    d6 = wp.dot(ac, cp)
    if d6 >= zero and d5 <= d6:
        return wp.vec4d(one, zero, zero, -one)
    vb = d5 * d2 - d1 * d6
    if vb <= zero and d2 >= zero and d6 <= zero:
        w = d2 / (d2 - d6)
        return wp.vec4d(one, w - one, zero, -w)
    va = d3 * d6 - d5 * d4
    if va <= zero and (d4 - d3) >= zero and (d5 - d6) >= zero:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return wp.vec4d(one, zero, w - one, -w)
    scale = one / (va + vb + vc)
    v = vb * scale
    w = vc * scale
    return wp.vec4d(one, v + w - one, -v, -w)


@wp.func
def edge_edge_weights(p1: wp.vec3d, q1: wp.vec3d, p2: wp.vec3d, q2: wp.vec3d) -> wp.vec4d:
    """(1 - s, s, t - 1, -t) with the closest points (1 - s) p1 + s q1 and (1 - t) p2 + t q2."""
    zero = wp.float64(0.0)
    one = wp.float64(1.0)
    d1 = q1 - p1
    d2 = q2 - p2
    r = p1 - p2
    a = wp.max(wp.dot(d1, d1), wp.float64(1.0e-30))
    e = wp.max(wp.dot(d2, d2), wp.float64(1.0e-30))
    f = wp.dot(d2, r)
    c = wp.dot(d1, r)
    b = wp.dot(d1, d2)
    denominator = a * e - b * b
    s = zero
    if denominator > wp.float64(1.0e-14) * a * e:
        s = wp.clamp((b * f - c * e) / denominator, zero, one)
    t = (b * s + f) / e
    if t < zero:
        t = zero
        s = wp.clamp(-c / a, zero, one)
    elif t > one:
        t = one
        s = wp.clamp((b - c) / a, zero, one)
    return wp.vec4d(one - s, s, t - one, -t)


@wp.func
def pair_weights(is_edge_edge: bool, x0: wp.vec3d, x1: wp.vec3d, x2: wp.vec3d, x3: wp.vec3d) -> wp.vec4d:
    if is_edge_edge:
        return edge_edge_weights(x0, x1, x2, x3)
    return point_triangle_weights(x0, x1, x2, x3)


@wp.func
def pair_distance(is_edge_edge: bool, x0: wp.vec3d, x1: wp.vec3d, x2: wp.vec3d, x3: wp.vec3d) -> wp.float64:
    return wp.length(pair_difference(pair_weights(is_edge_edge, x0, x1, x2, x3), x0, x1, x2, x3))


@wp.func
def pair_difference(w: wp.vec4d, x0: wp.vec3d, x1: wp.vec3d, x2: wp.vec3d, x3: wp.vec3d) -> wp.vec3d:
    return x0 * w[0] + x1 * w[1] + x2 * w[2] + x3 * w[3]
