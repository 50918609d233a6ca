"""A block matrix written out, for comparison with what is computed the obvious way."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.sim.solve.block_matrix import BlockMatrix


def dense(matrix: BlockMatrix) -> NDArray[np.float64]:
    """(3 V, 3 V), the half above the diagonal mirrored from the one below it."""
    diagonal = matrix.diagonal.numpy()
    n = len(diagonal)
    lower = np.zeros((n, n, 3, 3))
    rows = np.repeat(np.arange(n), np.diff(matrix.offsets.numpy()))
    lower[rows, matrix.columns.numpy()] = matrix.values.numpy()
    count = int(matrix.extra_count.numpy()[0])
    i, j = matrix.extra_index.numpy()[:count].T
    np.add.at(lower, (i, j), matrix.extra_values.numpy()[:count])
    out = lower + lower.transpose(1, 0, 3, 2)
    out[np.arange(n), np.arange(n)] = diagonal
    return out.transpose(0, 2, 1, 3).reshape(3 * n, 3 * n)
