"""What displacement maps lose of simulated sequences, nothing being learned."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from muslin.learn.wrinkles.garment import unposed_garment
from muslin.learn.wrinkles.templates import templates_of
from muslin.learn.wrinkles.world import world_of
from muslin.sim.dataset.reader import open_dataset


@dataclass(frozen=True)
class MapLoss:
    """Distances of vertices that were encoded and decoded, mm: of all frames of one sequence of a design; of
    its seam vertices alone; and how far apart the map puts the sides of its seams, at most."""

    design: str
    size: int
    mean: float
    p95: float
    largest: float
    at_seams: float
    gap: float


def measure_maps(dataset: Path, sizes: list[int], tell: Callable[[str], None]) -> list[MapLoss]:
    """The first sequence of every design of a dataset, in maps of each size."""
    data = open_dataset(dataset)
    world = world_of(data)
    body = world.load_body()
    training = data.split("train") if "train" in data.splits else data
    templates = templates_of(list(training), world)
    found = []
    for design in dict.fromkeys(row["design"] for row in data.rows):
        sample = data.where(design=design)[0]
        track = world.check(sample)
        for size in sizes:
            garment = unposed_garment(sample.garment, templates, body, size, size // 4)
            maps = garment.maps(sample.positions, track)
            wrong = 1000.0 * np.linalg.norm(garment.positions(maps, track) - sample.positions, axis=-1)
            seams = np.bincount(sample.garment.panel_to_vertex) > 1
            gap = 1000.0 * float(garment.codec.gaps(maps).max())
            p95 = float(np.quantile(wrong, 0.95))
            largest, at_seams = float(wrong.max()), float(wrong[:, seams].mean())
            found.append(MapLoss(design, size, float(wrong.mean()), p95, largest, at_seams, gap))
            tell(f"{design}, {size}: mean {wrong.mean():.3f} mm, 95% below {p95:.3f}, seams {at_seams:.3f}")
    return found
