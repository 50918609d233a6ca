r"""Draws docs/images/adaptive.png: frames of remeshed sequences, the last one's panel, and errors of drapes.

python docs/images/adaptive.py out/sphere out/twist out/benchmarks/adaptive/adaptive.png \
    docs/images/adaptive.png
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from muslin.sim.dataset.reader import open_dataset
from muslin.sim.dataset.sample import Sample
from muslin.sim.view.camera import frame_camera
from muslin.sim.view.layer import FABRIC, Layer
from muslin.sim.view.picture import AZIMUTH, ELEVATION, sample_layers
from muslin.sim.view.render import render
from muslin.sim.view.sheet import contact_sheet

PALE = 0.35 * np.array(FABRIC) + 0.65
SIZE = (430, 430)


def meshed(sample: Sample, frame: int) -> np.ndarray:
    """A frame, its triangles drawn on the cloth."""
    garment, positions = sample.frame_garment(frame), sample.frame_positions(frame).astype(np.float64)
    lines = np.ones(garment.faces.shape, dtype=bool)
    cloth = Layer(positions, garment.faces, PALE, sheet=True, gloss=0.02, seams=lines)
    others = sample_layers(sample, frame)[:-1]
    return render([*others, cloth], frame_camera(positions, *SIZE, AZIMUTH, ELEVATION), SIZE)


def panel(sample: Sample, frame: int) -> np.ndarray:
    """The panel of a frame, flat, with its triangles."""
    garment = sample.frame_garment(frame)
    points = np.pad(garment.panel_vertices, ((0, 0), (0, 1)))
    lines = np.ones(garment.faces.shape, dtype=bool)
    sheet = Layer(points, garment.panel_faces, PALE, sheet=True, gloss=0.0, seams=lines, flat_light=True)
    return render([sheet], frame_camera(points, *SIZE, 0.0, 0.0), SIZE)


def main(sphere: str, twist: str, errors: str, out: str) -> None:
    pictures, captions = [], []
    for path in (sphere, twist):
        sample = open_dataset(Path(path))[0]
        last = sample.num_frames - 1
        pictures += [meshed(sample, last), panel(sample, last)]
        count = sample.frame_garment(last).num_vertices
        captions += [f"{sample.id}, last frame: {count} vertices", "its panel"]
    plot = Image.open(errors).convert("RGB")
    width = 2 * SIZE[0]
    plot = plot.resize((width, round(plot.height * width / plot.width)))
    left = contact_sheet(pictures, 2, captions)
    sheet = Image.new("RGB", (left.shape[1] + width, max(left.shape[0], plot.height)), "white")
    sheet.paste(Image.fromarray(left), (0, 0))
    sheet.paste(plot, (left.shape[1], (sheet.height - plot.height) // 2))
    sheet.quantize(256, dither=Image.Dither.NONE).save(out, optimize=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
