"""In-plane energy of cloth with strain- and direction-dependent stiffness, as Warp kernels.

With Green strain G = (F^T F - I)/2 in warp/weft coordinates, the measured table gives the stress

    s11 = 2 (c11 G11 + c12 G22),  s22 = 2 (c12 G11 + c22 G22),  s12 = c33 G12,
    c = c_rest + t(g) dc(theta, a),   t(g) = clamp(6 (sqrt(1 + 2 g) - 1), 0, 1),

g the larger principal strain, theta its angle to the warp, dc = c_strained(theta) - c_rest. A stress given
so is not the gradient of any energy. The energy here is its work along the straight path from rest,

    W(G) = int_0^1 s(tau G) : G dtau = q(c_rest, G) + 2 T(g) q(dc, G),
    q(c, G) = c11 G11^2 + 2 c12 G11 G22 + c22 G22^2 + c33 G12^2,
    g^2 T(g) = I(g) = int_0^g s t(s) ds,

so that pulling along any fixed direction of strain reproduces the table, and the force is W's exact gradient.
Cloth compressed more one way than it is stretched the other is outside of what was measured; there dc fades,
times b = S(min(1, 2 g1 / (g1 - g2))). Without that W has a kink at g1 = 0 for every g2 < 0, where wrinkled
cloth comes to rest, and no solver can balance the forces there.
Where both principal strains are alike, theta has no meaning: dc turns to its mean over theta with
a = S(min(1, (g1 - g2) / g1)), which is 1 in every uniaxial test. Between the measured angles the table is
interpolated with S(u) = u^2 (3 - 2 u): straight lines would put kinks into W at every measured angle, where
cloth comes to rest with forces that no solver can balance.

The Hessian is positive semi-definite by construction: tangent coefficients c_rest + (t + g t') dc clamped to
be non-negative, and the geometric part of the positive principal stresses only.

Damping adds (eta / (2 dt)) (G - G_prev) : C_rest : (G - G_prev) per area, eta in seconds.

Sources: Wang, O'Brien, Ramamoorthi 2011 (table); Volino, Magnenat-Thalmann, Faure 2009 (Green strain).
"""

import math

import warp as wp

from muslin.sim.solve.block_matrix import BlockMatrix

wp.set_module_options({"enable_backward": False})

# Named, because arithmetic between literals within a kernel is done in single precision.
FULL_BLEND = wp.constant(wp.float64(13.0 / 72.0))
"""Green strain at which t reaches 1: a principal stretch of 7/6."""
ROW_ANGLE = wp.constant(wp.float64(math.pi / 8.0))
"""Angle between two rows of the table."""

mat32d = wp.types.matrix(shape=(3, 2), dtype=wp.float64)
strainv = wp.types.vector(length=3, dtype=wp.float64)


@wp.struct
class StretchModel:
    """Per-face rest data: see `muslin.sim.cloth.ClothModel`; vertices ascending, one fabric a face."""

    faces: wp.array(dtype=wp.vec3i)
    inverse_rest: wp.array(dtype=wp.mat22d)
    rest_area: wp.array(dtype=wp.float64)
    fabric: wp.array(dtype=wp.int32)
    rest: wp.array2d(dtype=wp.float64)
    strained: wp.array3d(dtype=wp.float64)
    slots: wp.array2d(dtype=wp.int32)


@wp.func
def deformation_gradient(x0: wp.vec3d, x1: wp.vec3d, x2: wp.vec3d, b: wp.mat22d) -> mat32d:
    d1 = x1 - x0
    d2 = x2 - x0
    f1 = d1 * b[0, 0] + d2 * b[1, 0]
    f2 = d1 * b[0, 1] + d2 * b[1, 1]
    return mat32d(f1[0], f2[0], f1[1], f2[1], f1[2], f2[2])


@wp.func
def green_strain(f: mat32d) -> strainv:
    """(G11, G22, G12) of a deformation gradient."""
    half = wp.float64(0.5)
    one = wp.float64(1.0)
    f1 = wp.vec3d(f[0, 0], f[1, 0], f[2, 0])
    f2 = wp.vec3d(f[0, 1], f[1, 1], f[2, 1])
    return strainv(half * (wp.dot(f1, f1) - one), half * (wp.dot(f2, f2) - one), half * wp.dot(f1, f2))


