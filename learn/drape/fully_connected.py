"""Fully-connected networks on the one dense mesh of a family: the rivals of the graph networks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from hashlib import sha256
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from muslin.garments.correspondence import Correspondence
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template
from muslin.learn.drape.dense import DenseDrapes, place_on_template
from muslin.learn.drape.fabric import file_stem
from muslin.learn.drape.world import World, shape_tensor
from muslin.learn.training.batches import ShuffledBatches
from muslin.learn.training.checkpoint import read_tensors, write_tensors
from muslin.learn.training.loop import Report, Settings, train
from muslin.learn.training.machine import training_device

FULLY_CONNECTED = (512, 1024)
"""Widths of the network that Vidaurre 2024, chapter 4, compares with; on design parameters and shape."""
SINGLE_GARMENT = (20,)
"""Width of the static part of Santesteban, Otaduy, Casas 2019, "Learning-based animation of clothing for
virtual try-on", section 5.1: one garment, on its shape alone."""


@dataclass(frozen=True)
class DenseConfig:
    """resolution: of the template; names: parameters p that it sees; fixed: those of its one garment,
    if it knows but one; betas: shape coefficients that it sees; hidden: widths."""

    world: World
    resolution: int
    names: tuple[str, ...]
    fixed: dict[str, float] | None
    betas: int
    hidden: tuple[int, ...]


class DenseNetwork(nn.Module):
    """x = m + s N([(p - p_0) / p_s, beta / b]), all vertices (V, 3) of the template at once, metres."""

    centre: Tensor
    width: Tensor
    mean: Tensor
    spread: Tensor

    def __init__(self, config: DenseConfig) -> None:
        super().__init__()
        self.config = config
        count = template(config.world.design, config.fixed, config.resolution).num_vertices
        inputs = len(config.names) + config.betas
        sizes = [inputs, *config.hidden, 3 * count]
        layers: list[nn.Module] = []
        for size, following in pairwise(sizes):
            layers += [nn.Linear(size, following), nn.SiLU()]
        self.layers = nn.Sequential(*layers[:-1])
        self.register_buffer("centre", torch.zeros(inputs))
        self.register_buffer("width", torch.ones(inputs))
        self.register_buffer("mean", torch.zeros(count, 3))
        self.register_buffer("spread", torch.ones(()))

    def normalise(self, inputs: Tensor, positions: Tensor) -> None:
        """Take everything but the weights from the training set: (N, P + B), (N, V, 3)."""
        self.centre.copy_(inputs.mean(0))
        self.width.copy_(inputs.std(0, correction=0).clamp_min(1e-6))
        self.mean.copy_(positions.mean(0))
        self.spread.copy_((positions - self.mean).square().mean().sqrt().clamp_min(1e-6))

    def forward(self, inputs: Tensor) -> Tensor:
        out = self.layers((inputs - self.centre) / self.width)
        x: Tensor = self.mean + self.spread * out.unflatten(-1, (-1, 3))
        return x


@dataclass(eq=False)
class DenseDraper:
    """networks: {fabric: network}, all of one configuration."""

    networks: dict[str, DenseNetwork]

    @property
    def config(self) -> DenseConfig:
        return next(iter(self.networks.values())).config

    @property
    def world(self) -> World:
        return self.config.world

    def prepare(self, mesh: GarmentMesh) -> tuple[Tensor, Correspondence]:
        """Raises InputError for another family, and for another garment where it knows but one."""
        config = self.config
        place = place_on_template(mesh, config.world.design, config.resolution)
        for name, value in (config.fixed or {}).items():
            if abs(mesh.parameters[name] - value) > 1e-6:
                raise InputError(f"{name} = {mesh.parameters[name]:g}: this network knows {value:g} alone")
        parameters = torch.tensor([mesh.parameters[name] for name in config.names], dtype=torch.float32)
        return parameters, place

    @torch.no_grad()
    def drapes(
        self, garments: Sequence[tuple[Tensor, Correspondence]], betas: Sequence[Any], fabrics: Sequence[str]
    ) -> list[Tensor]:
        found = []
        for (parameters, place), beta, fabric in zip(garments, betas, fabrics, strict=True):
            if fabric not in self.networks:
                raise InputError(f"fabric {fabric!r}: there are networks for {', '.join(self.networks)}")
            shape = shape_tensor(beta, self.config.betas)
            dense = self.networks[fabric](torch.cat([parameters, shape])[None])[0]
            found.append(torch.from_numpy(place.carry(dense.numpy()).astype(np.float32)))
        return found

    def save(self, folder: Path, dtype: torch.dtype = torch.float32) -> None:
        """One file of tensors a fabric."""
        folder.mkdir(parents=True, exist_ok=True)
        for fabric, network in self.networks.items():
            tensors = {key: value.to(dtype) for key, value in network.state_dict().items()}
            told = {"config": asdict(network.config), "fabric": fabric}
            write_tensors(folder / f"{file_stem(fabric)}.safetensors", tensors, told)


