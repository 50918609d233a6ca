"""Chebyshev graph convolution."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from muslin.garments.errors import InputError
from muslin.learn.graph.batch import Operator


class ChebyshevConvolution(nn.Module):
    """Spectral filters that reach K - 1 edges far:

        y = sum_k<K T_k(L') x Theta_k + b,   T_0 = I, T_1 = L', T_k = 2 L' T_k-1 - T_k-2,

    with L' (V, V) the scaled Laplacian (`scaled_laplacian`), x (V, in), y (V, out), Theta_k (in, out).

    Source: Defferrard, Bresson, Vandergheynst 2016, "Convolutional neural networks on graphs with fast
    localized spectral filtering", equation 5; the layer of Vidaurre 2024 with K = 3.
    """

    def __init__(self, inputs: int, outputs: int, order: int = 3, *, bias: bool = True) -> None:
        """order: K. Raises InputError if it is below 1."""
        super().__init__()
        if order < 1:
            raise InputError(f"order K = {order}; it must be at least 1")
        self.order = order
        self.linear = nn.Linear(order * inputs, outputs, bias=bias)

    def forward(self, x: Tensor, laplacian: Operator) -> Tensor:
        terms = [x]
        if self.order > 1:
            terms.append(laplacian @ x)
        for _ in range(2, self.order):
            terms.append(2.0 * (laplacian @ terms[-1]) - terms[-2])
        y: Tensor = self.linear(torch.cat(terms, dim=-1))
        return y
