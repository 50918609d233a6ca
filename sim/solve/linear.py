"""The Newton system on a device: storage of the block matrix and its solution."""

from __future__ import annotations

import numpy as np
import warp as wp
from numpy.typing import NDArray

from muslin.sim.cloth import ClothModel
from muslin.sim.solve.block_matrix import BlockMatrix, add_diagonal
from muslin.sim.solve.conjugate_gradients import Workspace, solve_serial
from muslin.sim.solve.incomplete_cholesky import MAX_SHIFT, LowerFactor, factor_products
from muslin.sim.solve.parallel_gradients import solve_parallel


class LinearSystem:
    """Matrix A in the pattern of a cloth and the solution of A p = -g.

    On the CPU one serial kernel with incomplete Cholesky, on a GPU many `parallel` ones with block Jacobi.
    """

    def __init__(
        self, cloth: ClothModel, device: str, shift: float = 0.005, parallel: bool | None = None
    ) -> None:
        self.device = device
        self.parallel = wp.get_device(device).is_cuda if parallel is None else parallel
        n = cloth.num_vertices
        offsets, columns = cloth.pattern
        m = BlockMatrix()
        m.offsets = wp.array(offsets, dtype=wp.int32, device=device)
        m.columns = wp.array(columns, dtype=wp.int32, device=device)
        m.values = wp.zeros(len(columns), dtype=wp.mat33d, device=device)
        m.diagonal = wp.zeros(n, dtype=wp.mat33d, device=device)
        m.extra_count = wp.zeros(1, dtype=wp.int32, device=device)
        self.matrix = m
        self._reserve_extras(16 * n)

        f = LowerFactor()
        f.offsets = m.offsets
        f.columns = m.columns
        product_offsets, products = factor_products(offsets, columns)
        f.product_offsets = wp.array(product_offsets, dtype=wp.int32, device=device)
        f.products = wp.array(products, dtype=wp.vec2i, device=device)
        f.values = wp.zeros(len(columns), dtype=wp.mat33d, device=device)
        f.inverse = wp.zeros(n, dtype=wp.mat33d, device=device)
        self.factor = f
        self.smallest_shift = shift
        self.shift = shift

        self.fixed = wp.zeros(n, dtype=wp.int32, device=device)
        w = Workspace()
        for name in ("r", "z", "d", "q"):
            setattr(w, name, wp.zeros(n, dtype=wp.vec3d, device=device))
        self.work = w
        self.report = wp.zeros(4, dtype=wp.float64, device=device)
        self.scalars = wp.zeros(5, dtype=wp.float64, device=device)

    def clear(self) -> None:
        self.matrix.diagonal.zero_()
        self.matrix.values.zero_()
        self.matrix.extra_count.zero_()

    def fix(self, fixed: NDArray[np.bool_]) -> None:
        """From now on the solution is told at these vertices (V,)."""
        self.fixed.assign(fixed.astype(np.int32))

    def add_diagonal(self, weight: wp.array) -> None:
        wp.launch(add_diagonal, len(weight), [self.matrix, weight], device=self.device)

    def extras_fit(self) -> bool:
        """False where the list of blocks outside the pattern was too short: it has grown, assemble again."""
        count = int(self.matrix.extra_count.numpy()[0])
        if count <= len(self.matrix.extra_index):
            return True
        self._reserve_extras(2 * count)
        return False

    def solve(
        self, gradient: wp.array, told: wp.array, p: wp.array, tolerance: float, max_iterations: int
    ) -> int:
        """Fill p's first V entries, with those of `told` at fixed vertices; returns the number of iterations.

        Rows of fixed vertices do not count: the others solve A p = -g with p given there.
        """
        if self.parallel:
            scratch = (self.work, self.factor.inverse, self.scalars)
            return solve_parallel(
                self.matrix, self.fixed, gradient, told, p, *scratch, tolerance, max_iterations
            )
        args = [
            self.matrix,
            self.factor,
            self.fixed,
            gradient,
            told,
            p,
            self.work,
            self.shift,
            tolerance,
            max_iterations,
        ]
        args.append(self.report)
        wp.launch(solve_serial, 1, args, device=self.device)
        iterations, used = self.report.numpy()[:2]
        # The next matrix is much like this one: start from half the shift that worked, not from the smallest.
        self.shift = max(self.smallest_shift, 0.5 * min(float(used), MAX_SHIFT / 8.0))
        return int(iterations)

    def _reserve_extras(self, capacity: int) -> None:
        self.matrix.extra_index = wp.zeros(capacity, dtype=wp.vec2i, device=self.device)
        self.matrix.extra_values = wp.zeros(capacity, dtype=wp.mat33d, device=self.device)
