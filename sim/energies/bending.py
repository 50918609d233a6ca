"""Bending energy of the curvature of triangles, with curvature-dependent rigidity, as Warp kernels.

With K = (K11, K22, K12) the curvature of a triangle in warp/weft coordinates, a linear function of hinge
angles (`muslin.sim.curvature`), k = |K| = sqrt(K11^2 + K22^2 + 2 K12^2), and q_c the form

    q_c(K) = c11 K11^2 + 2 c12 K11 K22 + c22 K22^2 + 4 c66 K12^2,

the energy of an area is the work of bending it from flat on the straight path to K,

    W(K) = q_T(K),   T(k) = J(k) / k^2,   J(k) = int_0^k D(s) s ds,

D = (D11, D12, D22, D66) the rigidities, N m, piecewise linear between the curvatures 0, 10, 20, 30, 40 1/m
and constant beyond. Rolled to a cylinder, the cloth needs the moment of the table; for constant D, W is
q_D(K) / 2, the orthotropic plate. W is even in K, and its gradient is exact:

    dW = 2 K^T T dK + q_T'(K) dk,   T' = (D - 2 T) / k.

The Hessian is one of hinges, with the coefficient 3/2 A w . D(k) w of (d theta)^2 for K = sum w theta: it
keeps to the hinges' own vertices, and the half stands for the coupling that it leaves out.

Damping adds (eta / (2 dt)) q_D(0)(K - K_prev) to the energy of an area.

Sources: Wang, O'Brien, Ramamoorthi 2011 (table); Timoshenko, Woinowsky-Krieger 1959 (orthotropic plate);
Bridson, Marino, Fedkiw 2003 and Tamstorf, Grinspun 2013 (gradient of the dihedral angle).
"""

import warp as wp

from muslin.sim.solve.block_matrix import BlockMatrix

wp.set_module_options({"enable_backward": False})

COUPLING = wp.constant(wp.float64(1.5))
"""Stiffness of a hinge in the Hessian, over that of its own angle alone."""

mat43d = wp.types.matrix(shape=(4, 3), dtype=wp.float64)
curvaturev = wp.types.vector(length=3, dtype=wp.float64)


@wp.struct
class BendModel:
    """Rest data: `hinges` (H,); `rest_area` (F,), m^2; the curvature of face f, sum of `weight` (N,), 1/m,
    times the angles of hinges `member` (N,), both from offsets[f] to offsets[f + 1]; of each `fabric` (F,),
    a row each, `rigidity` D, N m, and `moment` J, N m / m^2, at curvatures in steps of `spacing`, 1/m;
    `order` (H,) of the hinges' vertices, ascending, and in it `slots` (H, 6) of their blocks below the
    diagonal."""

    hinges: wp.array(dtype=wp.vec4i)
    rest_area: wp.array(dtype=wp.float64)
    offsets: wp.array(dtype=wp.int32)
    member: wp.array(dtype=wp.int32)
    weight: wp.array(dtype=curvaturev)
    fabric: wp.array(dtype=wp.int32)
    rigidity: wp.array2d(dtype=wp.vec4d)
    moment: wp.array2d(dtype=wp.vec4d)
    spacing: wp.float64
    order: wp.array(dtype=wp.vec4i)
    slots: wp.array2d(dtype=wp.int32)


@wp.struct
class BendState:
    """Per hinge: `angle`, `torque` (dW/dtheta, N m) and `stiffness` (N m) of the Hessian."""

    angle: wp.array(dtype=wp.float64)
    torque: wp.array(dtype=wp.float64)
    stiffness: wp.array(dtype=wp.float64)


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
    return mat43d(g0[0], g0[1], g0[2], g1[0], g1[1], g1[2], g2[0], g2[1], g2[2], g3[0], g3[1], g3[2])


@wp.func
def apply_form(c: wp.vec4d, k: curvaturev) -> curvaturev:
    """Half the gradient of q_c at k."""
    return curvaturev(c[0] * k[0] + c[1] * k[1], c[1] * k[0] + c[2] * k[1], wp.float64(4.0) * c[3] * k[2])


@wp.struct
class Rigidity:
    """At one curvature k: D, T and T' / k."""

    tangent: wp.vec4d
    mean: wp.vec4d
    slope: wp.vec4d


@wp.func
def rigidity_at(
    k: wp.float64,
    fabric: int,
    rigidity: wp.array2d(dtype=wp.vec4d),
    moment: wp.array2d(dtype=wp.vec4d),
    spacing: wp.float64,
) -> Rigidity:
    half = wp.float64(0.5)
    two = wp.float64(2.0)
    out = Rigidity()
    last = rigidity.shape[1] - 1
    i = last
    if k < spacing * wp.float64(last):
        i = int(k / spacing)
    start = spacing * wp.float64(i)
    s = k - start
    d0 = rigidity[fabric, i]
    m = wp.vec4d()
    if i < last:
        m = (rigidity[fabric, i + 1] - d0) / spacing
    out.tangent = d0 + m * s
    if i == 0:
        # Closed forms, exact down to k = 0.
        out.mean = d0 * half + m * (k / wp.float64(3.0))
        out.slope = m / (wp.float64(3.0) * wp.max(k, wp.float64(1.0e-30)))
    else:
        j = moment[fabric, i] + d0 * (start * s + half * s * s)
        j += m * (half * start * s * s + s * s * s / wp.float64(3.0))
        out.mean = j / (k * k)
        out.slope = (out.tangent - out.mean * two) / (k * k)
    return out


