"""Bending energy of hinges with curvature-dependent stiffness, as Warp kernels.

For a hinge of rest length l between faces of rest area a0 + a1 = A, with dihedral angle theta (0 when flat)
and curvature alpha = |theta| l / (2 A),

    E(theta) = A J(alpha),   J(alpha) = int_0^alpha k(a) a da,

k piecewise linear between the measured curvatures 0, 5, 10, 15, 20 1/m and constant beyond. Its torque is the
table's, dE/dtheta = (l / 2) k(alpha) alpha sign(theta), and for constant k it is the hinge energy
(1/4) k l^2 / (2 A) theta^2, even in theta. The Hessian keeps the part (d2E/dtheta2) grad theta grad theta^T.

Damping adds (eta / (2 dt)) k(0) (l^2 / (4 A)) (theta - theta_prev)^2.

Sources: Wang, O'Brien, Ramamoorthi 2011 (table); Bridson, Marino, Fedkiw 2003 and Tamstorf, Grinspun 2013
(gradient of the dihedral angle).
"""

import warp as wp

wp.set_module_options({"enable_backward": False})

mat43d = wp.types.matrix(shape=(4, 3), dtype=wp.float64)


@wp.struct
class BendModel:
    """Rest data of hinges, see `muslin.sim.cloth.ClothModel`; `moment` (H, 5): J at its curvatures."""

    hinges: wp.array(dtype=wp.vec4i)
    length: wp.array(dtype=wp.float64)
    area: wp.array(dtype=wp.float64)
    stiffness: wp.array2d(dtype=wp.float64)
    moment: wp.array2d(dtype=wp.float64)
    slots: wp.array2d(dtype=wp.int32)


@wp.func
def hinge_angle(x0: wp.vec3d, x1: wp.vec3d, x2: wp.vec3d, x3: wp.vec3d) -> wp.float64:
    """Signed angle between the normals of (x0, x1, x2) and (x1, x0, x3); 0 when flat, in (-pi, pi]."""
    e = x1 - x0
    n0 = wp.cross(e, x2 - x0)
    n1 = wp.cross(x3 - x0, e)
    return wp.atan2(wp.dot(wp.cross(n0, n1), e) / wp.max(wp.length(e), wp.float64(1.0e-30)), wp.dot(n0, n1))


@wp.func
def hinge_angle_gradient(x0: wp.vec3d, x1: wp.vec3d, x2: wp.vec3d, x3: wp.vec3d) -> mat43d:
    """Rows: gradients by x0, x1, x2, x3, rad/m. A collapsed face counts as having height |e| / 1000."""
    e = x1 - x0
    l2 = wp.max(wp.dot(e, e), wp.float64(1.0e-30))
    l = wp.sqrt(l2)
    n0 = wp.cross(e, x2 - x0)
    n1 = wp.cross(x3 - x0, e)
    floor = wp.float64(1.0e-6) * l2 * l2
    g2 = n0 * (-l / wp.max(wp.dot(n0, n0), floor))
    g3 = n1 * (-l / wp.max(wp.dot(n1, n1), floor))
    s2 = wp.dot(x2 - x0, e) / l2
    s3 = wp.dot(x3 - x0, e) / l2
    one = wp.float64(1.0)
    g0 = g2 * (s2 - one) + g3 * (s3 - one)
    g1 = g2 * (-s2) + g3 * (-s3)
    return mat43d(
        g0[0], g0[1], g0[2], g1[0], g1[1], g1[2], g2[0], g2[1], g2[2], g3[0], g3[1], g3[2]
    )


@wp.func
def bend_response(
    alpha: wp.float64, h: int, stiffness: wp.array2d(dtype=wp.float64), moment: wp.array2d(dtype=wp.float64)
) -> wp.vec3d:
    """J(alpha), k(alpha) alpha and its derivative with respect to alpha."""
    step = wp.float64(5.0)
    half = wp.float64(0.5)
    if alpha >= wp.float64(20.0):
        k = stiffness[h, 4]
        return wp.vec3d(moment[h, 4] + half * k * (alpha * alpha - wp.float64(400.0)), k * alpha, k)
    i = wp.min(int(alpha / step), 3)
    a0 = step * wp.float64(i)
    s = alpha - a0
    k0 = stiffness[h, i]
    slope = (stiffness[h, i + 1] - k0) / step
    k = k0 + slope * s
    piece = k0 * (a0 * s + half * s * s) + slope * (half * a0 * s * s + s * s * s / wp.float64(3.0))
    return wp.vec3d(moment[h, i] + piece, k * alpha, k + slope * alpha)


@wp.kernel
def bend_value(
    x: wp.array(dtype=wp.vec3d),
    model: BendModel,
    previous: wp.array(dtype=wp.float64),
    damping: wp.float64,
    energy: wp.array(dtype=wp.float64),
):
    """energy[0] += sum over hinges of A J(alpha)."""
    h = wp.tid()
    v = model.hinges[h]
    theta = hinge_angle(x[v[0]], x[v[1]], x[v[2]], x[v[3]])
    scale = model.length[h] / (wp.float64(2.0) * model.area[h])
    value = model.area[h] * bend_response(wp.abs(theta) * scale, h, model.stiffness, model.moment)[0]
    if damping > wp.float64(0.0):
        d = (theta - previous[h]) * scale
        value += wp.float64(0.5) * damping * model.area[h] * model.stiffness[h, 0] * d * d
    wp.atomic_add(energy, 0, value)


@wp.kernel
def bend_derivatives(
    x: wp.array(dtype=wp.vec3d),
    model: BendModel,
    previous: wp.array(dtype=wp.float64),
    damping: wp.float64,
    gradient: wp.array(dtype=wp.vec3d),
    hessian: wp.array(dtype=wp.mat33d),
):
    """Adds the gradient, N, and the positive semi-definite Hessian blocks, N/m."""
    h = wp.tid()
    v = model.hinges[h]
    x0 = x[v[0]]
    x1 = x[v[1]]
    x2 = x[v[2]]
    x3 = x[v[3]]
    theta = hinge_angle(x0, x1, x2, x3)
    grad = hinge_angle_gradient(x0, x1, x2, x3)
    area = model.area[h]
    scale = model.length[h] / (wp.float64(2.0) * area)
    r = bend_response(wp.abs(theta) * scale, h, model.stiffness, model.moment)
    torque = area * scale * r[1]
    if theta < wp.float64(0.0):
        torque = -torque
    curvature = area * scale * scale * wp.max(r[2], wp.float64(0.0))
    if damping > wp.float64(0.0):
        k = damping * area * scale * scale * model.stiffness[h, 0]
        torque += k * (theta - previous[h])
        curvature += k
    for i in range(int(0), int(4)):
        gi = wp.vec3d(grad[i, 0], grad[i, 1], grad[i, 2])
        wp.atomic_add(gradient, v[i], gi * torque)
        for j in range(int(0), int(4)):
            gj = wp.vec3d(grad[j, 0], grad[j, 1], grad[j, 2])
            wp.atomic_add(hessian, model.slots[h, 4 * i + j], wp.outer(gi * curvature, gj))


@wp.kernel
def bend_angle(x: wp.array(dtype=wp.vec3d), model: BendModel, angle: wp.array(dtype=wp.float64)):
    """Dihedral angle of every hinge."""
    h = wp.tid()
    v = model.hinges[h]
    angle[h] = hinge_angle(x[v[0]], x[v[1]], x[v[2]], x[v[3]])
