"""Incomplete Cholesky factorisation IC(0) of the pattern of a block matrix, serial, as Warp functions.

A + shift diag(A) = L L^T on the lower pattern of A. Diagonal blocks of L are kept inverted. Where a pivot is
not positive the factorisation starts again with four times the shift; at `MAX_SHIFT` it is given up for the
block diagonal.

Source: Manteuffel 1980 (shifted incomplete factorisation).
"""

import numpy as np
import warp as wp
from numpy.typing import NDArray

from muslin.sim.solve.block_matrix import BlockMatrix

wp.set_module_options({"enable_backward": False})

MAX_SHIFT = 1.0
"""Share of the diagonal at which incomplete factorisation is worth less than the block diagonal alone."""


@wp.struct
class LowerFactor:
    """`values` (L,) below the diagonal, at the `offsets` and `columns` of the matrix, `inverse` (V,) of the
    diagonal.

    Entry a = (i, k) needs sum_c L_ic L_kc^T: `products` (P,) are the positions of the two factors, those of a
    from product_offsets[a] to product_offsets[a + 1].
    """

    offsets: wp.array(dtype=wp.int32)
    columns: wp.array(dtype=wp.int32)
    product_offsets: wp.array(dtype=wp.int32)
    products: wp.array(dtype=wp.vec2i)
    values: wp.array(dtype=wp.mat33d)
    inverse: wp.array(dtype=wp.mat33d)


def factor_products(
    offsets: NDArray[np.int32], columns: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """`product_offsets` (L + 1,) and `products` (P, 2) of a strictly lower pattern, for `LowerFactor`."""
    pattern = [wp.array(array, dtype=wp.int32, device="cpu") for array in (offsets, columns)]
    ends = wp.zeros(len(columns) + 1, dtype=wp.int32, device="cpu")
    products = wp.zeros(0, dtype=wp.vec2i, device="cpu")
    # Once to count them, once to write them.
    for _ in range(2):
        wp.launch(list_products, 1, inputs=[*pattern, ends, products], device="cpu")
        if len(products) == 0:
            products = wp.zeros(int(ends.numpy()[-1]), dtype=wp.vec2i, device="cpu")
    return ends.numpy(), products.numpy()


@wp.kernel
def list_products(
    offsets: wp.array(dtype=wp.int32),
    columns: wp.array(dtype=wp.int32),
    ends: wp.array(dtype=wp.int32),
    products: wp.array(dtype=wp.vec2i),
):
    """Products of every entry (i, k), one after the other, as far as there is room for them: entries of rows
    i and k in the same column, both rows gone through at once. Serial."""
    total = int(0)
    for i in range(offsets.shape[0] - 1):
        for a in range(offsets[i], offsets[i + 1]):
            k = columns[a]
            u = int(offsets[i])
            v = int(offsets[k])
            end = offsets[k + 1]
            while u < a and v < end:
                if columns[u] == columns[v]:
                    if total < products.shape[0]:
                        products[total] = wp.vec2i(u, v)
                    total += 1
                    u += 1
                    v += 1
                elif columns[u] < columns[v]:
                    u += 1
                else:
                    v += 1
            ends[a + 1] = total


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
        s = matrix.diagonal[i]
        s = s + wp.diag(wp.get_diag(s)) * shift
        for a in range(factor.offsets[i], factor.offsets[i + 1]):
            k = factor.columns[a]
            block = matrix.values[a]
            # Not range(): Warp's costs as much as two of the products.
            b = int(factor.product_offsets[a])
            end = factor.product_offsets[a + 1]
            while b < end:
                uv = factor.products[b]
                block -= factor.values[uv[0]] * wp.transpose(factor.values[uv[1]])
                b += 1
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
        factor.inverse[i] = inverse_cholesky(matrix.diagonal[i])
        for a in range(factor.offsets[i], factor.offsets[i + 1]):
            factor.values[a] = wp.mat33d()
    return s


@wp.func
def apply_inverse(factor: LowerFactor, r: wp.array(dtype=wp.vec3d), z: wp.array(dtype=wp.vec3d)):
    """z = (L L^T)^-1 r."""
    n = factor.offsets.shape[0] - 1
    for i in range(n):
        s = r[i]
        a = int(factor.offsets[i])
        end = factor.offsets[i + 1]
        while a < end:
            s -= factor.values[a] * z[factor.columns[a]]
            a += 1
        z[i] = factor.inverse[i] * s
    for j in range(n):
        i = n - 1 - j
        s = z[i] * factor.inverse[i]
        z[i] = s
        a = int(factor.offsets[i])
        end = factor.offsets[i + 1]
        while a < end:
            z[factor.columns[a]] = z[factor.columns[a]] - s * factor.values[a]
            a += 1
