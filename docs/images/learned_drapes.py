"""Draws docs/images/learned_drapes.png: simulated drapes, a column each, and what methods predict below.

python docs/images/learned_drapes.py out/static docs/images/learned_drapes.png NAME=out/prediction …
"""

from __future__ import annotations

import sys

from PIL import Image

from muslin.sim.dataset.reader import open_dataset
from muslin.sim.device import open_device
from muslin.sim.view.picture import picture
from muslin.sim.view.sheet import contact_sheet

SHOWN = (  # design, shape, fabric, topology
    ("unseen-s22-c104-l064", "beta-001", "gray-interlock", "source"),
    ("unseen-s46-c116-l064", "beta-007", "white-dots-on-blk", "t02"),
    ("unseen-s30-c110-l072", "beta-005", "gray-interlock", "t04"),
    ("unseen-s22-c116-l095", "beta-003", "white-dots-on-blk", "source"),
    ("unseen-s28-c104-l105", "beta-001", "gray-interlock", "t01"),
)
SIZE = (360, 480)


def main(truth: str, out: str, *methods: str) -> None:
    open_device("cpu")
    simulated = open_dataset(truth)
    ids = []
    for design, shape, fabric, topology in SHOWN:
        (row,) = simulated.where(design=design, shape=shape, fabric=fabric, topology=topology).rows
        ids.append(row["id"])
    pictures, captions = [picture(simulated[i], size=SIZE) for i in ids], ["simulated"] * len(ids)
    for name, _, folder in (method.partition("=") for method in methods):
        predicted = open_dataset(folder)
        pictures += [picture(predicted[i], size=SIZE) for i in ids]
        captions += [name.replace("_", " ")] * len(ids)
    sheet = Image.fromarray(contact_sheet(pictures, len(ids), captions))
    sheet.quantize(256, dither=Image.Dither.NONE).save(out, optimize=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
