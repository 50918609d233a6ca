"""R_mean: from design parameters to the drape of the template on the mean body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from muslin.garments.correspondence import correspondence
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import EDGE_LENGTHS, template

RESOLUTION, HIDDEN = 403, 10


class MeanDrape(nn.Module):
    """Positions of the template's vertices, from the design parameters p:

        x = m + s (A q + b + W_2 tanh(W_1 q + b_1)),   q = (p - p_0) / p_s,

    m (V, 3) and s the mean and the spread of the drapes that it was trained on, metres, p_0 and p_s of their
    parameters. Source: Vidaurre 2024, chapter 4, "R_mean", 3 -> 10 -> 3 V, which is W_1 and W_2. The linear
    part is ours: drapes follow the parameters nearly so, and it leaves to W_1 and W_2 what little a dozen
    designs can tell of more (`parameter_groups`).
    """

    centre: Tensor
    width: Tensor
    mean: Tensor
    spread: Tensor

    def __init__(self, design: str, names: Sequence[str], resolution: int = RESOLUTION) -> None:
        """design: of the catalogue; names: of the parameters p; resolution: of the template."""
        super().__init__()
        if resolution not in EDGE_LENGTHS:
            raise InputError(
                f"resolution = {resolution}; there are templates of {', '.join(map(str, EDGE_LENGTHS))} "
                "vertices"
            )
        self.design, self.names, self.resolution = design, tuple(names), resolution
        count = template(design, resolution=resolution).num_vertices
        self.first = nn.Linear(len(names), HIDDEN)
        self.last = nn.Linear(HIDDEN, 3 * count, bias=False)
        self.linear = nn.Linear(len(names), 3 * count)
        for weight in (self.last.weight, self.linear.weight, self.linear.bias):
            nn.init.zeros_(weight)
        self.register_buffer("centre", torch.zeros(len(names)))
        self.register_buffer("width", torch.ones(len(names)))
        self.register_buffer("mean", torch.zeros(count, 3))
        self.register_buffer("spread", torch.ones(()))

    def normalise(self, parameters: Tensor, positions: Tensor) -> None:
        """Take p_0, p_s, m and s from the training set: parameters (N, P), positions (N, V, 3)."""
        self.centre.copy_(parameters.mean(0))
        self.width.copy_(parameters.std(0, correction=0).clamp_min(1e-6))
        self.mean.copy_(positions.mean(0))
        self.spread.copy_((positions - self.mean).square().mean().sqrt().clamp_min(1e-6))

    def forward(self, parameters: Tensor) -> Tensor:
        """(N, V, 3) of parameters (N, P), metres."""
        q = (parameters - self.centre) / self.width
        offset = self.linear(q) + self.last(torch.tanh(self.first(q)))
        x: Tensor = self.mean + self.spread * offset.unflatten(-1, (-1, 3))
        return x

    def parameter_groups(self, weight_decay: float) -> list[dict[str, Any]]:
        """For an optimizer: weight decay on W_1 and W_2 alone."""
        bent = [*self.first.parameters(), *self.last.parameters()]
        return [
            {"params": bent, "weight_decay": weight_decay},
            {"params": [*self.linear.parameters()], "weight_decay": 0.0},
        ]

    def described(self) -> dict[str, Any]:
        """What it takes to make one of these, besides its tensors, as JSON values; see `mean_drape_of`."""
        return {"design": self.design, "names": self.names, "resolution": self.resolution}

    def parameters_of(self, values: Mapping[str, float]) -> Tensor:
        """(P,). Raises InputError if one is missing."""
        missing = [name for name in self.names if name not in values]
        if missing:
            raise InputError(f"design parameter {missing[0]!r} is missing; give {', '.join(self.names)}")
        return torch.tensor([values[name] for name in self.names], dtype=torch.float32)

    @torch.no_grad()
    def at(self, mesh: GarmentMesh) -> NDArray[np.float64]:
        """(V', 3) the mean drape at the vertices of any triangulation of a garment of the family, metres:
        that of the template at the same places in panel space.

        Raises InputError if the mesh is not of the family.
        """
        if mesh.name != self.design:
            raise InputError(f"a garment of design {mesh.name!r}; this network knows {self.design!r}")
        own = template(self.design, mesh.parameters, self.resolution)
        return correspondence(own, mesh).carry(self.template_of(mesh.parameters))

    @torch.no_grad()
    def template_of(self, values: Mapping[str, float]) -> NDArray[np.float64]:
        """(V, 3) at the vertices of the template, metres. Raises InputError if a parameter is missing."""
        positions: NDArray[np.float64] = self(self.parameters_of(values)[None])[0].double().numpy()
        return positions


def mean_drape_of(told: Mapping[str, Any], tensors: Mapping[str, Tensor]) -> MeanDrape:
    """A network from what `described` told, which may be among other things, and its tensors."""
    network = MeanDrape(told["design"], told["names"], told["resolution"])
    network.load_state_dict(dict(tensors))
    return network
