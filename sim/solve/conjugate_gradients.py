"""Preconditioned conjugate gradients for A p = -g, whole in one serial kernel, for the CPU.

The iteration stops when the quadratic model q(p) = p.A p / 2 + g.p no longer falls enough: after at least 8
iterations, when the last decrease times their number is below `tolerance` times the whole decrease.

Fixed vertices keep the p they are told: their residual is zero throughout, and so is every direction there.

Source: Nash, Sofer 1990, "Assessing a search direction within a truncated-Newton method".
"""

import warp as wp

from muslin.sim.solve.block_matrix import BlockMatrix
from muslin.sim.solve.incomplete_cholesky import LowerFactor, apply_inverse, factorise

wp.set_module_options({"enable_backward": False})

HELD = wp.constant(wp.float64(1.0e9))
"""N/m on the diagonal of fixed vertices."""


@wp.struct
class Workspace:
    r: wp.array(dtype=wp.vec3d)
    z: wp.array(dtype=wp.vec3d)
    d: wp.array(dtype=wp.vec3d)
    q: wp.array(dtype=wp.vec3d)


@wp.func
def multiply(matrix: BlockMatrix, extras: int, x: wp.array(dtype=wp.vec3d), out: wp.array(dtype=wp.vec3d)):
    """out = A x"""
    for i in range(matrix.diagonal.shape[0]):
        xi = x[i]
        total = matrix.diagonal[i] * xi
        # Not range(): Warp's costs as much as two of the products.
        a = int(matrix.offsets[i])
        end = matrix.offsets[i + 1]
        while a < end:
            j = matrix.columns[a]
            block = matrix.values[a]
            total += block * x[j]
            out[j] = out[j] + xi * block
            a += 1
        out[i] = total
    for e in range(extras):
        ij = matrix.extra_index[e]
        block = matrix.extra_values[e]
        out[ij[0]] = out[ij[0]] + block * x[ij[1]]
        out[ij[1]] = out[ij[1]] + x[ij[0]] * block


@wp.kernel
def solve_serial(
    matrix: BlockMatrix,
    factor: LowerFactor,
    fixed: wp.array(dtype=wp.int32),
    gradient: wp.array(dtype=wp.vec3d),
    told: wp.array(dtype=wp.vec3d),
    p: wp.array(dtype=wp.vec3d),
    work: Workspace,
    shift: wp.float64,
    tolerance: wp.float64,
    max_iterations: int,
    report: wp.array(dtype=wp.float64),
):
    """Launch with dim = 1. report = [iterations, shift used, q(p), |r| at the end / |g|]."""
    n = matrix.diagonal.shape[0]
    extras = wp.min(matrix.extra_count[0], matrix.extra_index.shape[0])
    any_fixed = int(0)
    for i in range(n):
        work.r[i] = -gradient[i]
        p[i] = wp.vec3d()
        if fixed[i] != 0:
            any_fixed = 1
            p[i] = told[i]
            # As good as infinite beside any stiffness of cloth: the factor decouples the vertex.
            matrix.diagonal[i] = matrix.diagonal[i] + wp.identity(n=3, dtype=wp.float64) * HELD
    if any_fixed == 1:
        multiply(matrix, extras, p, work.q)
        for i in range(n):
            work.r[i] = work.r[i] - work.q[i]
            if fixed[i] != 0:
                work.r[i] = wp.vec3d()
    used = factorise(matrix, factor, shift)
    start = wp.float64(0.0)
    apply_inverse(factor, work.r, work.z)
    rz = wp.float64(0.0)
    for i in range(n):
        if fixed[i] != 0:
            work.z[i] = wp.vec3d()
        start += wp.length_sq(work.r[i])
        work.d[i] = work.z[i]
        rz += wp.dot(work.r[i], work.z[i])
    decrease = wp.float64(0.0)
    iterations = int(0)
    while iterations < max_iterations and rz > wp.float64(0.0):
        multiply(matrix, extras, work.d, work.q)
        dq = wp.float64(0.0)
        for i in range(n):
            dq += wp.dot(work.d[i], work.q[i])
        if not (dq > wp.float64(0.0)):
            break
        alpha = rz / dq
        for i in range(n):
            p[i] = p[i] + work.d[i] * alpha
            if fixed[i] == 0:
                work.r[i] = work.r[i] - work.q[i] * alpha
        iterations += 1
        gain = wp.float64(0.5) * alpha * rz
        decrease += gain
        if iterations >= 8 and wp.float64(iterations) * gain < tolerance * decrease:
            break
        apply_inverse(factor, work.r, work.z)
        next_rz = wp.float64(0.0)
        for i in range(n):
            if fixed[i] != 0:
                work.z[i] = wp.vec3d()
            next_rz += wp.dot(work.r[i], work.z[i])
        beta = next_rz / rz
        rz = next_rz
        for i in range(n):
            work.d[i] = work.z[i] + work.d[i] * beta
    end = wp.float64(0.0)
    for i in range(n):
        end += wp.length_sq(work.r[i])
    report[0] = wp.float64(iterations)
    report[1] = used
    report[2] = -decrease
    report[3] = wp.sqrt(end / wp.max(start, wp.float64(1.0e-300)))
