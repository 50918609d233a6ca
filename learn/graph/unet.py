"""Graph U-Net: one network for meshes of any topology."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from muslin.garments.errors import InputError
from muslin.learn.graph.batch import GraphBatch, Operator
from muslin.learn.graph.chebyshev import ChebyshevConvolution


class GraphUNet(nn.Module):
    """Residual blocks of Chebyshev convolutions on every level; Q_d on the way down, Q_u on the way up, and
    what was there on the way down beside it.

    Weights belong to no vertex and no mesh, so the number and order of vertices are free. The last layer
    begins at zero: an untrained network says zero everywhere.
    """

    def __init__(self, inputs: int, outputs: int, channels: Sequence[int], order: int = 3) -> None:
        """channels: of each level, finest first, as many as the pyramids have; order: K."""
        super().__init__()
        if len(channels) < 2:
            raise InputError(f"channels = {list(channels)}: a U-Net needs two levels at least")
        self.channels = tuple(channels)
        self.first = nn.Linear(inputs, channels[0])
        pairs = list(pairwise(channels))
        self.down = nn.ModuleList(_Block(c, c, order) for c in channels[:-1])
        self.widen = nn.ModuleList(nn.Linear(fine, coarse) for fine, coarse in pairs)
        self.bottom = _Block(channels[-1], channels[-1], order)
        self.narrow = nn.ModuleList(nn.Linear(coarse, fine) for fine, coarse in pairs)
        self.up = nn.ModuleList(_Block(2 * c, c, order) for c in channels[:-1])
        self.last = nn.Linear(channels[0], outputs)
        nn.init.zeros_(self.last.weight)
        nn.init.zeros_(self.last.bias)

    def forward(self, x: Tensor, graphs: GraphBatch) -> Tensor:
        """(V, outputs) of features x (V, inputs) at the vertices of the finest level."""
        if len(graphs.laplacians) != len(self.channels):
            raise InputError(
                f"graphs of {len(graphs.laplacians)} levels for a network of {len(self.channels)}; build "
                "their pyramids with as many"
            )
        x = self.first(x)
        seen = []
        for level, (block, widen) in enumerate(zip(self.down, self.widen, strict=True)):
            x = block(x, graphs.laplacians[level])
            seen.append(x)
            x = widen(x[graphs.pools[level]])
        x = self.bottom(x, graphs.laplacians[-1])
        for level in reversed(range(len(seen))):
            x = graphs.unpools[level] @ self.narrow[level](x)
            x = self.up[level](torch.cat([x, seen[level]], dim=-1), graphs.laplacians[level])
        x = self.last(functional.silu(x))
        return x


class _Block(nn.Module):
    """x -> s(x) + C_2 silu(C_1 silu(norm x)); s: the identity, or linear where the width changes."""

    def __init__(self, inputs: int, outputs: int, order: int) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(inputs)
        self.first = ChebyshevConvolution(inputs, outputs, order)
        self.second = ChebyshevConvolution(outputs, outputs, order)
        self.skip = nn.Identity() if inputs == outputs else nn.Linear(inputs, outputs)

    def forward(self, x: Tensor, laplacian: Operator) -> Tensor:
        y = self.first(functional.silu(self.norm(x)), laplacian)
        out: Tensor = self.skip(x) + self.second(functional.silu(y), laplacian)
        return out
