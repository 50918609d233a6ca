"""How far the points of two sets can come towards each other, as Warp kernels.

Neighbours on a sheet, and cloth carried by a limb, go far but differ little. So the motions u_j of a set of
points are split into a rigid field and a rest,

    u_j = m + w x (x_j - c) + e_j,

with centre c, mean m, w by least squares, and rest e = max |e_j|. A rigid field that two sets A and B
share brings none of their points together, |v + w x v| >= |v|. With the field of A for both, points of A and
B come together by no more than

    |m_B - m_A - w_A x (c_B - c_A)| + |w_B - w_A| r_B + e_A + e_B,    r_B = max |x_j - c_B|,

and by no more than their share of it on any part of the way.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})

CHEAP = wp.constant(wp.float64(0.2))
"""Share of the slack that two ways may take without a closer look at how they differ."""


@wp.struct
class SetMotion:
    """c, m, w, e, r of each set, the way, m, of its point that goes furthest, and whether any has changed."""

    centre: wp.array(dtype=wp.vec3d)
    mean: wp.array(dtype=wp.vec3d)
    spin: wp.array(dtype=wp.vec3d)
    rest: wp.array(dtype=wp.float64)
    spread: wp.array(dtype=wp.float64)
    radius: wp.array(dtype=wp.float64)
    way: wp.array(dtype=wp.float64)
    changed: wp.array(dtype=wp.int32)


@wp.kernel
def split_motions(
    offsets: wp.array(dtype=wp.int32),
    touched: wp.array2d(dtype=wp.int32),
    x: wp.array(dtype=wp.vec3d),
    p: wp.array(dtype=wp.vec3d),
    again: bool,
    fraction: wp.array(dtype=wp.float64),
    motion: SetMotion,
):
    """Split the motions p of the vertices `touched` by each set.

    `again`: only those sets have changed of whose vertices some go only a `fraction` of their way. A radius
    below zero says that nothing is known of where the set is.
    """
    k = wp.tid()
    begin = offsets[k]
    end = offsets[k + 1]
    zero = wp.float64(0.0)
    one = wp.float64(1.0)
    motion.changed[k] = 1
    if again:
        shortest = one
        for j in range(begin, end):
            shortest = wp.min(shortest, fraction[touched[j, 0]])
        if shortest == one:
            motion.changed[k] = 0
            return
    square = zero
    for j in range(begin, end):
        square = wp.max(square, wp.length_sq(p[touched[j, 0]]))
    if square == zero and motion.way[k] == zero and motion.radius[k] >= zero:
        # Still at rest: all is as it was.
        return
    motion.way[k] = wp.sqrt(square)
    c = wp.vec3d()
    m = wp.vec3d()
    for j in range(begin, end):
        i = touched[j, 0]
        c += x[i]
        m += p[i]
    share = one / wp.float64(end - begin)
    c = c * share
    m = m * share
    moment = wp.vec3d()
    inertia = wp.mat33d()
    far = zero
    for j in range(begin, end):
        i = touched[j, 0]
        r = x[i] - c
        moment += wp.cross(r, p[i])
        inertia += wp.identity(n=3, dtype=wp.float64) * wp.length_sq(r) - wp.outer(r, r)
        far = wp.max(far, wp.length_sq(r))
    # Points in a line do not tell how they turn about it.
    some = wp.float64(1.0e-6) * wp.trace(inertia) + wp.float64(1.0e-20)
    inertia += wp.identity(n=3, dtype=wp.float64) * some
    w = wp.inverse(inertia) * moment
    rest = zero
    spread = zero
    for j in range(begin, end):
        i = touched[j, 0]
        differs = p[i] - m
        spread = wp.max(spread, wp.length_sq(differs))
        rest = wp.max(rest, wp.length_sq(differs - wp.cross(w, x[i] - c)))
    motion.centre[k] = c
    motion.mean[k] = m
    motion.spin[k] = w
    motion.radius[k] = wp.sqrt(far)
    motion.rest[k] = wp.sqrt(rest)
    motion.spread[k] = wp.sqrt(spread)


@wp.func
def approach(motion: SetMotion, a: int, b: int) -> wp.float64:
    """What points of sets a and b can at most come together by, m."""
    between = motion.centre[b] - motion.centre[a]
    means = motion.mean[b] - motion.mean[a]
    spin_a = motion.spin[a]
    spin_b = motion.spin[b]
    turn = wp.length(spin_b - spin_a)
    with_a = wp.length(means - wp.cross(spin_a, between)) + turn * motion.radius[b]
    with_b = wp.length(means - wp.cross(spin_b, between)) + turn * motion.radius[a]
    rigid = wp.min(with_a, with_b) + motion.rest[a] + motion.rest[b]
    return wp.min(rigid, wp.length(means) + motion.spread[a] + motion.spread[b])


@wp.kernel
def find_hot_pairs(
    pairs: wp.array(dtype=wp.vec2i),
    motion: SetMotion,
    spent: bool,
    slack: wp.array(dtype=wp.float64),
    cost: wp.array(dtype=wp.float64),
    most: wp.array(dtype=wp.float64),
    hot: wp.array(dtype=wp.int32),
    wanted: wp.array(dtype=wp.int32),
    count: wp.array(dtype=wp.int32),
    out: wp.array(dtype=wp.int32),
):
    """Mark as `hot`, and list, those `pairs` of changed sets that may use up their `slack`.

    `cost` is what the move takes of the slack once it is made; that of the last one, if it has been `spent`,
    is taken off first. `most` is what points of the two can at most come together by.
    """
    k = wp.tid()
    a = pairs[k][0]
    b = pairs[k][1]
    hot[k] = 0
    if motion.changed[a] + motion.changed[b] == 0:
        return
    left = slack[k]
    if spent:
        left -= cost[k]
        slack[k] = left
    price = motion.way[a] + motion.way[b]
    if price > CHEAP * left:
        price = wp.min(price, approach(motion, a, b))
    cost[k] = price
    most[k] = price
    if price > left:
        hot[k] = 1
        wanted[a] = 1
        wanted[b] = 1
        out[wp.atomic_add(count, 0, 1)] = k
