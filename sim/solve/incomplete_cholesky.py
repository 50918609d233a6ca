"""Incomplete Cholesky factorisation IC(0) of the pattern of a block matrix, serial, as Warp functions.

A + shift diag(A) = L L^T on the lower pattern of A. Diagonal blocks of L are kept inverted. Where a pivot is
not positive the factorisation starts again with four times the shift; at `MAX_SHIFT` it is given up for the
block diagonal.

Source: Manteuffel 1980 (shifted incomplete factorisation).
"""

import warp as wp

from muslin.sim.solve.block_matrix import BlockMatrix

wp.set_module_options({"enable_backward": False})

MAX_SHIFT = 1.0
"""Share of the diagonal at which incomplete factorisation is worth less than the block diagonal alone."""


@wp.struct
class LowerFactor:
    """Strictly lower rows `offsets`, `columns`, `values`, their positions `source` in the matrix; `inverse`
    (V,) of the diagonal."""

    offsets: wp.array(dtype=wp.int32)
    columns: wp.array(dtype=wp.int32)
    source: wp.array(dtype=wp.int32)
    values: wp.array(dtype=wp.mat33d)
    inverse: wp.array(dtype=wp.mat33d)


@wp.func
def inverse_cholesky(a: wp.mat33d) -> wp.mat33d:
    """Inverse of the lower Cholesky factor of `a`, or zero where a pivot is below 1e-10 of its diagonal."""
    zero = wp.float64(0.0)
    one = wp.float64(1.0)
    bound = wp.float64(1.0e-10) * (a[0, 0] + a[1, 1] + a[2, 2])
    p0 = a[0, 0]
    if not (p0 > bound):
        return wp.mat33d()
    l00 = wp.sqrt(p0)
    l10 = a[1, 0] / l00
    l20 = a[2, 0] / l00
    p1 = a[1, 1] - l10 * l10
    if not (p1 > bound):
        return wp.mat33d()
    l11 = wp.sqrt(p1)
    l21 = (a[2, 1] - l20 * l10) / l11
    p2 = a[2, 2] - l20 * l20 - l21 * l21
    if not (p2 > bound):
        return wp.mat33d()
    l22 = wp.sqrt(p2)
    i00 = one / l00
    i11 = one / l11
    i22 = one / l22
    i10 = -l10 * i00 * i11
    i21 = -l21 * i11 * i22
    i20 = -(l20 * i00 + l21 * i10) * i22
    return wp.mat33d(i00, zero, zero, i10, i11, zero, i20, i21, i22)


@wp.func
def try_factorise(matrix: BlockMatrix, factor: LowerFactor, shift: wp.float64) -> bool:
    """Fills `factor`; False at the first pivot that is not positive."""
    for i in range(factor.offsets.shape[0] - 1):
        begin = factor.offsets[i]
        s = matrix.values[matrix.diagonal[i]]
        s = s + wp.diag(wp.get_diag(s)) * shift
        for a in range(begin, factor.offsets[i + 1]):
            k = factor.columns[a]
            block = matrix.values[factor.source[a]]
            # Merge of the sorted rows i and k, columns below k.
            u = begin
            v = factor.offsets[k]
            v_end = factor.offsets[k + 1]
            while u < a and v < v_end:
                cu = factor.columns[u]
                cv = factor.columns[v]
                if cu == cv:
                    block -= factor.values[u] * wp.transpose(factor.values[v])
                    u = u + 1
                    v = v + 1
                elif cu < cv:
                    u = u + 1
                else:
                    v = v + 1
            l = block * wp.transpose(factor.inverse[k])
            factor.values[a] = l
            s -= l * wp.transpose(l)
        inverse = inverse_cholesky(s)
        if inverse[0, 0] == wp.float64(0.0):
            return False
        factor.inverse[i] = inverse
    return True


@wp.func
def factorise(matrix: BlockMatrix, factor: LowerFactor, shift: wp.float64) -> wp.float64:
    """Fills `factor` with the smallest of shift, 4 shift, 16 shift ... that succeeds, and returns it."""
    s = shift
    while s < wp.float64(MAX_SHIFT):
        if try_factorise(matrix, factor, s):
            return s
        s = s * wp.float64(4.0)
    for i in range(factor.offsets.shape[0] - 1):
        factor.inverse[i] = inverse_cholesky(matrix.values[matrix.diagonal[i]])
        for a in range(factor.offsets[i], factor.offsets[i + 1]):
            factor.values[a] = wp.mat33d()
    return s


@wp.func
def apply_inverse(factor: LowerFactor, r: wp.array(dtype=wp.vec3d), z: wp.array(dtype=wp.vec3d)):
    """z = (L L^T)^-1 r."""
    n = factor.offsets.shape[0] - 1
    for i in range(n):
        s = r[i]
        for a in range(factor.offsets[i], factor.offsets[i + 1]):
            s -= factor.values[a] * z[factor.columns[a]]
        z[i] = factor.inverse[i] * s
    for j in range(n):
        i = n - 1 - j
        s = wp.transpose(factor.inverse[i]) * z[i]
        z[i] = s
        for a in range(factor.offsets[i], factor.offsets[i + 1]):
            z[factor.columns[a]] = z[factor.columns[a]] - wp.transpose(factor.values[a]) * s
