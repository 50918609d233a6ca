"""Training of R_mean."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from muslin.garments.errors import InputError
from muslin.learn.drape.mean import RESOLUTION, MeanDrape
from muslin.learn.training.loop import rate

STEPS, LEARNING_RATE, WEIGHT_DECAY = 1500, 1e-2, 1.0


def fit_mean(
    design: str,
    names: Sequence[str],
    parameters: Tensor,
    drapes: Tensor,
    seed: int = 0,
    resolution: int = RESOLUTION,
) -> MeanDrape:
    """The network from parameters (N, P) of N members of a design to drapes (N, V, 3), metres, at the
    vertices of its template; in full batches, for there are as many as designs.

    Raises InputError if no parameter varies.
    """
    if not names:
        raise InputError("all garments have the same parameters; R_mean learns from two designs at least")
    torch.manual_seed(seed)
    network = MeanDrape(design, names, resolution)
    network.normalise(parameters, drapes)
    optimizer = torch.optim.AdamW(network.parameter_groups(WEIGHT_DECAY), lr=LEARNING_RATE)
    for step in range(STEPS):
        for group in optimizer.param_groups:
            group["lr"] = LEARNING_RATE * rate(step / STEPS, 0.0)
        loss = ((network(parameters) - drapes) / network.spread).square().mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    return network.eval()
