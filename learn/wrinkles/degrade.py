"""Previous maps made worse in training, as they will be when they are the network's own."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn.functional import conv2d

from muslin.garments.errors import InputError

REACH = 3.0
"""Standard deviations after which the kernel of a blur ends."""


@dataclass(frozen=True)
class Degrading:
    """blur: standard deviation at most, in shares of the map's side; colour: of scale and, in spreads, offset
    of each channel, standard deviation; noise: the same of what is added to each texel before the blur;
    unknown: share of maps that are left out, as before a first frame."""

    blur: float = 0.02
    colour: float = 0.1
    noise: float = 0.2
    unknown: float = 0.1

    def __post_init__(self) -> None:
        for name, most in (("blur", 0.25), ("colour", 1.0), ("noise", 1.0), ("unknown", 1.0)):
            if not 0.0 <= getattr(self, name) <= most:
                raise InputError(f"{name} = {getattr(self, name)}: must be from 0 to {most:g}")

    def __call__(self, maps: Tensor, mask: Tensor, generator: torch.Generator) -> Tensor:
        """Maps (B, 3, S, S) noisy, blurred, channels scaled and shifted; 0 outside of the mask (S, S)."""
        count = len(maps)
        worse = maps + self.noise * torch.randn(maps.shape, generator=generator)
        width = self.blur * maps.shape[-1] * float(torch.rand((), generator=generator))
        worse = blurred(worse, mask, width)
        scale, offset = self.colour * torch.randn((2, count, 3, 1, 1), generator=generator)
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