@wp.func
def q_form(c: wp.vec4d, g: strainv) -> wp.float64:
    return c[0] * g[0] * g[0] + wp.float64(2.0) * c[1] * g[0] * g[1] + c[2] * g[1] * g[1] + c[3] * g[2] * g[2]


@wp.func
def stress_of(c: wp.vec4d, g: strainv) -> strainv:
    """(s11, s22, s12) of the linear law, the gradient of q; s12 counts in both corners."""
    two = wp.float64(2.0)
    return strainv(two * (c[0] * g[0] + c[1] * g[1]), two * (c[1] * g[0] + c[2] * g[1]), c[3] * g[2])


@wp.func
def elongation(g: wp.float64) -> wp.float64:
    """sqrt(1 + 2 g) - 1, principal stretch less 1, without cancellation; 0 in compression."""
    one = wp.float64(1.0)
    two_g = wp.float64(2.0) * wp.max(g, wp.float64(0.0))
    return two_g / (wp.sqrt(one + two_g) + one)


@wp.func
def blend_weight(g: wp.float64) -> wp.float64:
    """t(g)."""
    return wp.min(wp.float64(6.0) * elongation(g), wp.float64(1.0))


@wp.func
def blend_moment(g: wp.float64) -> wp.float64:
    """I(g) = int_0^g s t(s) ds = d^3 (2 + 9/4 d + 3/5 d^2) up to full blend, d the elongation."""
    s = wp.clamp(g, wp.float64(0.0), FULL_BLEND)
    d = elongation(s)
    moment = d * d * d * (wp.float64(2.0) + d * (wp.float64(2.25) + d * wp.float64(0.6)))
    beyond = wp.max(g, s)
    return moment + wp.float64(0.5) * (beyond * beyond - s * s)


@wp.func
def strained_at(strained: wp.array3d(dtype=wp.float64), m: int, row: int) -> wp.vec4d:
    return wp.vec4d(strained[m, row, 0], strained[m, row, 1], strained[m, row, 2], strained[m, row, 3])


@wp.struct
class Response:
    """Energy density W, stress S = (S11, S22, S12) = dW/dG, tangent coefficients c."""

    energy: wp.float64
    stress: strainv
    tangent: wp.vec4d


