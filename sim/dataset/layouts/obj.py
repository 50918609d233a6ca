"""A folder of OBJ files a sample: the cloth with its uv, and what it lies on.

cloth_0000.obj …                body_0000.obj …, or body.obj where it stands still
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from muslin.sim.dataset.export import write_obj
from muslin.sim.dataset.layouts.layout import Facts, Layout
from muslin.sim.dataset.parts import Part, sample_parts
from muslin.sim.dataset.sample import Sample


def _write(sample: Sample, folder: Path, out: Path, body: bool) -> Facts:
    cloth, *others = sample_parts(sample, body)
    for frame in range(cloth.num_frames):
        write_obj(folder / f"cloth_{frame:04d}.obj", cloth.at(frame))
    for part in others:
        if isinstance(part, Part) and np.array_equal(
            part.positions, part.positions[:1].repeat(part.num_frames, 0)
        ):
            write_obj(folder / f"{part.name}.obj", part.at(0))
            continue
        for frame in range(part.num_frames):
            write_obj(folder / f"{part.name}_{frame:04d}.obj", part.at(frame))
    if sample.body is None:
        return {}
    return {
        "beta": sample.body.beta.tolist(),
        "poses": sample.body.poses.tolist(),
        "translations": sample.body.translations.tolist(),
    }


OBJ = Layout(_write, any_topology=True)
