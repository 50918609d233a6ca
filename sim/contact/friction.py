"""Lagged Coulomb friction as a smooth dissipative potential, as Warp kernels.

A contact of the start of the step, with weights w, normal n and normal force lam, is displaced by
u = (I - n n^T) (sum_i w_i (X_i - X_i^start) + sum_i w_i s_i), body motion included. Its potential is
mu lam f0(|u|) with f0(y) = y outside eps and a cubic inside, so that the force mu lam f1(|u|) u / |u| is
smooth:

    f1(y) = 2 y / eps - (y / eps)^2 for y < eps, else 1;    f0' = f1.

s_i, the bristles, are what is elastic of the displacement so far: after a step, what each contact's u, cut
to eps, has gained goes back to its vertices on the cloth, as their mean by force. So cloth below the cone of
friction comes to rest, displaced by less than eps; without s it would creep. (Were u itself shared out, not
its gain, the bristles would spread over the cloth even at rest.) A vertex that touches nothing forgets.

Sources: Li et al. 2020, "Incremental potential contact", section 5 (potential); Dahl 1968 and Cundall, Strack
1979 (elastic displacement with a limit).
"""

import warp as wp

from muslin.sim.solve.block_matrix import BlockMatrix, add_pair

wp.set_module_options({"enable_backward": False})


@wp.struct
class FrictionModel:
    """Contacts of the start of the step; `bristle` s (V,), `slip` eps, metres."""

    pairs: wp.array(dtype=wp.vec4i)
    weights: wp.array(dtype=wp.vec4d)
    normal: wp.array(dtype=wp.vec3d)
    force: wp.array(dtype=wp.float64)
    bristle: wp.array(dtype=wp.vec3d)
    num_cloth: int
    cloth_body: wp.float64
    cloth_cloth: wp.float64
    slip: wp.float64


@wp.func
def friction_coefficient(model: FrictionModel, pair: wp.vec4i) -> wp.float64:
    for i in range(4):
        if pair[i] >= model.num_cloth:
            return model.cloth_body
    return model.cloth_cloth


@wp.func
def slip_vector(
    model: FrictionModel, k: int, x: wp.array(dtype=wp.vec3d), start: wp.array(dtype=wp.vec3d)
) -> wp.vec3d:
    pair = model.pairs[k]
    w = model.weights[k]
    n = model.normal[k]
    u = wp.vec3d()
    for i in range(int(0), int(4)):
        u += (x[pair[i]] - start[pair[i]]) * w[i]
        if pair[i] < model.num_cloth:
            u += model.bristle[pair[i]] * w[i]
    return u - n * wp.dot(n, u)


@wp.kernel
def friction_value(
    x: wp.array(dtype=wp.vec3d),
    start: wp.array(dtype=wp.vec3d),
    model: FrictionModel,
    energy: wp.array(dtype=wp.float64),
):
    """energy[0] += sum of mu lam f0(|u|)."""
    k = wp.tid()
    y = wp.length(slip_vector(model, k, x, start))
    e = model.slip
    f0 = y
    if y < e:
        f0 = -y * y * y / (wp.float64(3.0) * e * e) + y * y / e + e / wp.float64(3.0)
    wp.atomic_add(energy, 0, friction_coefficient(model, model.pairs[k]) * model.force[k] * f0)


@wp.kernel
def friction_derivatives(
    x: wp.array(dtype=wp.vec3d),
    start: wp.array(dtype=wp.vec3d),
    remaining: wp.array(dtype=wp.vec3d),
    model: FrictionModel,
    gradient: wp.array(dtype=wp.vec3d),
    matrix: BlockMatrix,
):
    """Adds gradient and the positive semi-definite Hessian mu lam (f1(|u|) / |u|) (I - n n^T)."""
    k = wp.tid()
    pair = model.pairs[k]
    w = model.weights[k]
    n = model.normal[k]
    u = slip_vector(model, k, x, start)
    y = wp.length(u)
    e = model.slip
    ratio = wp.float64(2.0) / e - y / (e * e)
    if y >= e:
        ratio = wp.float64(1.0) / y
    c = friction_coefficient(model, pair) * model.force[k] * ratio
    carried = wp.vec3d()
    for i in range(int(0), int(4)):
        if pair[i] >= model.num_cloth:
            carried += remaining[pair[i]] * w[i]
    along = (u + carried - n * wp.dot(n, carried)) * c
    block = (wp.identity(n=3, dtype=wp.float64) - wp.outer(n, n)) * c
    add_pair(gradient, matrix, pair, w, model.num_cloth, along, block)


@wp.kernel
def share_bristles(
    x: wp.array(dtype=wp.vec3d),
    start: wp.array(dtype=wp.vec3d),
    model: FrictionModel,
    total: wp.array(dtype=wp.vec3d),
    weight: wp.array(dtype=wp.float64),
):
    """Adds what each contact's displacement, cut to eps, has gained in the step to its vertices on the cloth.

    The two sides of a contact of cloth with cloth take half of it each, in opposite directions.
    """
    k = wp.tid()
    pair = model.pairs[k]
    w = model.weights[k]
    u = slip_vector(model, k, x, start)
    y = wp.length(u)
    if y > model.slip:
        u = u * (model.slip / y)
    u = u - slip_vector(model, k, start, start)
    sides = wp.float64(2.0)
    for i in range(int(0), int(4)):
        if pair[i] >= model.num_cloth:
            sides = wp.float64(1.0)
    for i in range(int(0), int(4)):
        if pair[i] < model.num_cloth and w[i] != wp.float64(0.0):
            by = model.force[k] * w[i]
            wp.atomic_add(total, pair[i], u * (by / sides))
            wp.atomic_add(weight, pair[i], wp.abs(by))


@wp.kernel
def set_bristles(
    total: wp.array(dtype=wp.vec3d), weight: wp.array(dtype=wp.float64), bristle: wp.array(dtype=wp.vec3d)
):
    """bristle += total / weight; zero where there is no contact."""
    i = wp.tid()
    if weight[i] > wp.float64(0.0):
        bristle[i] = bristle[i] + total[i] / weight[i]
    else:
        bristle[i] = wp.vec3d()
