"""What networks see made worse in training, as it will be when it is their own, or new."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn.functional import conv2d, interpolate

from muslin.garments.errors import InputError

REACH = 3.0
"""Standard deviations after which the kernel of a blur ends."""
MOST_OWN = 16
PATCH = 16
"""Texels a side of what noise is the same over, about: a network's errors are smooth."""


@dataclass(frozen=True)
class Degrading:
    """blur: standard deviation at most, in shares of the map's side; colour: standard deviation at most of
    the scale and, in spreads, of the offset of each channel; noise: the same of what is added, smooth over
    PATCH texels; unknown: share of maps that are left out, as before a first frame; conditions: standard
    deviation of what is added to these, in their spreads; own: most frames that lead to one, each said from
    the one before, whose last is then the frame before.

    The thesis blurs and jitters colours. Noise as large as a network's own errors, more on some maps than on
    others, keeps it from taking the frame before as the truth, so that errors die out instead of adding up;
    and it learns from its own maps, errors and all, to do better (Brandstetter et al. 2022, "Message Passing
    Neural PDE Solvers": the pushforward).
    """

    blur: float = 0.02
    colour: float = 0.5
    noise: float = 0.8
    unknown: float = 0.25
    conditions: float = 0.1
    own: int = 2

    def __post_init__(self) -> None:
        for name, most in (
            ("blur", 0.25),
            ("colour", 1.0),
            ("noise", 1.0),
            ("unknown", 1.0),
            ("conditions", 1.0),
        ):
            if not 0.0 <= getattr(self, name) <= most:
                raise InputError(f"{name} = {getattr(self, name)}: must be from 0 to {most:g}")
        if not 0 <= self.own <= MOST_OWN:
            raise InputError(f"own = {self.own}: must be from 0 to {MOST_OWN}")

    def __call__(self, maps: Tensor, mask: Tensor, generator: torch.Generator) -> Tensor:
        """Maps (B, 3, S, S) blurred, noisy, channels scaled and shifted; 0 outside of the mask (S, S)."""
        count, size = len(maps), maps.shape[-1]
        worse = blurred(maps, mask, self.blur * size * float(torch.rand((), generator=generator)))
        coarse = torch.randn((count, 3, size // PATCH + 1, size // PATCH + 1), generator=generator)
        much = torch.rand((count, 1, 1, 1), generator=generator)
        worse = worse + much * self.noise * interpolate(coarse, size=(size, size), mode="bicubic")
        scale, offset = self.colour * much * torch.randn((2, count, 3, 1, 1), generator=generator)
        return ((1.0 + scale) * worse + offset) * mask


def blurred(maps: Tensor, mask: Tensor, width: float) -> Tensor:
    """Gaussian means of maps (..., S, S) over texels of the mask (S, S) alone; width: standard deviation in
    texels."""
    reach = int(REACH * width)
    if reach < 1:
        return maps * mask
    places = torch.arange(-reach, reach + 1, dtype=maps.dtype, device=maps.device)
    kernel = torch.exp(-0.5 * (places / width) ** 2)
    size = maps.shape[-1]
    both = torch.cat([(maps * mask).reshape(-1, 1, size, size), mask.expand(1, 1, size, size)])
    both = conv2d(both, kernel[None, None, :, None], padding=(reach, 0))
    both = conv2d(both, kernel[None, None, None, :], padding=(0, reach))
    mean = both[:-1] / both[-1:].clamp_min(1e-12)
    return mean.reshape(maps.shape) * mask