@wp.func
def face_curvature(f: int, model: BendModel, angle: wp.array(dtype=wp.float64)) -> curvaturev:
    """K of a face, 1/m."""
    k = curvaturev()
    # Not range(), here and below: Warp's is dearer than the products.
    a = int(model.offsets[f])
    end = model.offsets[f + 1]
    while a < end:
        k += model.weight[a] * angle[model.member[a]]
        a += 1
    return k


@wp.func
def norm(k: curvaturev) -> wp.float64:
    return wp.sqrt(k[0] * k[0] + k[1] * k[1] + wp.float64(2.0) * k[2] * k[2])


@wp.kernel
def bend_angle(x: wp.array(dtype=wp.vec3d), model: BendModel, state: BendState):
    """Dihedral angle of every hinge; clears torque and stiffness."""
    h = wp.tid()
    v = model.hinges[h]
    state.angle[h] = hinge_angle(x[v[0]], x[v[1]], x[v[2]], x[v[3]])
    state.torque[h] = wp.float64(0.0)
    state.stiffness[h] = wp.float64(0.0)


@wp.kernel
def bend_curvature(model: BendModel, state: BendState, curvature: wp.array(dtype=curvaturev)):
    """K of every face, from the angles in `state`."""
    f = wp.tid()
    curvature[f] = face_curvature(f, model, state.angle)


@wp.kernel
def bend_value(
    model: BendModel,
    state: BendState,
    previous: wp.array(dtype=curvaturev),
    damping: wp.float64,
    energy: wp.array(dtype=wp.float64),
):
    """energy[0] += sum over faces of A W(K), from the angles in `state`; `damping` is eta / dt."""
    f = wp.tid()
    k = face_curvature(f, model, state.angle)
    fabric = model.fabric[f]
    r = rigidity_at(norm(k), fabric, model.rigidity, model.moment, model.spacing)
    w = wp.dot(k, apply_form(r.mean, k))
    if damping > wp.float64(0.0):
        d = k - previous[f]
        w += wp.float64(0.5) * damping * wp.dot(d, apply_form(model.rigidity[fabric, 0], d))
    wp.atomic_add(energy, 0, model.rest_area[f] * w)


@wp.kernel
def bend_torque(
    model: BendModel,
    state: BendState,
    previous: wp.array(dtype=curvaturev),
    damping: wp.float64,
):
    """Adds to torque and stiffness of the hinges what the faces have from the angles in `state`."""
    f = wp.tid()
    area = model.rest_area[f]
    k = face_curvature(f, model, state.angle)
    fabric = model.fabric[f]
    r = rigidity_at(norm(k), fabric, model.rigidity, model.moment, model.spacing)
    along = wp.dot(k, apply_form(r.slope, k))
    m = apply_form(r.mean, k) * wp.float64(2.0)
    m += curvaturev(k[0], k[1], wp.float64(2.0) * k[2]) * along
    tangent = r.tangent
    if damping > wp.float64(0.0):
        m += apply_form(model.rigidity[fabric, 0], k - previous[f]) * damping
        tangent += model.rigidity[fabric, 0] * damping
    a = int(model.offsets[f])
    end = model.offsets[f + 1]
    while a < end:
        w = model.weight[a]
        wp.atomic_add(state.torque, model.member[a], area * wp.dot(w, m))
        stiffness = COUPLING * area * wp.dot(w, apply_form(tangent, w))
        wp.atomic_add(state.stiffness, model.member[a], stiffness)
        a += 1


@wp.kernel
def bend_derivatives(
    x: wp.array(dtype=wp.vec3d),
    model: BendModel,
    state: BendState,
    gradient: wp.array(dtype=wp.vec3d),
    matrix: BlockMatrix,
):
    """Adds the gradient, N, and the positive semi-definite Hessian blocks, N/m, of the torques in `state`."""
    h = wp.tid()
    v = model.hinges[h]
    grad = hinge_angle_gradient(x[v[0]], x[v[1]], x[v[2]], x[v[3]])
    torque = state.torque[h]
    stiffness = state.stiffness[h]
    order = model.order[h]
    slot = int(0)
    a = int(0)
    while a < 4:
        i = order[a]
        gi = wp.vec3d(grad[i, 0], grad[i, 1], grad[i, 2])
        wp.atomic_add(gradient, v[i], gi * torque)
        row = gi * stiffness
        b = int(0)
        while b < a:
            j = order[b]
            gj = wp.vec3d(grad[j, 0], grad[j, 1], grad[j, 2])
            wp.atomic_add(matrix.values, model.slots[h, slot], wp.outer(row, gj))
            slot += 1
            b += 1
        wp.atomic_add(matrix.diagonal, v[i], wp.outer(row, gi))
        a += 1
