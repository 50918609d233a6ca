"""Pyramids of many meshes as one graph of unconnected parts, in torch."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from scipy.sparse import block_diag, csr_array
from torch import Tensor

from muslin.garments.errors import InputError
from muslin.learn.graph.pyramid import Pyramid


class Operator:
    """A constant sparse matrix A (N, M) that acts on dense ones and knows its transpose."""

    def __init__(self, matrix: csr_array, device: torch.device | str = "cpu") -> None:
        self.shape = matrix.shape
        self._matrix = _tensor(csr_array(matrix), device)
        self._transposed = _tensor(csr_array(matrix.T), device)

    def __matmul__(self, x: Tensor) -> Tensor:
        """A x, (N, C), of x (M, C); in float32, for there are no such products of bfloat16."""
        product: Tensor = _Product.apply(x.float(), self._matrix, self._transposed)
        return product


@dataclass(frozen=True, eq=False)
class GraphBatch:
    """What `Pyramid` holds, of B meshes one after the other.

    graph   per level (V_l,) int64: mesh of each vertex, 0 to B - 1
    """

    laplacians: tuple[Operator, ...]
    pools: tuple[Tensor, ...]
    unpools: tuple[Operator, ...]
    graph: tuple[Tensor, ...]


def batch_pyramids(pyramids: Sequence[Pyramid], device: torch.device | str = "cpu") -> GraphBatch:
    """One batch. Raises InputError if there is no pyramid, or they differ in levels."""
    levels = {len(pyramid.pools) for pyramid in pyramids}
    if len(levels) != 1:
        raise InputError(
            f"pyramids of {sorted(levels) or 'no'} levels in one batch; give one number of levels"
        )
    laplacians, pools, unpools, graph = [], [], [], []
    for level in range(levels.pop() + 1):
        counts = np.array([pyramid.counts[level] for pyramid in pyramids])
        starts = np.concatenate([[0], np.cumsum(counts)])
        laplacians.append(Operator(_diagonal([p.laplacians[level] for p in pyramids]), device))
        graph.append(torch.from_numpy(np.repeat(np.arange(len(pyramids)), counts)).to(device))
        if level < len(pyramids[0].pools):
            places = [p.pools[level] + start for p, start in zip(pyramids, starts, strict=False)]
            pools.append(torch.from_numpy(np.concatenate(places)).to(device))
            unpools.append(Operator(_diagonal([p.unpools[level] for p in pyramids]), device))
    return GraphBatch(tuple(laplacians), tuple(pools), tuple(unpools), tuple(graph))


def _diagonal(blocks: Sequence[csr_array]) -> csr_array:
    return blocks[0] if len(blocks) == 1 else csr_array(block_diag(blocks, format="csr"))


def _tensor(matrix: csr_array, device: torch.device | str) -> Tensor:
    parts = (matrix.indptr.astype(np.int32), matrix.indices.astype(np.int32), matrix.data.astype(np.float32))
    with warnings.catch_warnings():
        # Products of such with dense matrices are all that is used of it, and tested.
        warnings.filterwarnings("ignore", message="Sparse CSR tensor support is in beta state")
        rows, columns, values = (torch.from_numpy(part) for part in parts)
        return torch.sparse_csr_tensor(
            rows, columns, values, size=matrix.shape, device=device, check_invariants=False
        )


class _Product(torch.autograd.Function):
    """torch's own product transposes the matrix anew in every backward pass."""

    @staticmethod
    def forward(ctx: Any, x: Tensor, matrix: Tensor, transposed: Tensor) -> Tensor:
        ctx.transposed = transposed
        return _times(matrix, x)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None, None]:  # type: ignore[override]
        return _times(ctx.transposed, gradient.contiguous()), None, None


def _times(matrix: Tensor, x: Tensor) -> Tensor:
    with torch.autocast(x.device.type, enabled=False):
        return matrix @ x
