"""Contact barrier on distance, weighted by area, as Warp kernels.

For a pair at distance d < dhat, s = d / dhat,

    E = kappa A m B(s),   B(s) = (1 - s)^3 / s,

kappa in J/m^2, A the area of cloth in m^2 the pair stands for, m = 1 for vertex-triangle pairs. For edge-edge
pairs m mollifies near-parallel edges, whose closest points jump: with c = |e1 x e2|^2 and
c0 = 1e-3 |e1|^2 |e2|^2 at rest, m = (2 - c / c0) c / c0 below c0.
The Hessian keeps the positive semi-definite part m B'' grad d grad d^T.

At light contact, s near 1, B is that of Li et al., -(s - 1)^2 ln s, to leading order. Near s = 0 its force
grows as s^-2 and not as s^-1, so taut cloth keeps a gap that a collider can advance by.

Sources: Li et al. 2020, "Incremental potential contact" (mollifier, and what a barrier has to be); Li et al.
2023, "Convergent IPC" (area weights).
"""

import warp as wp

from muslin.sim.contact.distance import pair_difference, pair_weights
from muslin.sim.solve.block_matrix import BlockMatrix, add_pair

wp.set_module_options({"enable_backward": False})


@wp.struct
class PairMeasure:
    """`vertex_area` (V,) of the cloth, m^2; `range_` dhat, m; `stiffness` kappa, J/m^2."""

    vertex_area: wp.array(dtype=wp.float64)
    num_cloth: int
    range_: wp.float64
    stiffness: wp.float64


@wp.func
def barrier(s: wp.float64) -> wp.vec3d:
    """B, B' and B'' at s in (0, 1)."""
    one = wp.float64(1.0)
    two = wp.float64(2.0)
    r = one - s
    return wp.vec3d(r * r * r / s, -r * r * (one + two * s) / (s * s), two / (s * s * s) - two)


@wp.func
def closest(is_edge_edge: bool, pair: wp.vec4i, x: wp.array(dtype=wp.vec3d)) -> wp.vec4d:
    """Weights of the closest points of a pair."""
    return pair_weights(is_edge_edge, x[pair[0]], x[pair[1]], x[pair[2]], x[pair[3]])


@wp.func
def difference(w: wp.vec4d, pair: wp.vec4i, x: wp.array(dtype=wp.vec3d)) -> wp.vec3d:
    """Vector between the closest points of a pair with weights w."""
    return pair_difference(w, x[pair[0]], x[pair[1]], x[pair[2]], x[pair[3]])


@wp.func
def mollifier(
    is_edge_edge: bool, pair: wp.vec4i, x: wp.array(dtype=wp.vec3d), rest: wp.array(dtype=wp.vec3d)
) -> wp.vec2d:
    """m and dm/dc; `rest` is the configuration whose edge lengths enter c0."""
    one = wp.float64(1.0)
    if not is_edge_edge:
        return wp.vec2d(one, wp.float64(0.0))
    n = wp.cross(x[pair[1]] - x[pair[0]], x[pair[3]] - x[pair[2]])
    lengths = wp.length_sq(rest[pair[1]] - rest[pair[0]]) * wp.length_sq(rest[pair[3]] - rest[pair[2]])
    c0 = wp.float64(1.0e-3) * lengths
    y = wp.dot(n, n) / c0
    if y >= one:
        return wp.vec2d(one, wp.float64(0.0))
    return wp.vec2d((wp.float64(2.0) - y) * y, (wp.float64(2.0) - wp.float64(2.0) * y) / c0)


@wp.func
def pair_area(is_edge_edge: bool, pair: wp.vec4i, measure: PairMeasure) -> wp.float64:
    """Area of cloth that a pair stands for: that of its vertices on the cloth, shared among their pairs.

    The collider's own areas do not count: a fingertip of tiny triangles must push as hard as a back.
    """
    area = measure.vertex_area
    n = measure.num_cloth
    if is_edge_edge:
        # An edge owns about a third of the area around each of its ends.
        own = area[pair[0]] + area[pair[1]]
        if pair[2] >= n:
            return own * (wp.float64(1.0) / wp.float64(6.0))
        return (own + area[pair[2]] + area[pair[3]]) * (wp.float64(1.0) / wp.float64(12.0))
    if pair[0] >= n:
        return (area[pair[1]] + area[pair[2]] + area[pair[3]]) * (wp.float64(1.0) / wp.float64(6.0))
    return wp.float64(0.5) * area[pair[0]]