@wp.func
def respond(
    g: strainv, m: int, rest: wp.array2d(dtype=wp.float64), strained: wp.array3d(dtype=wp.float64)
) -> Response:
    zero = wp.float64(0.0)
    half = wp.float64(0.5)
    one = wp.float64(1.0)
    two = wp.float64(2.0)
    c = wp.vec4d(rest[m, 0], rest[m, 1], rest[m, 2], rest[m, 3])
    out = Response()
    out.energy = q_form(c, g)
    out.stress = stress_of(c, g)
    out.tangent = c

    mean = half * (g[0] + g[1])
    h = half * (g[0] - g[1])
    r = wp.sqrt(h * h + g[2] * g[2])
    g1 = mean + r
    if g1 > wp.float64(1.0e-12):
        angle = half * wp.atan2(g[2], h)
        position = wp.abs(angle) / ROW_ANGLE
        row = wp.min(int(position), 3)
        u = position - wp.float64(row)
        w = u * u * (wp.float64(3.0) - two * u)
        dw = wp.float64(6.0) * u * (one - u)
        low = strained_at(strained, m, row)
        high = strained_at(strained, m, row + 1)
        average = (
            strained_at(strained, m, 0) * half
            + strained_at(strained, m, 1)
            + strained_at(strained, m, 2)
            + strained_at(strained, m, 3)
            + strained_at(strained, m, 4) * half
        ) * wp.float64(0.25)
        ratio = wp.min(one, two * r / g1)
        a = ratio * ratio * (wp.float64(3.0) - two * ratio)
        directional = low * (one - w) + high * w - average
        change = average + directional * a - c
        # g1 < r: the other principal strain is the larger one in size, and negative.
        tension = one
        if g1 < r:
            tension = g1 / r
        b = tension * tension * (wp.float64(3.0) - two * tension)
        dc = change * b

        t = blend_weight(g1)
        T = blend_moment(g1) / (g1 * g1)
        dT = (t - two * T) / g1
        q = q_form(dc, g)
        out.energy += two * T * q
        s = stress_of(dc, g) * (two * T)
        s11 = s[0]
        s22 = s[1]
        s12 = s[2]
        if r > wp.float64(1.0e-14):
            # Derivatives of (g1, theta, a) with respect to (G11, G22, G12); 2 S12 = dW/dG12.
            d1 = strainv(half + half * h / r, half - half * h / r, g[2] / r)
            along = two * dT * q
            sign = one
            if angle < zero:
                sign = -one
            turn = sign * two * T * a * b * q_form((high - low) * (dw / ROW_ANGLE), g)
            dtheta = strainv(-g[2], g[2], two * h) * (wp.float64(0.25) / (r * r))
            blend = zero
            dr = strainv(half * h / r, -half * h / r, g[2] / r)
            da = strainv(zero, zero, zero)
            if ratio < one:
                blend = two * T * b * q_form(directional, g)
                da = (dr - d1 * (r / g1)) * (wp.float64(6.0) * ratio * (one - ratio) * two / g1)
            total = d1 * along + dtheta * turn + da * blend
            if tension < one:
                fade = wp.float64(12.0) * T * tension * (one - tension) * q_form(change, g) / r
                total += (d1 - dr * tension) * fade
            s11 += total[0]
            s22 += total[1]
            s12 += half * total[2]
        else:
            # No direction is the larger one: the mean of d1 over all of them.
            s11 += dT * q
            s22 += dT * q
        out.stress += strainv(s11, s22, s12)
        slope = zero
        if t < one:
            slope = wp.float64(6.0) * g1 / wp.sqrt(one + two * g1)
        tangent = c + dc * (t + slope)
        c11 = wp.max(tangent[0], zero)
        c22 = wp.max(tangent[2], zero)
        bound = wp.float64(0.95) * wp.sqrt(c11 * c22)
        out.tangent = wp.vec4d(c11, wp.clamp(tangent[1], -bound, bound), c22, wp.max(tangent[3], zero))
    return out


@wp.func
def positive_part(s: strainv) -> strainv:
    """Positive semi-definite part of the symmetric matrix [[s0, s2], [s2, s1]]."""
    half = wp.float64(0.5)
    zero = wp.float64(0.0)
    mean = half * (s[0] + s[1])
    h = half * (s[0] - s[1])
    r = wp.sqrt(h * h + s[2] * s[2])
    high = mean + r
    low = mean - r
    if low >= zero:
        return s
    if high <= zero:
        return strainv(zero, zero, zero)
    # projector onto the larger eigenvector: (A - low I) / (high - low)
    k = high / (high - low)
    return strainv((s[0] - low) * k, (s[1] - low) * k, s[2] * k)


@wp.func
def corner_stiffness(
    ni: wp.vec2d, nj: wp.vec2d, f1: wp.vec3d, f2: wp.vec3d, c: wp.vec4d, s: strainv
) -> wp.mat33d:
    """B_i^T C B_j + n_i^T S n_j I with B_i = [n_i1 f1; n_i2 f2; n_i2 f1 + n_i1 f2]."""
    k11 = c[0] * ni[0] * nj[0] + c[3] * ni[1] * nj[1]
    k12 = c[1] * ni[0] * nj[1] + c[3] * ni[1] * nj[0]
    k21 = c[1] * ni[1] * nj[0] + c[3] * ni[0] * nj[1]
    k22 = c[2] * ni[1] * nj[1] + c[3] * ni[0] * nj[0]
    block = wp.outer(f1, f1 * k11 + f2 * k12) + wp.outer(f2, f1 * k21 + f2 * k22)
    geometric = ni[0] * (s[0] * nj[0] + s[2] * nj[1]) + ni[1] * (s[2] * nj[0] + s[1] * nj[1])
    block[0, 0] = block[0, 0] + geometric
    block[1, 1] = block[1, 1] + geometric
    block[2, 2] = block[2, 2] + geometric
    return block


