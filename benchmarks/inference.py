"""Drapes a second of trained networks, beside the simulator's."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from benchmarks.drapes import drape_costs
from benchmarks.spread import Spread, paired_ratio
from muslin.learn.drape.garment import PreparedGarment
from muslin.learn.drape.pipeline import DrapePipeline, load_pipeline
from muslin.learn.drape.predict import SHIPPED, garment_of

DRAPES = 48
"""Learned ones of a round, of each kind."""
SHAPE_STEP = 0.75
"""Between two simulated neighbours, standard deviations."""


@dataclass(frozen=True)
class Inference:
    """Seconds of a learned drape, one at a time and in batches, and of a simulated one of as many vertices, a
    value a round each; how many times the second goes into the third."""

    vertices: int
    threads: int
    one: tuple[float, ...]
    batched: tuple[float, ...]
    simulated: tuple[float, ...]
    times_faster: Spread


def measure_inference(model: Path | None, threads: int, batch: int, rounds: int) -> Inference:
    """Drape a tee of the 4,000 template on random shapes, prepared beforehand, turn by turn with the
    simulator, on one core, from a neighbour; model: a folder, or the networks that come with muslin."""
    torch.set_num_threads(threads)
    pipeline = load_pipeline(model or SHIPPED)
    garment = pipeline.prepare(garment_of(pipeline.world.design, {}))
    _seconds(pipeline, garment, batch, 0)
    one, batched, simulated = [], [], []
    for number in range(rounds):
        one.append(_seconds(pipeline, garment, 1, number))
        batched.append(_seconds(pipeline, garment, batch, number))
        simulated.append(drape_costs(1, SHAPE_STEP, None)[1].cpu_seconds)
    faster = paired_ratio(simulated, batched)
    return Inference(len(garment.mean), threads, tuple(one), tuple(batched), tuple(simulated), faster)


def _seconds(pipeline: DrapePipeline, garment: PreparedGarment, batch: int, seed: int) -> float:
    """Wall seconds of one drape of batches of them."""
    shapes = np.random.default_rng(seed).uniform(-3.0, 3.0, (DRAPES // batch, batch, 1))
    begun = time.perf_counter()
    for some in shapes:
        pipeline.drapes([garment] * batch, list(some), [pipeline.world.fabrics[0]] * batch)
    return (time.perf_counter() - begun) / shapes.size
