"""Which largest distortion can be asked of a triangulation: the share of draws that reach it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.remesh import Case, source_mesh
from muslin.garments.errors import InputError
from muslin.sim.remesh.topology import remesh


@dataclass(frozen=True)
class Reach:
    """Of `draws` triangulations of about `vertices`, how many reached `max_distortion`; the others ended with
    an error."""

    vertices: int
    max_distortion: float
    draws: int
    reached: int


def reach(
    presets: Sequence[str],
    vertices: Sequence[int],
    distortions: Sequence[float],
    seeds: int,
    tell: Callable[[str], None],
) -> list[Reach]:
    """So many seeds of every preset, remeshed from its template of about 4,000 vertices."""
    sources = [source_mesh(Case(preset, 4000, 0)) for preset in presets]
    found = []
    for count in vertices:
        for largest in distortions:
            reached = 0
            for source in sources:
                flat, area = np.zeros((source.num_vertices, 3)), float(source.face_areas.sum()) / (2 * count)
                for seed in range(seeds):
                    try:
                        remesh(source, flat, area, seed=seed, max_distortion=largest)
                    except InputError:
                        continue
                    reached += 1
            found.append(Reach(count, largest, len(sources) * seeds, reached))
            tell(f"{count} vertices, distortion {largest:g}: {reached} of {len(sources) * seeds}")
    return found