@wp.kernel
def barrier_value(
    x: wp.array(dtype=wp.vec3d),
    step: wp.float64,
    reference: wp.array(dtype=wp.vec3d),
    pairs: wp.array(dtype=wp.vec4i),
    owner: wp.array(dtype=wp.int32),
    most: wp.array(dtype=wp.float64),
    distance: wp.array(dtype=wp.float64),
    is_edge_edge: bool,
    measure: PairMeasure,
    out_distance: wp.array(dtype=wp.float64),
    energy: wp.array(dtype=wp.float64),
):
    """energy[0] += sum of barrier energies at x, the end of a move.

    No pair has come together by more than `step` times the `most` of its owner. `distance` bounds the
    distances before the move from below, `out_distance` after it: pairs that cannot have come within range
    are not measured. `reference` (start of the step) gives the lengths in c0.
    """
    k = wp.tid()
    bound = distance[k]
    if bound > measure.range_:
        bound -= step * most[owner[k]]
        if bound > measure.range_:
            out_distance[k] = bound
            return
    pair = pairs[k]
    d = wp.length(difference(closest(is_edge_edge, pair, x), pair, x))
    out_distance[k] = d
    s = d / measure.range_
    if s < wp.float64(1.0):
        m = mollifier(is_edge_edge, pair, x, reference)[0]
        scale = measure.stiffness * pair_area(is_edge_edge, pair, measure)
        wp.atomic_add(energy, 0, scale * m * barrier(s)[0])


@wp.kernel
def lower_distances(
    step: wp.float64,
    owner: wp.array(dtype=wp.int32),
    most: wp.array(dtype=wp.float64),
    distance: wp.array(dtype=wp.float64),
):
    """`distance` bounds the distances from below also after `step` of a move, as in `barrier_value`."""
    k = wp.tid()
    distance[k] = wp.max(distance[k] - step * most[owner[k]], wp.float64(0.0))


@wp.kernel
def barrier_derivatives(
    x: wp.array(dtype=wp.vec3d),
    reference: wp.array(dtype=wp.vec3d),
    remaining: wp.array(dtype=wp.vec3d),
    pairs: wp.array(dtype=wp.vec4i),
    distance: wp.array(dtype=wp.float64),
    is_edge_edge: bool,
    measure: PairMeasure,
    gradient: wp.array(dtype=wp.vec3d),
    matrix: BlockMatrix,
):
    """Adds gradient and Hessian blocks of cloth vertices.

    `remaining` is the displacement that collider vertices still have to make: its linearised force is added
    to the gradient, so that the Newton direction moves the cloth along with the collider.
    """
    k = wp.tid()
    if distance[k] >= measure.range_:
        return
    pair = pairs[k]
    w = closest(is_edge_edge, pair, x)
    r = difference(w, pair, x)
    d = wp.length(r)
    s = d / measure.range_
    if s >= wp.float64(1.0):
        return
    m = mollifier(is_edge_edge, pair, x, reference)
    scale = measure.stiffness * pair_area(is_edge_edge, pair, measure)
    b = barrier(s)
    n = r / d
    force = scale * m[0] * b[1] / measure.range_
    curvature = scale * m[0] * b[2] / (measure.range_ * measure.range_)
    carried = wp.float64(0.0)
    for i in range(int(0), int(4)):
        if pair[i] >= measure.num_cloth:
            carried += w[i] * wp.dot(n, remaining[pair[i]])
    along = n * (force + curvature * carried)
    add_pair(gradient, matrix, pair, w, measure.num_cloth, along, wp.outer(n * curvature, n))
    if m[1] != wp.float64(0.0):
        # gradient of c = |e1 x e2|^2
        e1 = x[pair[1]] - x[pair[0]]
        e2 = x[pair[3]] - x[pair[2]]
        k2 = wp.float64(2.0) * scale * b[0] * m[1]
        turn1 = (e1 * wp.dot(e2, e2) - e2 * wp.dot(e1, e2)) * k2
        turn2 = (e2 * wp.dot(e1, e1) - e1 * wp.dot(e1, e2)) * k2
        for i in range(int(0), int(2)):
            sign = wp.float64(2 * i - 1)
            if pair[i] < measure.num_cloth:
                wp.atomic_add(gradient, pair[i], turn1 * sign)
            if pair[2 + i] < measure.num_cloth:
                wp.atomic_add(gradient, pair[2 + i], turn2 * sign)


