"""Lower half of a sparse symmetric matrix of 3 x 3 blocks: a fixed pattern, and a short list outside it.

The pattern holds the elastic stencils; only self-contact couples vertices beyond it, and those blocks go to a
list. Of (i, j) and (j, i) only the one with i > j is kept: what walks over the matrix waits for memory.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.struct
class BlockMatrix:
    """Blocks `diagonal` (V,); below it rows `offsets` (V + 1,), `columns` (L,) ascending, `values` (L,); the
    list `extra_*`.

    `extra_count[0]` runs on past the capacity of the list, so that the caller sees by how much it was too
    short.
    """

    offsets: wp.array(dtype=wp.int32)
    columns: wp.array(dtype=wp.int32)
    values: wp.array(dtype=wp.mat33d)
    diagonal: wp.array(dtype=wp.mat33d)
    extra_count: wp.array(dtype=wp.int32)
    extra_index: wp.array(dtype=wp.vec2i)
    extra_values: wp.array(dtype=wp.mat33d)


@wp.func
def find_slot(matrix: BlockMatrix, i: int, j: int) -> int:
    """Position of (i, j), i > j, in the pattern, or -1."""
    low = matrix.offsets[i]
    high = matrix.offsets[i + 1] - 1
    while low <= high:
        middle = (low + high) / 2
        column = matrix.columns[middle]
        if column == j:
            return middle
        if column < j:
            low = middle + 1
        else:
            high = middle - 1
    return -1


@wp.func
def add_block(matrix: BlockMatrix, i: int, j: int, block: wp.mat33d):
    """Adds to block (i, j), i >= j."""
    if i == j:
        wp.atomic_add(matrix.diagonal, i, block)
    else:
        slot = find_slot(matrix, i, j)
        if slot >= 0:
            wp.atomic_add(matrix.values, slot, block)
        else:
            k = wp.atomic_add(matrix.extra_count, 0, 1)
            if k < matrix.extra_index.shape[0]:
                matrix.extra_index[k] = wp.vec2i(i, j)
                matrix.extra_values[k] = block


@wp.func
def add_pair(
    gradient: wp.array(dtype=wp.vec3d),
    matrix: BlockMatrix,
    pair: wp.vec4i,
    w: wp.vec4d,
    count: int,
    force: wp.vec3d,
    block: wp.mat33d,
):
    """Adds w_i `force` to the gradient and w_i w_j `block`, symmetric, to the matrix for vertices i, j below
    `count`."""
    # int(0) keeps the loops dynamic: unrolled, the kernels compile several times longer.
    for i in range(int(0), int(4)):
        if pair[i] < count:
            wp.atomic_add(gradient, pair[i], force * w[i])
            for j in range(int(0), int(4)):
                if pair[j] <= pair[i]:
                    add_block(matrix, pair[i], pair[j], block * (w[i] * w[j]))


@wp.kernel
def add_diagonal(matrix: BlockMatrix, weight: wp.array(dtype=wp.float64)):
    """Adds weight[i] I to block (i, i)."""
    i = wp.tid()
    wp.atomic_add(matrix.diagonal, i, wp.identity(n=3, dtype=wp.float64) * weight[i])
