"""R_smooth and R_fine: displacements of the vertices of any garment of the family."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from muslin.learn.graph.batch import GraphBatch
from muslin.learn.graph.unet import GraphUNet

JOINTS = 24


@dataclass(frozen=True)
class NetworkConfig:
    """betas: shape coefficients that it sees; fabrics: figures of the fabric that it sees, 0 for none;
    channels, order: see `GraphUNet`."""

    betas: int
    fabrics: int = 0
    channels: Sequence[int] = (32, 64, 128, 256)
    order: int = 3


class DrapeNetwork(nn.Module):
    """Graph U-Net on nodes of position, skinning weights of the nearest body point, and body shape:

        d = s U([(x - c) / r, w, beta, fabric]),

    c (3,), r and s metres from the training set. Source: Vidaurre 2024, chapter 4; the fabric as an input is
    ours.
    """

    centre: Tensor
    radius: Tensor
    spread: Tensor
    beta_scale: Tensor

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self.config = config
        inputs = 3 + JOINTS + config.betas + config.fabrics
        self.unet = GraphUNet(inputs, 3, config.channels, config.order)
        self.register_buffer("centre", torch.zeros(3))
        self.register_buffer("radius", torch.ones(()))
        self.register_buffer("spread", torch.ones(()))
        self.register_buffer("beta_scale", torch.ones(()))

    def normalise(self, positions: Tensor, displacements: Tensor, betas: Tensor) -> None:
        """Take c, r and s from (N, 3) positions and displacements, and the scale of shapes from (M, B)."""
        self.centre.copy_(positions.mean(0))
        self.radius.copy_((positions - self.centre).square().mean().sqrt())
        self.spread.copy_(displacements.square().mean().sqrt().clamp_min(1e-6))
        self.beta_scale.copy_(betas.square().mean().sqrt().clamp_min(1e-6))

    def forward(
        self,
        positions: Tensor,
        weights: Tensor,
        beta: Tensor,
        graphs: GraphBatch,
        fabric: Tensor | None = None,
    ) -> Tensor:
        """Displacements (V, 3), metres, of all vertices of B garments.

        positions (V, 3); weights (V, 24); beta (B, betas), standard deviations; fabric (B, fabrics).
        """
        shape = beta[:, : self.config.betas] / self.beta_scale
        of_garment = shape if fabric is None else torch.cat([shape, fabric], dim=1)
        nodes = [(positions - self.centre) / self.radius, weights, of_garment[graphs.graph[0]]]
        out: Tensor = self.spread * self.unet(torch.cat(nodes, dim=1), graphs)
        return out
