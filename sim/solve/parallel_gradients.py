"""Block-Jacobi preconditioned conjugate gradients for A p = -g as many small kernels, for the GPU.

The iteration and its stop rule are those of `muslin.sim.solve.conjugate_gradients`; only the preconditioner
differs, since an incomplete factorisation is a serial recurrence. Scalars stay on the device and are read
back once every `CHECK_EVERY` iterations. Sums are accumulated with atomics, so that on a GPU the last bits
vary from run to run.
"""

import warp as wp

from muslin.sim.solve.block_matrix import BlockMatrix
from muslin.sim.solve.conjugate_gradients import Workspace

wp.set_module_options({"enable_backward": False})

CHECK_EVERY = 16

RZ, DQ, RZ_NEXT, GAIN, DECREASE = 0, 1, 2, 3, 4


@wp.kernel
def begin(
    matrix: BlockMatrix,
    fixed: wp.array(dtype=wp.int32),
    gradient: wp.array(dtype=wp.vec3d),
    work: Workspace,
    inverse: wp.array(dtype=wp.mat33d),
    scalars: wp.array(dtype=wp.float64),
):
    """r = -g - q, d = M^-1 r, with M the block diagonal and M^-1 zero at fixed vertices; work.q holds A p."""
    i = wp.tid()
    inverse[i] = wp.mat33d()
    if fixed[i] == 0:
        inverse[i] = wp.inverse(matrix.diagonal[i])
    r = -gradient[i] - work.q[i]
    z = inverse[i] * r
    work.r[i] = r
    work.d[i] = z
    wp.atomic_add(scalars, RZ, wp.dot(r, z))


@wp.kernel
def tell(
    fixed: wp.array(dtype=wp.int32),
    told: wp.array(dtype=wp.vec3d),
    p: wp.array(dtype=wp.vec3d),
    work: Workspace,
):
    """d = p = what is told at fixed vertices, zero elsewhere."""
    i = wp.tid()
    p[i] = wp.vec3d()
    if fixed[i] != 0:
        p[i] = told[i]
    work.d[i] = p[i]


@wp.kernel
def multiply(matrix: BlockMatrix, work: Workspace):
    """q += A d, the part in the pattern."""
    i = wp.tid()
    d = work.d[i]
    total = matrix.diagonal[i] * d
    for a in range(matrix.offsets[i], matrix.offsets[i + 1]):
        j = matrix.columns[a]
        block = matrix.values[a]
        total += block * work.d[j]
        wp.atomic_add(work.q, j, d * block)
    wp.atomic_add(work.q, i, total)


@wp.kernel
def multiply_extras(matrix: BlockMatrix, work: Workspace):
    """q += A d, the part outside the pattern."""
    e = wp.tid()
    if e < matrix.extra_count[0]:
        ij = matrix.extra_index[e]
        block = matrix.extra_values[e]
        wp.atomic_add(work.q, ij[0], block * work.d[ij[1]])
        wp.atomic_add(work.q, ij[1], work.d[ij[0]] * block)


@wp.kernel
def curvature(work: Workspace, scalars: wp.array(dtype=wp.float64)):
    """d . A d"""
    i = wp.tid()
    wp.atomic_add(scalars, DQ, wp.dot(work.d[i], work.q[i]))


@wp.kernel
def descend(
    p: wp.array(dtype=wp.vec3d),
    work: Workspace,
    inverse: wp.array(dtype=wp.mat33d),
    scalars: wp.array(dtype=wp.float64),
):
    """p += alpha d, r -= alpha q, z = M^-1 r"""
    i = wp.tid()
    alpha = wp.float64(0.0)
    if scalars[DQ] > wp.float64(0.0):
        alpha = scalars[RZ] / scalars[DQ]
    p[i] = p[i] + work.d[i] * alpha
    r = work.r[i] - work.q[i] * alpha
    z = inverse[i] * r
    work.r[i] = r
    work.z[i] = z
    wp.atomic_add(scalars, RZ_NEXT, wp.dot(r, z))


@wp.kernel
def turn(work: Workspace, scalars: wp.array(dtype=wp.float64)):
    """d = z + beta d"""
    i = wp.tid()
    beta = wp.float64(0.0)
    if scalars[RZ] > wp.float64(0.0):
        beta = scalars[RZ_NEXT] / scalars[RZ]
    work.d[i] = work.z[i] + work.d[i] * beta


@wp.kernel
def account(scalars: wp.array(dtype=wp.float64)):
    """Book the decrease of the model, make the scalars ready for the next iteration; launch with dim = 1."""
    gain = wp.float64(0.0)
    if scalars[DQ] > wp.float64(0.0):
        gain = wp.float64(0.5) * scalars[RZ] * scalars[RZ] / scalars[DQ]
    scalars[GAIN] = gain
    scalars[DECREASE] = scalars[DECREASE] + gain
    scalars[RZ] = scalars[RZ_NEXT]
    scalars[RZ_NEXT] = wp.float64(0.0)
    scalars[DQ] = wp.float64(0.0)


def solve_parallel(
    matrix: BlockMatrix,
    fixed: wp.array,
    gradient: wp.array,
    told: wp.array,
    p: wp.array,
    work: Workspace,
    inverse: wp.array,
    scalars: wp.array,
    tolerance: float,
    max_iterations: int,
) -> int:
    """Fill p's first V entries; returns the iterations made. `inverse` (V,), `scalars` (5,) are scratch."""
    device = gradient.device
    n = len(gradient)
    scalars.zero_()
    wp.launch(tell, n, [fixed, told, p, work], device=device)
    work.q.zero_()
    wp.launch(multiply, n, [matrix, work], device=device)
    wp.launch(multiply_extras, len(matrix.extra_index), [matrix, work], device=device)
    wp.launch(begin, n, [matrix, fixed, gradient, work, inverse, scalars], device=device)
    for iteration in range(1, max_iterations + 1):
        work.q.zero_()
        wp.launch(multiply, n, [matrix, work], device=device)
        wp.launch(multiply_extras, len(matrix.extra_index), [matrix, work], device=device)
        wp.launch(curvature, n, [work, scalars], device=device)
        wp.launch(descend, n, [p, work, inverse, scalars], device=device)
        wp.launch(turn, n, [work, scalars], device=device)
        wp.launch(account, 1, [scalars], device=device)
        if iteration % CHECK_EVERY == 0:
            values = scalars.numpy()
            if iteration * values[GAIN] < tolerance * values[DECREASE] or not values[GAIN] > 0.0:
                return iteration
    return max_iterations