def load_dense(folder: Path) -> DenseDraper:
    """What `DenseDraper.save` wrote. Raises InputError if it is missing or damaged."""
    networks = {}
    for file in sorted(folder.glob("*.safetensors")):
        tensors, told = read_tensors(file)
        values = told["config"]
        lists = {key: tuple(values[key]) for key in ("names", "hidden")}
        config = DenseConfig(**{**values, **lists, "world": World.of(values["world"])})
        network = DenseNetwork(config)
        network.load_state_dict({name: value.float() for name, value in tensors.items()})
        networks[told["fabric"]] = network.eval()
    if not networks:
        raise InputError(f"{folder}: holds no network; give the folder of a trained one")
    return DenseDraper(networks)


class _DenseObjective:
    """Mean squared error of all coordinates, over the spread."""

    def __init__(self, inputs: Tensor, positions: Tensor, order: ShuffledBatches, spread: float) -> None:
        self.inputs, self.positions, self.order, self.spread = inputs, positions, order, spread
        self.device = training_device()

    def steps(self) -> int:
        return self.order.steps

    def batches(self, epoch: int, rank: int, world: int) -> Iterator[tuple[Tensor, Tensor]]:
        for places in map(torch.from_numpy, self.order.places(epoch, rank, world)):
            yield self.inputs[places].to(self.device), self.positions[places].to(self.device)

    def loss(self, model: nn.Module, batch: tuple[Tensor, Tensor]) -> Tensor:
        inputs, positions = batch
        return ((model(inputs) - positions) / self.spread).square().mean()

    def validate(self, model: nn.Module) -> dict[str, float]:
        return {}

    def identity(self) -> Mapping[str, Any]:
        digest = sha256(self.inputs.numpy().tobytes() + self.positions.numpy().tobytes()).hexdigest()
        return {"items": len(self.inputs), "batch": self.order.size, "data": digest}


def train_fully_connected(
    drapes: DenseDrapes, out: Path, settings: Settings, batch: int = 16, report: Report | None = None
) -> DenseDraper:
    """One network a fabric, from design parameters and shape to the dense mesh; saved into `out`."""
    count = drapes.betas.shape[1]
    config = DenseConfig(drapes.world, drapes.resolution, drapes.names, None, count, FULLY_CONNECTED)
    inputs = torch.cat([drapes.parameters, drapes.betas], dim=1)
    return _trained(config, drapes, inputs, out, settings, batch, report)


def train_single_garment(
    drapes: DenseDrapes,
    parameters: Mapping[str, float],
    out: Path,
    settings: Settings,
    batch: int = 16,
    report: Report | None = None,
) -> DenseDraper:
    """One network a fabric, from shape to the dense mesh of one garment; parameters: its own, of
    `drapes.names`. Raises InputError if there is no drape of it."""
    asked = torch.tensor([parameters[name] for name in drapes.names])
    own = drapes.of((drapes.parameters - asked).abs().amax(1) < 1e-6)
    if not own.fabrics:
        raise InputError(f"no drape of a garment with {dict(parameters)} to learn from")
    count = drapes.betas.shape[1]
    config = DenseConfig(drapes.world, drapes.resolution, (), dict(parameters), count, SINGLE_GARMENT)
    return _trained(config, own, own.betas, out, settings, batch, report)


def _trained(
    config: DenseConfig,
    drapes: DenseDrapes,
    inputs: Tensor,
    out: Path,
    settings: Settings,
    batch: int,
    report: Report | None,
) -> DenseDraper:
    networks = {}
    for fabric in dict.fromkeys(drapes.fabrics):
        own = torch.tensor([name == fabric for name in drapes.fabrics])
        torch.manual_seed(settings.seed)
        network = DenseNetwork(config)
        network.normalise(inputs[own], drapes.positions[own])
        order = ShuffledBatches(int(own.sum()), batch, settings.seed)
        objective = _DenseObjective(inputs[own], drapes.positions[own], order, float(network.spread))
        train(network, objective, settings, out / "train" / file_stem(fabric), report=report)
        networks[fabric] = network.cpu().eval()
    draper = DenseDraper(networks)
    draper.save(out)
    return draper
