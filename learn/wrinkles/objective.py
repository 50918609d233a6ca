"""What the network of displacement maps learns, and how well it does."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from muslin.learn.training.batches import ShuffledBatches, evenly
from muslin.learn.wrinkles.clips import Clip, digest_of
from muslin.learn.wrinkles.degrade import Degrading
from muslin.learn.wrinkles.layout import MapLayout
from muslin.learn.wrinkles.network import Seen, WrinkleNetwork
from muslin.learn.wrinkles.process import Drawing, Process
from muslin.learn.wrinkles.rollout import draw

MOST_VALIDATED = 16
"""Frames of a split on which the error is logged."""


@dataclass(frozen=True, eq=False)
class Batch:
    """Noisy maps x (B, 3, S, S) at t (B,), what is seen beside them, the maps without noise, and the noise.

    leading: what is seen of the frames that lead there, in their order; the network's own maps of them, from
    the same noise, are the previous ones, from the second on, and of `seen`.
    """

    x: Tensor
    t: Tensor
    seen: Seen
    target: Tensor
    noise: Tensor
    leading: tuple[Seen, ...] = ()


class Frames:
    """Frames of sequences by their place in one row of all; `spread`, metres, is the unit of maps."""

    def __init__(self, clips: Sequence[Clip], layout: MapLayout, spread: float) -> None:
        self.clips, self.layout, self.spread = clips, layout, spread
        self._starts = np.cumsum([0, *(len(clip) for clip in clips)])

    def __len__(self) -> int:
        return int(self._starts[-1])

    def read(self, places: Sequence[int] | NDArray[np.int64], earlier: int = 0) -> tuple[Tensor, Seen]:
        """Maps (B, 3, S, S) of frames, or of as many frames earlier, but none before the first of a sequence,
        and what is seen of them; in a first frame the map before is not known."""
        maps, before, conditions, fields, known = [], [], [], [], []
        for place in places:
            index = int(np.searchsorted(self._starts, place, side="right")) - 1
            clip, k = self.clips[index], max(int(place - self._starts[index]) - earlier, 0)
            maps.append(clip.maps[k])
            before.append(clip.maps[max(k - 1, 0)])
            conditions.append(clip.told.conditions[k])
            fields.append(clip.told.fields[k])
            known.append(float(k > 0))
        told = torch.from_numpy(np.stack(conditions)), torch.from_numpy(np.stack(fields))
        seen = Seen(*told, self._images(before), torch.tensor(known))
        return self._images(maps), seen

    def _images(self, maps: Sequence[NDArray[np.float32]]) -> Tensor:
        return torch.from_numpy(self.layout.image(np.stack(maps)) / np.float32(self.spread))


class WrinkleObjective:
    """Mean square, over texels of the mask, of what the network says wrong of maps, weighted as `Process`
    does."""

    def __init__(
        self,
        sets: Mapping[str, Sequence[Clip]],
        layout: MapLayout,
        spread: float,
        process: Process,
        degrading: Degrading,
        batch: int,
        seed: int,
        temporal: bool = True,
    ) -> None:
        """sets: "train", and others on which errors are logged; temporal: whether the map of the frame before
        is of use to the network."""
        self.sets = {name: Frames(clips, layout, spread) for name, clips in sets.items()}
        self.process, self.degrading, self.seed = process, degrading, seed
        self.temporal = temporal
        self.mask = torch.from_numpy(layout.mask).float()
        own = np.concatenate([clip.told.conditions for clip in sets["train"]])
        self.width = torch.from_numpy(own.std(axis=0))
        self._order = ShuffledBatches(len(self.sets["train"]), batch, seed)

    def steps(self) -> int:
        return self._order.steps

    def batches(self, epoch: int, rank: int, world: int) -> Iterator[Batch]:
        generator = torch.Generator()
        generator.manual_seed(int(np.random.SeedSequence([self.seed, epoch, rank]).generate_state(1)[0]))
        for places in self._order.places(epoch, rank, world):
            yield self.batch(places, generator)

    def batch(self, places: Sequence[int] | NDArray[np.int64], generator: torch.Generator) -> Batch:
        """Frames with random noise at random levels, seen in random ways."""
        frames = self.sets["train"]
        own = int(torch.randint(self.degrading.own + 1, (), generator=generator)) if self.temporal else 0
        width = self.degrading.conditions * self.width
        off = width * torch.randn((len(places), len(width)), generator=generator)
        leading = []
        for earlier in range(own, 0, -1):
            seen = frames.read(places, earlier)[1]
            leading.append(replace(seen, conditions=seen.conditions + off))
        maps, seen = frames.read(places)
        told = [*leading, replace(seen, conditions=seen.conditions + off)]
        # Nothing is seen of the truth but by the first of them.
        previous = self.degrading(told[0].previous, self.mask, generator)
        kept = torch.rand(len(places), generator=generator) >= self.degrading.unknown
        told[0] = replace(told[0], previous=previous, known=told[0].known * kept)
        t = self.process.times(len(maps), generator)
        noise = torch.randn(maps.shape, generator=generator) * self.mask
        return Batch(self.process.noisy(maps, noise, t), t, told[-1], maps, noise, tuple(told[:-1]))

    def loss(self, model: nn.Module, batch: Batch) -> Tensor:
        device = next(model.parameters()).device
        seen = self._led(model, batch, device)
        said = model(batch.x.to(device), batch.t.to(device), seen)
        # Both are 0 outside of the mask.
        wrong = (said - batch.target.to(device)).square().sum((1, 2, 3)) / (said.shape[1] * self.mask.sum())
        return (self.process.weight(batch.t).to(device) * wrong).mean()

    @torch.no_grad()
    def _led(self, model: nn.Module, batch: Batch, device: torch.device) -> Seen:
        """What is seen, after the maps of the frames that lead there."""
        seen = batch.seen.to(device)
        if not batch.leading:
            return seen
        noise = batch.noise.to(device)
        own = batch.leading[0].previous.to(device)
        for leading in batch.leading:
            told = replace(leading.to(device), previous=own)

            def predict(x: Tensor, t: Tensor, told: Seen = told) -> Tensor:
                said: Tensor = model(x, t.to(device), told)
                return said

            own = self.process.first(predict, noise)
        return replace(seen, previous=own)

    def validate(self, model: nn.Module) -> dict[str, float]:
        """Of some frames of each set the mean length of what is wrong in a texel, mm, drawn from one noise in
        the usual number of steps, seeing the true map of the frame before."""
        assert isinstance(model, WrinkleNetwork)
        found = {}
        for name, frames in self.sets.items():
            maps, seen = frames.read(evenly(len(frames), MOST_VALIDATED))
            drawn = draw(model, self.process, seen, [(k,) for k in range(len(maps))], Drawing())
            wrong = torch.linalg.vector_norm((drawn.cpu() - maps) * self.mask, dim=1).sum((1, 2))
            found[f"error_mm.{name}"] = 1000.0 * frames.spread * float((wrong / self.mask.sum()).mean())
        return found

    def identity(self) -> Mapping[str, Any]:
        return {
            "data": digest_of({name: frames.clips for name, frames in self.sets.items()}),
            "process": self.process.kind,
            "degrading": vars(self.degrading),
            "batch": self._order.batch,
        }
