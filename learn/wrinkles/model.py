"""A trained model of animated garments: all that it takes from a moving body to a moving garment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.learn.drape.mean import MeanDrape, mean_drape_of
from muslin.learn.training.checkpoint import read_tensors, write_tensors
from muslin.learn.wrinkles.clips import Told
from muslin.learn.wrinkles.condition import Condition
from muslin.learn.wrinkles.garment import GarmentCache
from muslin.learn.wrinkles.network import NetworkConfig, WrinkleNetwork
from muslin.learn.wrinkles.process import Drawing, Process
from muslin.learn.wrinkles.rollout import Noise, roll_out
from muslin.learn.wrinkles.world import SequenceWorld
from muslin.sim.dataset import durable

TEMPLATES, WRINKLES = "templates.safetensors", "wrinkles.safetensors"
SHIPPED = Path(__file__).parent / "assets" / "tee"
"""A model that comes with the package; its model card is beside it."""


@dataclass(eq=False)
class WrinkleModel:
    """G_design, and the network with what it is told and how it is drawn from.

    drawing, noise: how `maps` are drawn, see `Drawing` and `roll_out`
    """

    world: SequenceWorld
    templates: MeanDrape
    condition: Condition
    process: Process
    network: WrinkleNetwork
    drawing: Drawing = Drawing()  # noqa: RUF009, frozen
    noise: Noise = "fixed"

    @cached_property
    def garments(self) -> GarmentCache:
        config = self.network.config
        return GarmentCache(self.templates, self.world, config.size, config.side)

    def maps(self, sequences: Sequence[Told], seed: int = 0) -> list[NDArray[np.float32]]:
        """(T, N, 3), metres, of each sequence; another seed, another of those that are likely."""
        return roll_out(self.network, self.process, sequences, self.drawing, seed=seed, noise=self.noise)

    def save(self, folder: Path, dtype: torch.dtype = torch.float32) -> None:
        """Two files of tensors; dtype: of the weights that are stored, such as torch.bfloat16."""
        told = {**self.templates.described(), "world": asdict(self.world)}
        durable.make_folder(folder)
        write_tensors(folder / TEMPLATES, self.templates.state_dict(), told)
        state = self.network.state_dict()
        # Scalars and what conditions are told by are few, and kept as they are.
        weights = {key: value.to(dtype) if value.ndim > 1 else value for key, value in state.items()}
        kind = {"condition": asdict(self.condition), "process": self.process.kind}
        write_tensors(folder / WRINKLES, weights, {"config": asdict(self.network.config), **kind})


def holds_wrinkles(folder: Path) -> bool:
    """Whether a folder is one of `WrinkleModel.save`."""
    return (folder / WRINKLES).exists()


def load_wrinkles(folder: Path) -> WrinkleModel:
    """The model of a folder, on the CPU. Raises InputError if a file is missing or damaged."""
    if not holds_wrinkles(folder):
        raise InputError(f"{folder}: holds no model of animated garments; train one: `muslin train wrinkles`")
    tensors, told = read_tensors(folder / TEMPLATES)
    weights, own = read_tensors(folder / WRINKLES)
    network = WrinkleNetwork(NetworkConfig.from_json(own["config"]))
    network.load_state_dict({name: value.float() for name, value in weights.items()})
    return WrinkleModel(
        SequenceWorld.of(told["world"]),
        mean_drape_of(told, tensors),
        Condition.from_json(own["condition"]),
        Process(own["process"]),
        network.eval(),
    )
