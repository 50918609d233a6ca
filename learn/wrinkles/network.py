"""The network that draws displacement maps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import torch
from diffusers import UNet2DModel
from torch import Tensor, nn
from torch.nn.functional import pixel_shuffle, pixel_unshuffle

from muslin.garments.errors import InputError
from muslin.learn.wrinkles.layout import map_layout

HIDDEN = 128
"""Width of the network through which conditions go."""
PLACES = 8
"""Learned channels that tell where in the layout a texel lies."""
NARROWEST = 0.1
"""Spread of a condition, in its own unit, below which it counts as one that hardly varies."""
FURTHEST = 3.0
"""Spreads from the mean at which conditions are cut off: what is further was never seen."""


@dataclass(frozen=True)
class NetworkConfig:
    """size: of maps; conditions: numbers of a condition; fields: numbers that each place is told; previous:
    whether it sees the map of the frame before; patch: texels a side that are one place of the U-Net;
    channels: of its levels; layers: residual layers a level; attention: levels that have it."""

    design: str
    size: int
    conditions: int
    fields: int
    previous: bool
    patch: int = 4
    channels: tuple[int, ...] = (64, 96, 128)
    layers: int = 1
    attention: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        step = self.patch * 2 ** (len(self.channels) - 1)
        if self.size % step:
            raise InputError(
                f"maps of {self.size} texels: {len(self.channels)} levels and a patch of {self.patch} need a "
                f"multiple of {step}"
            )

    @staticmethod
    def from_json(values: Mapping[str, Any]) -> NetworkConfig:
        """The inverse of `dataclasses.asdict`, by way of JSON."""
        lists = {name: tuple(values[name]) for name in ("channels", "attention")}
        return NetworkConfig(**{**values, **lists})

    @property
    def side(self) -> int:
        """Places of the U-Net along a side of the map."""
        return self.size // self.patch


SIZES: dict[str, dict[str, object]] = {
    "tiny": {"patch": 4, "channels": (32, 32)},
    "small": {"patch": 4, "channels": (64, 96, 128)},
    "medium": {"patch": 2, "channels": (64, 96, 128, 128), "layers": 2},
    "thesis": {"patch": 1, "channels": (128, 128, 256, 256, 512, 512), "layers": 2, "attention": (4,)},
}
"""Of networks: 0.4, 3.7, 7.7 and 113.9 million weights. The last is that of the thesis, chapter 5."""


@dataclass(frozen=True, eq=False)
class Seen:
    """What a network is told of B frames: conditions (B, C); fields (B, F, side, side); previous
    (B, 3, S, S), the map of the frame before, in units of `spread`; and whether it is known, 1 or 0, (B,)."""

    conditions: Tensor
    fields: Tensor
    previous: Tensor
    known: Tensor

    def to(self, device: torch.device) -> Seen:
        return Seen(
            self.conditions.to(device),
            self.fields.to(device),
            self.previous.to(device),
            self.known.to(device),
        )


class WrinkleNetwork(nn.Module):
    """F(x, t | c, f, m'): x the noisy map, t how noisy, c the condition, f the fields, m' the map of the
    frame before.

    diffusers' U-Net on patches of texels, [x, f, m', whether m' is known, the mask, learned channels of
    place]; c, over its spread, through two layers of HIDDEN is added to the embedding of t. Maps are in units
    of `spread`, 0 outside of the mask. Source: Vidaurre 2024, chapter 5; the fields, the patches (Peebles and
    Xie 2023, "Scalable Diffusion Models with Transformers"), the mask and places are ours.
    """

    centre: Tensor
    width: Tensor
    spread: Tensor
    mask: Tensor

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self.config = config
        texels = config.patch**2
        levels = range(len(config.channels))
        channels = 3 * texels * (1 + config.previous) + config.previous + texels + config.fields + PLACES
        embedding = 4 * config.channels[0]
        self.unet = UNet2DModel(
            sample_size=config.side,
            in_channels=channels,
            out_channels=3 * texels,
            block_out_channels=config.channels,
            layers_per_block=config.layers,
            down_block_types=tuple(
                "AttnDownBlock2D" if k in config.attention else "DownBlock2D" for k in levels
            ),
            up_block_types=tuple(
                "AttnUpBlock2D" if k in config.attention else "UpBlock2D" for k in reversed(levels)
            ),
            norm_num_groups=16,
            class_embed_type="identity",
        )
        self.embed = nn.Sequential(
            nn.Linear(config.conditions, HIDDEN), nn.SiLU(), nn.Linear(HIDDEN, embedding)
        )
        self.places = nn.Parameter(0.1 * torch.randn(1, PLACES, config.side, config.side))
        self.register_buffer("centre", torch.zeros(config.conditions))
        self.register_buffer("width", torch.ones(config.conditions))
        self.register_buffer("spread", torch.ones(()))
        mask = torch.from_numpy(map_layout(config.design, config.size).mask)
        self.register_buffer("mask", mask[None, None].float(), persistent=False)

    def normalise(self, conditions: Tensor, spread: float) -> None:
        """Take centre and width from conditions (N, C) of the training set; spread: of its maps, metres."""
        self.centre.copy_(conditions.mean(0))
        self.width.copy_(conditions.std(0, correction=0).clamp_min(NARROWEST))
        self.spread.fill_(spread)

    def forward(self, x: Tensor, t: Tensor, seen: Seen) -> Tensor:
        """(B, 3, S, S) of x (B, 3, S, S) and t (B,); all maps in units of `spread`."""
        patch, side = self.config.patch, self.config.side
        count = len(x)
        parts = [pixel_unshuffle(x, patch), seen.fields]
        if self.config.previous:
            told = seen.known[:, None, None, None]
            parts += [pixel_unshuffle(seen.previous * told, patch), told.expand(count, 1, side, side)]
        mask = pixel_unshuffle(self.mask, patch)
        parts += [mask.expand(count, -1, -1, -1), self.places.expand(count, -1, -1, -1)]
        q = ((seen.conditions - self.centre) / self.width).clamp(-FURTHEST, FURTHEST)
        drawn = self.unet(torch.cat(parts, dim=1), t, class_labels=self.embed(q)).sample
        out: Tensor = pixel_shuffle(drawn, patch) * self.mask
        return out
