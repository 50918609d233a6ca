"""Pictures of a training: maps and garments, true and drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from torch import Tensor, nn

from muslin.learn.wrinkles.clips import Clip
from muslin.learn.wrinkles.garment import UnposedGarment
from muslin.learn.wrinkles.layout import MapLayout
from muslin.learn.wrinkles.network import Seen, WrinkleNetwork
from muslin.learn.wrinkles.objective import Frames
from muslin.learn.wrinkles.process import Drawing, Process
from muslin.learn.wrinkles.rollout import draw
from muslin.sim.dataset import durable
from muslin.sim.dataset.sample import Sample
from muslin.sim.view.lighting import DRAFT
from muslin.sim.view.picture import picture
from muslin.sim.view.sheet import contact_sheet

PIXELS = 256
TIMES = 8
"""Pictures of a training, about."""
BRIGHT = 3.0
"""Spreads that are as bright as a channel gets."""
GREY = 0.5


@dataclass(frozen=True, eq=False)
class Example:
    """A frame of a sequence that pictures are made of."""

    sample: Sample
    garment: UnposedGarment
    clip: Clip
    frame: int


@dataclass(frozen=True, eq=False)
class _Truth:
    """What a network sees of an example, and the pictures that stay the same."""

    seen: Seen
    map: NDArray[np.uint8]
    garment: NDArray[np.uint8]


class Pictures:
    """After some epochs one PNG: a row for each example, with its true and its drawn map and garment.

    Networks that see the frame before see the true one.
    """

    def __init__(
        self, examples: Mapping[str, Example], process: Process, spread: float, epochs: int, folder: Path
    ) -> None:
        self.examples, self.process, self.spread, self.folder = dict(examples), process, spread, folder
        self.epochs, self.every = epochs, max(1, epochs // TIMES)
        durable.make_folder(folder)

    def __call__(self, model: nn.Module, epoch: int) -> None:
        """epoch: how many are done."""
        assert isinstance(model, WrinkleNetwork)
        if epoch % self.every and epoch < self.epochs:
            return
        shown, captions = [], []
        for name, example in self.examples.items():
            layout = example.garment.codec.layout
            truth = self._truths[name]
            drawn = draw(model, self.process, truth.seen, [(0,)], Drawing()).cpu()[0]
            garment = _garment_picture(example, layout.values(self.spread * drawn.numpy()))
            shown += [truth.map, map_picture(drawn, layout), truth.garment, garment]
            captions += [f"{name}, true", f"{name}, drawn", "true", "drawn"]
        file = self.folder / f"epoch-{epoch:04d}.png"
        Image.fromarray(contact_sheet(shown, 4, captions)).save(file)

    @cached_property
    def _truths(self) -> dict[str, _Truth]:
        found = {}
        for name, example in self.examples.items():
            layout = example.garment.codec.layout
            maps, seen = Frames([example.clip], layout, self.spread).read([example.frame])
            garment = _garment_picture(example, layout.values(self.spread * maps[0].numpy()))
            found[name] = _Truth(seen, map_picture(maps[0], layout), garment)
        return found


def map_picture(image: Tensor, layout: MapLayout) -> NDArray[np.uint8]:
    """(PIXELS, PIXELS, 3) x, y and z of a map (3, S, S), in spreads, as red, green and blue, 0 being grey; v
    upwards, white outside of the mask."""
    colours = GREY * (1.0 + image.permute(1, 2, 0).numpy() / BRIGHT)
    colours[~layout.mask] = 1.0
    pixels = (255.0 * np.clip(colours, 0.0, 1.0)).astype(np.uint8)[::-1]
    return np.asarray(Image.fromarray(pixels).resize((PIXELS, PIXELS), Image.Resampling.NEAREST))


def _garment_picture(example: Example, maps: NDArray[np.floating]) -> NDArray[np.uint8]:
    sample, k = example.sample, example.frame
    track = sample.body
    assert track is not None
    track = replace(track, poses=track.poses[[k]], translations=track.translations[[k]])
    positions = example.garment.positions(maps[None], track)
    shot = replace(sample, positions=positions, body=track, masked_faces=())
    return picture(shot, 0, (PIXELS, PIXELS), quality=DRAFT)
