"""Training of the pipeline, stage by stage: R_mean, R_smooth, R_fine."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch

from muslin.garments.errors import InputError
from muslin.learn.drape.examples import Examples, mean_drapes, read_examples
from muslin.learn.drape.fabric import FIGURES, fabric_figures, file_stem
from muslin.learn.drape.fit_mean import fit_mean
from muslin.learn.drape.garment import PreparedGarment
from muslin.learn.drape.network import DrapeNetwork, NetworkConfig
from muslin.learn.drape.objective import DisplacementObjective, Item
from muslin.learn.drape.pipeline import ANY_FABRIC, GRAPHS, DrapePipeline
from muslin.learn.drape.smoothing import LENGTH, Smoother
from muslin.learn.graph.pyramid import PyramidCache
from muslin.learn.training.batches import evenly
from muslin.learn.training.loop import Report, Settings, train
from muslin.learn.training.machine import training_device
from muslin.sim.dataset.reader import Dataset

MOST_VALIDATED = 64
"""Items of a split that are looked at after each epoch."""

_USUAL = Settings(epochs=60, learning_rate=3e-3)


@dataclass(frozen=True)
class DrapeSettings:
    """How the pipeline is trained.

    smooth, fine   of R_smooth, and of each R_fine
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
    skinned: bool = True


Stage = Callable[[str], Report]
"""The progress report of a stage, by its name."""


def train_pipeline(
    dataset: Dataset, out: Path, settings: DrapeSettings, stage: Stage | None = None
) -> DrapePipeline:
    """Train on the split "train" of a dataset (all of it, if it has none), and save into `out`.

    Other splits are looked at while it trains, for the log. Raises InputError for datasets that
    `read_examples` does not take.
    """
    sets = read_splits(dataset)
    return train_fine(train_smooth(sets, out, settings, stage), sets, out, settings, stage)


def read_splits(dataset: Dataset) -> dict[str, Examples]:
    """Examples of each split; all of them as "train" where there is no such split."""
    if "train" not in dataset.splits:
        return {"train": read_examples(dataset)}
    return {name: read_examples(dataset.split(name)) for name in dataset.splits}


def train_smooth(
    sets: Mapping[str, Examples], out: Path, settings: DrapeSettings, stage: Stage | None = None
) -> DrapePipeline:
    """R_mean and R_smooth from sets["train"], saved into `out`: a pipeline that drapes smooth."""
    own = sets["train"]
    config = NetworkConfig(own.betas, 0, settings.channels, settings.order)
    mean = fit_mean(own.garments[0].name, own.parameters, *mean_drapes(own), settings.smooth.seed)
    cache = PyramidCache(out / GRAPHS, len(settings.channels))
    pipeline = DrapePipeline(own.world, mean, DrapeNetwork(config), {}, settings.skinned, cache)
    items = {name: _smooth_items(pipeline, part, settings.smoothing) for name, part in sets.items()}
    told = stage("smooth") if stage else None
    pipeline.smooth = train_network(
        config, items, settings.smooth, settings.batch, out / "train/smooth", told
    )
    pipeline.save(out)
    return pipeline


def train_fine(
    pipeline: DrapePipeline,
    sets: Mapping[str, Examples],
    out: Path,
    settings: DrapeSettings,
    stage: Stage | None = None,
) -> DrapePipeline:
    """Every R_fine from sets["train"] and what R_smooth of a pipeline says; in place, and saved into `out`.

    Raises InputError for examples of another world than the pipeline's.
    """
    world = sets["train"].world
    if replace(world, fabrics=()) != replace(pipeline.world, fabrics=()):
        raise InputError("the dataset is of another family, body or pose than R_smooth was trained on")
    smooth = pipeline.smooth.config
    for name, fabrics in _fine_networks(world.fabrics, settings.fabric_input).items():
        items = {
            key: _fine_items(pipeline, part, fabrics, settings.fabric_input) for key, part in sets.items()
        }
        config = replace(smooth, fabrics=FIGURES if settings.fabric_input else 0)
        told = stage(f"fine {name}") if stage else None
        folder = out / "train" / f"fine-{file_stem(name)}"
        pipeline.fine[name] = train_network(config, items, settings.fine, settings.batch, folder, told)
    pipeline.save(out)
    return pipeline


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
    shown = {name: [own[k] for k in evenly(len(own), MOST_VALIDATED)] for name, own in items.items()}
    objective = DisplacementObjective(
        items["train"],
        shown,
        batch=batch,
        seed=settings.seed,
        spread=float(network.spread),
        device=training_device(),
    )
    train(network, objective, settings, out, report=report)
    return network.cpu().eval()


def _fine_networks(fabrics: Sequence[str], fabric_input: bool) -> dict[str, tuple[str, ...]]:
    """{name of a network: fabrics that it learns}."""
    return {ANY_FABRIC: tuple(fabrics)} if fabric_input else {fabric: (fabric,) for fabric in fabrics}


def _prepared(pipeline: DrapePipeline, examples: Examples) -> list[PreparedGarment]:
    return [pipeline.prepare(mesh) for mesh in examples.garments]


def _smooth_items(pipeline: DrapePipeline, examples: Examples, smoothing: float) -> list[Item]:
    """From where the pipeline starts to the smooth part of the drape averaged over fabrics."""
    garments = _prepared(pipeline, examples)
    smoothers = [Smoother(mesh, smoothing) for mesh in examples.garments]
    items = []
    for example in examples.examples:
        garment, smoother = garments[example.garment], smoothers[example.garment]
        goal = torch.from_numpy(smoother(example.average.numpy()).astype(np.float32))
        items.append(Item(garment, example.beta, pipeline.start(garment, example.beta), goal))
    return items


def _fine_items(
    pipeline: DrapePipeline, examples: Examples, fabrics: Sequence[str], fabric_input: bool
) -> list[Item]:
    """From the smooth drape that the pipeline predicts to the one that was simulated."""
    garments = _prepared(pipeline, examples)
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
