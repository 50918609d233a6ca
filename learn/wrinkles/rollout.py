"""Maps of whole sequences, frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from muslin.learn.wrinkles.clips import Told
from muslin.learn.wrinkles.network import Seen, WrinkleNetwork
from muslin.learn.wrinkles.process import Drawing, Process

Noise = Literal["fixed", "fresh"]
"""Whether the noise that frames of a sequence are drawn from is the same in all of them."""
BATCH = 16


@torch.no_grad()
def draw(
    network: WrinkleNetwork, process: Process, seen: Seen, seeds: Sequence[Sequence[int]], drawing: Drawing
) -> Tensor:
    """Maps (B, 3, S, S), in units of the network's spread, of frames; each a function of its own seed,
    whatever it is drawn together with."""
    device = network.spread.device
    shape = 3, network.config.size, network.config.size
    generators = [_generator(seed) for seed in seeds]
    noise = torch.stack([torch.randn(shape, generator=own) for own in generators])
    seen = seen.to(device)
    mask = network.mask[0]

    def predict(x: Tensor, t: Tensor) -> Tensor:
        said: Tensor = network(x * mask, t.to(device), seen)
        return said

    before = seen.previous if bool(seen.known.all()) else None
    return process.draw(predict, noise.to(device), drawing, generators, before) * mask


def roll_out(
    network: WrinkleNetwork,
    process: Process,
    sequences: Sequence[Told],
    drawing: Drawing,
    *,
    seed: int = 0,
    noise: Noise = "fixed",
    batch: int = BATCH,
) -> list[NDArray[np.float32]]:
    """Maps (T, N, 3), metres, of all frames of sequences.

    A network that sees the frame before gets its own map of it, and in the first frame none; sequences go
    side by side. One that does not takes frames as they come.
    """
    network.eval()
    found = [np.zeros((len(told), int(network.mask.sum()), 3), np.float32) for told in sequences]
    if not network.config.previous:
        frames = [(k, t) for k, told in enumerate(sequences) for t in range(len(told))]
        for first in range(0, len(frames), batch):
            own = frames[first : first + batch]
            maps = _next(network, process, sequences, own, None, drawing, seed, noise)
            _keep(found, own, maps, network)
        return found
    for first in range(0, len(sequences), batch):
        group = range(first, min(first + batch, len(sequences)))
        before: dict[int, Tensor] = {}
        for t in range(max(len(sequences[k]) for k in group)):
            own = [(k, t) for k in group if t < len(sequences[k])]
            maps = _next(network, process, sequences, own, before, drawing, seed, noise)
            before = {k: own_map for (k, _), own_map in zip(own, maps, strict=True)}
            _keep(found, own, maps, network)
    return found


def _next(
    network: WrinkleNetwork,
    process: Process,
    sequences: Sequence[Told],
    frames: Sequence[tuple[int, int]],
    before: dict[int, Tensor] | None,
    drawing: Drawing,
    seed: int,
    noise: Noise,
) -> Tensor:
    """Maps (B, 3, S, S) of frames (sequence, frame)."""
    conditions = torch.from_numpy(np.stack([sequences[k].conditions[t] for k, t in frames]))
    fields = torch.from_numpy(np.stack([sequences[k].fields[t] for k, t in frames]))
    if before:
        previous, known = torch.stack([before[k] for k, _ in frames]), torch.ones(len(frames))
    else:
        side = network.config.size
        previous, known = torch.zeros(len(frames), 3, side, side), torch.zeros(len(frames))
    seeds = [(seed, 0 if noise == "fixed" else t) for _, t in frames]
    return draw(network, process, Seen(conditions, fields, previous, known), seeds, drawing)


def _keep(
    found: list[NDArray[np.float32]], frames: Sequence[tuple[int, int]], maps: Tensor, network: WrinkleNetwork
) -> None:
    values = maps[..., network.mask[0, 0] > 0].transpose(1, 2) * network.spread
    for (k, t), own in zip(frames, values.cpu().numpy(), strict=True):
        found[k][t] = own


def _generator(seed: Sequence[int]) -> torch.Generator:
    state = np.random.SeedSequence(list(seed)).generate_state(1, np.uint64)[0]
    return torch.Generator().manual_seed(int(state >> np.uint64(1)))