@wp.kernel
def guard_pairs(
    x: wp.array(dtype=wp.vec3d),
    p: wp.array(dtype=wp.vec3d),
    pairs: wp.array(dtype=wp.vec4i),
    is_edge_edge: bool,
    measure: PairMeasure,
    gradient: wp.array(dtype=wp.vec3d),
    matrix: BlockMatrix,
):
    """Adds a spring to the Newton system for every pair that the direction p would bring together.

    To first order p changes the distance d of a pair by a = n . sum_i w_i p_i. Where d + a < 0.3 d, the
    spring k (a + d / 2)^2 / 2 asks the next direction to leave it half its distance. Vertices of the collider
    keep their p.
    """
    k = wp.tid()
    pair = pairs[k]
    w = closest(is_edge_edge, pair, x)
    r = difference(w, pair, x)
    d = wp.length(r)
    n = r / d
    approach = wp.float64(0.0)
    carried = wp.float64(0.0)
    for i in range(int(0), int(4)):
        a = w[i] * wp.dot(n, p[pair[i]])
        approach += a
        if pair[i] >= measure.num_cloth:
            carried += a
    if approach >= wp.float64(-0.7) * d:
        return
    area = pair_area(is_edge_edge, pair, measure)
    spring = wp.float64(10.0) * measure.stiffness * area / (measure.range_ * measure.range_)
    along = n * (spring * (carried + wp.float64(0.5) * d))
    add_pair(gradient, matrix, pair, w, measure.num_cloth, along, wp.outer(n * spring, n))


@wp.kernel
def mark_near(
    x: wp.array(dtype=wp.vec3d),
    pairs: wp.array(dtype=wp.vec4i),
    distance: wp.array(dtype=wp.float64),
    is_edge_edge: bool,
    within: wp.float64,
    near: wp.array(dtype=wp.int32),
):
    """near[i] = 1 for the vertices of pairs that are less than `within` apart."""
    k = wp.tid()
    if distance[k] >= within:
        return
    pair = pairs[k]
    if wp.length(difference(closest(is_edge_edge, pair, x), pair, x)) < within:
        for i in range(int(0), int(4)):
            near[pair[i]] = 1


@wp.kernel
def active_pairs(
    x: wp.array(dtype=wp.vec3d),
    reference: wp.array(dtype=wp.vec3d),
    pairs: wp.array(dtype=wp.vec4i),
    distance: wp.array(dtype=wp.float64),
    is_edge_edge: bool,
    measure: PairMeasure,
    count: wp.array(dtype=wp.int32),
    out_pairs: wp.array(dtype=wp.vec4i),
    out_weights: wp.array(dtype=wp.vec4d),
    out_normal: wp.array(dtype=wp.vec3d),
    out_force: wp.array(dtype=wp.float64),
    nearest: wp.array(dtype=wp.float64),
):
    """Lists pairs within range: weights, unit normals, normal forces, N; tracks the smallest distance."""
    k = wp.tid()
    if distance[k] >= measure.range_:
        wp.atomic_min(nearest, 0, distance[k])
        return
    pair = pairs[k]
    w = closest(is_edge_edge, pair, x)
    r = difference(w, pair, x)
    d = wp.length(r)
    wp.atomic_min(nearest, 0, d)
    s = d / measure.range_
    if s >= wp.float64(1.0):
        return
    slot = wp.atomic_add(count, 0, 1)
    if slot < out_pairs.shape[0]:
        m = mollifier(is_edge_edge, pair, x, reference)[0]
        scale = measure.stiffness * pair_area(is_edge_edge, pair, measure)
        out_pairs[slot] = pair
        out_weights[slot] = w
        out_normal[slot] = r / d
        out_force[slot] = -scale * m * barrier(s)[1] / measure.range_
