"""What a training or a prediction uses of the machine, and how large a network is."""

from __future__ import annotations

from collections.abc import Iterable

import torch
from torch import nn

from muslin.sim.dataset.processes import usable_cores


def use_all_cores() -> None:
    """Let torch's own threads have every core: unlike simulations, networks are not run a process a core."""
    torch.set_num_threads(usable_cores())


def training_device() -> torch.device:
    """A GPU if there is one."""
    return torch.device("cuda" if torch.cuda.is_available() else "cpu")


def count_weights(networks: Iterable[nn.Module]) -> int:
    """Trained numbers in all of the networks."""
    return sum(weight.numel() for network in networks for weight in network.parameters())