@wp.kernel
def stretch_value(
    x: wp.array(dtype=wp.vec3d),
    model: StretchModel,
    previous: wp.array(dtype=strainv),
    damping: wp.float64,
    energy: wp.array(dtype=wp.float64),
):
    """energy[0] += sum over faces of A W(G); `damping` is eta / dt, `previous` the strain it refers to."""
    f = wp.tid()
    face = model.faces[f]
    F = deformation_gradient(x[face[0]], x[face[1]], x[face[2]], model.inverse_rest[f])
    g = green_strain(F)
    m = model.fabric[f]
    w = respond(g, m, model.rest, model.strained).energy
    if damping > wp.float64(0.0):
        c = wp.vec4d(model.rest[m, 0], model.rest[m, 1], model.rest[m, 2], model.rest[m, 3])
        w += damping * q_form(c, g - previous[f])
    wp.atomic_add(energy, 0, model.rest_area[f] * w)


@wp.kernel
def stretch_derivatives(
    x: wp.array(dtype=wp.vec3d),
    model: StretchModel,
    previous: wp.array(dtype=strainv),
    damping: wp.float64,
    gradient: wp.array(dtype=wp.vec3d),
    matrix: BlockMatrix,
):
    """Adds the gradient, N, and the positive semi-definite Hessian blocks, N/m."""
    f = wp.tid()
    face = model.faces[f]
    b = model.inverse_rest[f]
    F = deformation_gradient(x[face[0]], x[face[1]], x[face[2]], b)
    g = green_strain(F)
    m = model.fabric[f]
    response = respond(g, m, model.rest, model.strained)
    s = response.stress
    c = response.tangent
    two = wp.float64(2.0)
    if damping > wp.float64(0.0):
        rest = wp.vec4d(model.rest[m, 0], model.rest[m, 1], model.rest[m, 2], model.rest[m, 3])
        d = g - previous[f]
        s += stress_of(rest, d) * damping
        c += rest * damping
    area = model.rest_area[f]
    f1 = wp.vec3d(F[0, 0], F[1, 0], F[2, 0])
    f2 = wp.vec3d(F[0, 1], F[1, 1], F[2, 1])
    p1 = (f1 * s[0] + f2 * s[2]) * area
    p2 = (f1 * s[2] + f2 * s[1]) * area
    positive = positive_part(s) * area
    coefficients = wp.vec4d(two * c[0], two * c[1], two * c[2], wp.float64(0.5) * c[3]) * area
    # Gradients of the shape functions of corners 1 and 2. Corner 0 has what makes every sum over corners
    # vanish: to move all of them alike strains nothing.
    n1 = wp.vec2d(b[0, 0], b[0, 1])
    n2 = wp.vec2d(b[1, 0], b[1, 1])
    g1 = p1 * n1[0] + p2 * n1[1]
    g2 = p1 * n2[0] + p2 * n2[1]
    wp.atomic_add(gradient, face[0], -(g1 + g2))
    wp.atomic_add(gradient, face[1], g1)
    wp.atomic_add(gradient, face[2], g2)
    k11 = corner_stiffness(n1, n1, f1, f2, coefficients, positive)
    k21 = corner_stiffness(n2, n1, f1, f2, coefficients, positive)
    k22 = corner_stiffness(n2, n2, f1, f2, coefficients, positive)
    k10 = -(k11 + wp.transpose(k21))
    k20 = -(k21 + k22)
    wp.atomic_add(matrix.diagonal, face[0], -(k10 + k20))
    wp.atomic_add(matrix.diagonal, face[1], k11)
    wp.atomic_add(matrix.diagonal, face[2], k22)
    wp.atomic_add(matrix.values, model.slots[f, 0], k10)
    wp.atomic_add(matrix.values, model.slots[f, 1], k20)
    wp.atomic_add(matrix.values, model.slots[f, 2], k21)


@wp.kernel
def stretch_strain(x: wp.array(dtype=wp.vec3d), model: StretchModel, strain: wp.array(dtype=strainv)):
    """Green strain of every face."""
    f = wp.tid()
    face = model.faces[f]
    strain[f] = green_strain(deformation_gradient(x[face[0]], x[face[1]], x[face[2]], model.inverse_rest[f]))
