"""Which patches and groups may come near each other, as Warp kernels.

Two patches that may come near each other are opened: their groups become pairs of groups. The primitives of
two groups that may come near are looked at one by one (`muslin.sim.contact.narrow_phase`).
"""

import warp as wp

wp.set_module_options({"enable_backward": False})

OPEN = wp.constant(wp.float64(1.0e300))
"""Slack, m, of two opened patches: from then on that of their groups counts."""


@wp.struct
class Boxes:
    """Boxes of so many things."""

    low: wp.array(dtype=wp.vec3d)
    high: wp.array(dtype=wp.vec3d)


@wp.func
def box_low(a: wp.vec3d, b: wp.vec3d) -> wp.vec3d:
    return wp.vec3d(wp.min(a[0], b[0]), wp.min(a[1], b[1]), wp.min(a[2], b[2]))


@wp.func
def box_high(a: wp.vec3d, b: wp.vec3d) -> wp.vec3d:
    return wp.vec3d(wp.max(a[0], b[0]), wp.max(a[1], b[1]), wp.max(a[2], b[2]))


@wp.func
def gap_between(low: wp.vec3d, high: wp.vec3d, other_low: wp.vec3d, other_high: wp.vec3d) -> wp.float64:
    """Distance of two boxes, m."""
    between = box_high(low - other_high, other_low - high)
    return wp.length(box_high(between, wp.vec3d()))


@wp.kernel
def boxes_of_points(
    wanted: wp.array(dtype=wp.int32),
    offsets: wp.array(dtype=wp.int32),
    rows: wp.array2d(dtype=wp.int32),
    x: wp.array(dtype=wp.vec3d),
    boxes: Boxes,
):
    """Box of each `wanted` set of vertices at x."""
    k = wp.tid()
    if wanted[k] == 0:
        return
    begin = offsets[k]
    low = x[rows[begin, 0]]
    high = low
    for j in range(begin + 1, offsets[k + 1]):
        a = x[rows[j, 0]]
        low = box_low(low, a)
        high = box_high(high, a)
    boxes.low[k] = low
    boxes.high[k] = high


@wp.kernel
def boxes_of_primitives(
    wanted: wp.array(dtype=wp.int32),
    offsets: wp.array(dtype=wp.int32),
    rows: wp.array2d(dtype=wp.int32),
    x: wp.array(dtype=wp.vec3d),
    boxes: Boxes,
):
    """Box of each primitive of `wanted` groups at x."""
    k = wp.tid()
    if wanted[k] == 0:
        return
    for j in range(offsets[k], offsets[k + 1]):
        low = x[rows[j, 0]]
        high = low
        for i in range(1, rows.shape[1]):
            a = x[rows[j, i]]
            low = box_low(low, a)
            high = box_high(high, a)
        boxes.low[j] = low
        boxes.high[j] = high


@wp.kernel
def open_patches(
    hot_pairs: wp.array(dtype=wp.int32),
    pairs: wp.array(dtype=wp.vec2i),
    boxes: Boxes,
    group_offsets: wp.array(dtype=wp.int32),
    range_: wp.float64,
    ahead: wp.float64,
    slack: wp.array(dtype=wp.float64),
    cost: wp.array(dtype=wp.float64),
    count: wp.array(dtype=wp.int32),
    groups: wp.array(dtype=wp.vec2i),
    group_slack: wp.array(dtype=wp.float64),
):
    """Append the pairs of groups of those hot patches that will be within `ahead` of each other's range.

    The others get the slack that they have.
    """
    k = hot_pairs[wp.tid()]
    a = pairs[k][0]
    b = pairs[k][1]
    left = gap_between(boxes.low[a], boxes.high[a], boxes.low[b], boxes.high[b]) - range_
    if left > cost[k] + ahead:
        slack[k] = left
        return
    slack[k] = OPEN
    for g in range(group_offsets[a], group_offsets[a + 1]):
        first = group_offsets[b]
        if a == b:
            first = g
        last = group_offsets[b + 1]
        slot = wp.atomic_add(count, 0, last - first)
        if slot + last - first <= groups.shape[0]:
            for h in range(first, last):
                groups[slot + h - first] = wp.vec2i(g, h)
                # Less than nothing: to be looked at.
                group_slack[slot + h - first] = wp.float64(-1.0)


@wp.kernel
def renew_slack(
    hot_pairs: wp.array(dtype=wp.int32),
    groups: wp.array(dtype=wp.vec2i),
    boxes: Boxes,
    range_: wp.float64,
    margin: wp.float64,
    slack: wp.array(dtype=wp.float64),
    cost: wp.array(dtype=wp.float64),
):
    """How far apart beyond `range_` the primitives of two hot groups are that were not listed.

    Groups out of reach have none listed; those within reach are `margin` apart also after the move.
    """
    owner = hot_pairs[wp.tid()]
    g = groups[owner][0]
    h = groups[owner][1]
    left = gap_between(boxes.low[g], boxes.high[g], boxes.low[h], boxes.high[h]) - range_
    if left >= margin + cost[owner]:
        slack[owner] = left
    else:
        slack[owner] = margin
        cost[owner] = wp.float64(0.0)
