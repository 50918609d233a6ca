"""Draws docs/images/animated.gif: sequences, a row each, simulated and by methods beside it.

python docs/images/animated.py out/thesis_animated docs/images/animated.gif NAME=out/prediction …
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from muslin.sim.dataset.reader import open_dataset
from muslin.sim.device import open_device
from muslin.sim.view.movie import frame_choice, write_movie
from muslin.sim.view.picture import picture, sample_cameras
from muslin.sim.view.sheet import contact_sheet

SHOWN = (("unseen-length-076", "held-walk-right-sharp"), ("unseen-sleeve-046", "held-kick"))
SIZE, FPS = (220, 280), 15.0


def main(truth: str, out: str, *methods: str) -> None:
    open_device("cpu")
    simulated = open_dataset(truth)
    sets = {"simulated": simulated}
    sets |= {
        name.replace("_", " "): open_dataset(folder)
        for name, _, folder in (method.partition("=") for method in methods)
    }
    rows: list[list[np.ndarray]] = []
    for design, sequence in SHOWN:
        (row,) = simulated.where(design=design, sequence=sequence).rows
        own = simulated[row["id"]]
        frames, fps = frame_choice(own, FPS)
        cameras, ground = sample_cameras(own, frames, SIZE)
        for data in sets.values():
            sample = data[row["id"]]
            rows.append(
                [
                    picture(sample, frame, SIZE, camera=camera, ground=ground)
                    for frame, camera in zip(frames, cameras, strict=True)
                ]
            )
    captions = list(sets) * len(SHOWN)
    count = min(map(len, rows))
    sheets = [contact_sheet([row[k] for row in rows], len(sets), captions) for k in range(count)]
    write_movie(Path(out), sheets, fps)


if __name__ == "__main__":
    main(*sys.argv[1:])
