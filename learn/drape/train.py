"""Training of the pipeline, stage by stage: R_mean, R_smooth, R_fine."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import torch

from muslin.garments.errors import InputError
from muslin.learn.drape.examples import Examples, mean_drapes, read_examples
from muslin.learn.drape.fabric import FIGURES, fabric_figures, file_stem
from muslin.learn.drape.garment import PreparedGarment
from muslin.learn.drape.mean import MeanDrape
from muslin.learn.drape.network import DrapeNetwork, NetworkConfig
from muslin.learn.drape.objective import DisplacementObjective, Item
from muslin.learn.drape.pipeline import ANY_FABRIC, DrapePipeline
from muslin.learn.drape.smoothing import LENGTH
from muslin.learn.graph.pyramid import PyramidCache
from muslin.learn.training.loop import Report, Settings, rate, train
from muslin.sim.dataset.reader import Dataset

MEAN_STEPS, MEAN_RATE, MEAN_DECAY = 1500, 1e-2, 1.0
MOST_VALIDATED = 64
"""Items of a split that are looked at after each epoch."""


_USUAL = Settings(epochs=60, learning_rate=3e-3)


@dataclass(frozen=True)
class DrapeSettings:
    """How the pipeline is trained.

    smoothing      length of `Smoother`, metres
    channels, order, batch   of the graph networks
    fabric_input   one R_fine that sees the fabric, instead of one a fabric
    skinned        see `DrapePipeline`
    """

    smooth: Settings = _USUAL
    fine: Settings = _USUAL
    smoothing: float = LENGTH
    channels: tuple[int, ...] = (32, 64, 128, 256)
    order: int = 3
    batch: int = 8
    fabric_input: bool = False
    skinned: bool = False


def train_pipeline(
    dataset: Dataset, out: Path, settings: DrapeSettings, report: Callable[[str], Report] | None = None
) -> DrapePipeline:
    """Train on the split "train" of a dataset (all of it, if it has none), and save into `out`.

    report(stage) gives the stage's progress report. Other splits are looked at while it trains, for the log.
    Raises InputError for datasets that `read_examples` does not take.
    """
    splits = {name: dataset.split(name) for name in dataset.splits} if "train" in dataset.splits else {}
    sets = {
        name: read_examples(part, settings.smoothing) for name, part in (splits or {"train": dataset}).items()
    }
    own = sets["train"]
    config = NetworkConfig(own.betas, 0, settings.channels, settings.order)
    mean, cache = train_mean(own, settings.smooth.seed), PyramidCache(out / "graphs", len(settings.channels))
    pipeline = DrapePipeline(own.world, mean, DrapeNetwork(config), {}, settings.skinned, cache)
    garments = {name: [pipeline.prepare(mesh) for mesh in part.garments] for name, part in sets.items()}

    items = {name: _smooth_items(pipeline, part, garments[name]) for name, part in sets.items()}
    told = report("smooth") if report else None
    pipeline.smooth = train_network(
        config, items, settings.smooth, settings.batch, out / "train/smooth", told
    )

    for name, fabrics in _fine_networks(own.world.fabrics, settings.fabric_input).items():
        items = {
            key: _fine_items(pipeline, part, garments[key], fabrics, settings.fabric_input)
            for key, part in sets.items()
        }
        seen = replace(config, fabrics=FIGURES if settings.fabric_input else 0)
        told = report(f"fine {name}") if report else None
        folder = out / "train" / f"fine-{file_stem(name)}"
        pipeline.fine[name] = train_network(seen, items, settings.fine, settings.batch, folder, told)
    pipeline.save(out)
    return pipeline


def train_mean(examples: Examples, seed: int = 0) -> MeanDrape:
    """R_mean, in full batches: there are as many drapes as designs."""
    if not examples.parameters:
        raise InputError("all garments have the same parameters; R_mean learns from two designs at least")
    parameters, drapes = mean_drapes(examples)
    torch.manual_seed(seed)
    network = MeanDrape(examples.garments[0].name, examples.parameters)
    network.normalise(parameters, drapes)
    optimizer = torch.optim.AdamW(network.parameter_groups(MEAN_DECAY), lr=MEAN_RATE)
    for step in range(MEAN_STEPS):
        for group in optimizer.param_groups:
            group["lr"] = MEAN_RATE * rate(step / MEAN_STEPS, 0.0)
        loss = ((network(parameters) - drapes) / network.spread).square().mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    return network.eval()


def train_network(
    config: NetworkConfig,
    items: Mapping[str, Sequence[Item]],
    settings: Settings,
    batch: int,
    out: Path,
    report: Report | None = None,
) -> DrapeNetwork:
    """R_smooth or R_fine, from items["train"]; the error over some of every entry of `items` is logged.

    If `out` holds a part of the same training, it goes on.
    """
    torch.manual_seed(settings.seed)
    network = DrapeNetwork(config)
    network.normalise(
        torch.cat([item.start for item in items["train"]]),
        torch.cat([item.goal - item.start for item in items["train"]]),
        torch.stack([item.beta for item in items["train"]]),
    )
    device = "cuda" if torch.cuda.is_available() else "cpu"
    shown = {name: spread_out(own, MOST_VALIDATED) for name, own in items.items()}
    objective = DisplacementObjective(items["train"], shown, batch=batch, seed=settings.seed, device=device)
    train(network, objective, settings, out, report=report)
    return network.cpu().eval()


def spread_out(items: Sequence[Item], most: int) -> list[Item]:
    """So many of them at most, evenly."""
    return [items[k * len(items) // most] for k in range(most)] if len(items) > most else list(items)


def _fine_networks(fabrics: Sequence[str], fabric_input: bool) -> dict[str, tuple[str, ...]]:
    """{name of a network: fabrics that it learns}."""
    return {ANY_FABRIC: tuple(fabrics)} if fabric_input else {fabric: (fabric,) for fabric in fabrics}


def _smooth_items(
    pipeline: DrapePipeline, examples: Examples, garments: Sequence[PreparedGarment]
) -> list[Item]:
    """From where the pipeline starts to the smooth drape."""
    known = [(garments[example.garment], example) for example in examples.examples]
    return [Item(g, e.beta, pipeline.start(g, e.beta), e.smooth) for g, e in known]


def _fine_items(
    pipeline: DrapePipeline,
    examples: Examples,
    garments: Sequence[PreparedGarment],
    fabrics: Sequence[str],
    fabric_input: bool,
) -> list[Item]:
    """From the smooth drape that the pipeline predicts to the one that was simulated."""
    figures = dict(zip(fabrics, fabric_figures(fabrics), strict=True)) if fabric_input else {}
    items = []
    for example in examples.examples:
        garment = garments[example.garment]
        (start,) = pipeline.smooth_drapes([garment], [example.beta])
        items += [
            Item(garment, example.beta, start, example.drapes[fabric], figures.get(fabric))
            for fabric in fabrics
            if fabric in example.drapes
        ]
    return items
