"""Training of networks that draw displacement maps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch

from muslin.garments.errors import InputError
from muslin.learn.training.loop import Report, Settings, train
from muslin.learn.wrinkles.clips import Clip, read_clips
from muslin.learn.wrinkles.condition import Condition, used_betas, varied_parameters
from muslin.learn.wrinkles.degrade import Degrading
from muslin.learn.wrinkles.fields import FIELDS
from muslin.learn.wrinkles.layout import map_layout
from muslin.learn.wrinkles.model import WrinkleModel
from muslin.learn.wrinkles.network import SIZES, NetworkConfig, WrinkleNetwork
from muslin.learn.wrinkles.objective import WrinkleObjective
from muslin.learn.wrinkles.pictures import Example, Pictures
from muslin.learn.wrinkles.process import Process
from muslin.learn.wrinkles.templates import templates_of
from muslin.learn.wrinkles.world import world_of
from muslin.sim.dataset.reader import Dataset

Stage = Callable[[str], Report]
MAPS, TRAIN, PICTURES = "maps", "train", "pictures"


@dataclass(frozen=True)
class WrinkleSettings:
    """temporal: whether the network sees the map of the frame before, made worse by `degrading`; process: see
    `Process`; network: one of SIZES; size: of maps, texels; pose, motion, fabric, fields: see `Condition`;
    mirror: whether mirror images are learned from too."""

    training: Settings
    temporal: bool = True
    process: str = "flow"
    network: str = "small"
    size: int = 128
    pose: bool = True
    motion: bool = True
    fabric: bool = False
    fields: bool = True
    mirror: bool = True
    batch: int = 8
    degrading: Degrading = field(default_factory=Degrading)

    def __post_init__(self) -> None:
        if self.network not in SIZES:
            raise InputError(f"network {self.network!r}: must be one of {', '.join(SIZES)}")


def train_wrinkles(
    dataset: Dataset, out: Path, settings: WrinkleSettings, stage: Stage | None = None
) -> WrinkleModel:
    """G_design and the network, from the split "train" of sequences, saved into `out`; with the errors on the
    other splits logged. Without such a split all sequences are learned from.

    Raises InputError for sequences that do not go together.
    """
    sets = {name: dataset.split(name) for name in dataset.splits}
    if TRAIN not in sets:
        sets = {TRAIN: dataset}
    own = sets[TRAIN]
    world = world_of(dataset)
    seed = settings.training.seed
    samples = list(own)
    templates = templates_of(samples, world, seed)
    names = varied_parameters(samples)
    condition = Condition(
        used_betas(samples), names, settings.pose, settings.motion, settings.fabric, settings.fields
    )
    process = Process(settings.process)
    torch.manual_seed(seed)
    network = WrinkleNetwork(
        NetworkConfig(
            templates.design,
            settings.size,
            condition.count,
            FIELDS * settings.fields,
            settings.temporal,
            **SIZES[settings.network],  # type: ignore[arg-type]
        )
    )
    model = WrinkleModel(world, templates, condition, process, network)
    told = stage("maps") if stage else None
    clips = {
        name: read_clips(
            part, model.garments, condition, out / MAPS, told, mirror=settings.mirror and name == TRAIN
        )
        for name, part in sets.items()
    }
    conditions = torch.from_numpy(np.concatenate([clip.told.conditions for clip in clips[TRAIN]]))
    network.normalise(conditions, spread_of(clips[TRAIN]))
    objective = WrinkleObjective(
        clips,
        map_layout(templates.design, settings.size),
        float(network.spread),
        process,
        settings.degrading,
        settings.batch,
        seed,
        settings.temporal,
    )
    examples = {
        name: Example(part[0], model.garments.of(part[0].garment), clips[name][0], len(clips[name][0]) // 2)
        for name, part in sets.items()
    }
    pictures = Pictures(
        examples, process, float(network.spread), settings.training.epochs, out / TRAIN / PICTURES
    )
    told = stage("wrinkles") if stage else None
    train(network, objective, settings.training, out / TRAIN, report=told, after=pictures)
    network.to("cpu").eval()
    model.save(out)
    return model


def spread_of(clips: list[Clip]) -> float:
    """Root mean square of all values of maps, metres."""
    total = sum(float(np.square(clip.maps, dtype=np.float64).sum()) for clip in clips)
    return float(np.sqrt(total / sum(clip.maps.size for clip in clips)))
