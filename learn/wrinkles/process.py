"""How maps come from noise: what a network learns, and how maps are drawn by it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from diffusers import (
    DDPMScheduler,
    DPMSolverMultistepScheduler,
    FlowMatchEulerDiscreteScheduler,
)
from torch import Tensor

from muslin.garments.errors import InputError

KINDS = ("epsilon", "v", "flow", "regression")
SAMPLERS = {
    "epsilon": ("ddpm", "ddim", "dpm"),
    "v": ("ddpm", "ddim", "dpm"),
    "flow": ("euler",),
    "regression": ("once",),
}
"""Of each kind; the first is the usual one."""
STEPS = {"ddpm": 100, "ddim": 10, "dpm": 5, "euler": 2, "once": 1}
"""Usual numbers of them."""
ONE_STEP = {"epsilon": "ddim", "v": "ddim", "flow": "euler", "regression": "once"}
"""Of each kind the sampler whose only step goes to what is said."""
NOISES = 100
"""Levels of noise of diffusion, as in the thesis."""
FLOW_NOISES = 1000
"""In which the network is told the noise of a flow."""
FURTHEST = 8.0
"""Spreads beyond which no value of a map lies; cuts off what division by nearly nothing makes of noise."""

HEAVIEST = {"epsilon": 5.0, "v": 1.0, "flow": 1.0}
"""Of the weights of a loss, which are without bound where there is hardly any noise: there x is nearly told
already, and what conditions say of it is learned where there is much."""
PURE = 0.5
"""Share of the maps that v and flow are learned at pure noise, where nothing but the conditions tells x: of
white noise on smooth maps a little less tells their waves already, and it is there that few steps begin."""

Predict = Callable[[Tensor, Tensor], Tensor]
"""The network's answer to (x_t, t), all else fixed: x."""


@dataclass(frozen=True)
class Drawing:
    """How maps are drawn: sampler and number of steps, both usual ones if not said; strength: the share of
    the noise with which the frame before is begun from, 1 being noise alone."""

    sampler: str = ""
    steps: int = 0
    strength: float = 1.0

    def of(self, kind: str) -> Drawing:
        """With what is not said. Raises InputError for a sampler that a kind has not, or wrong numbers."""
        sampler = self.sampler or SAMPLERS[kind][0]
        if sampler not in SAMPLERS[kind]:
            raise InputError(
                f"sampler {sampler!r}: a model of kind {kind!r} takes {', '.join(SAMPLERS[kind])}"
            )
        steps = self.steps or STEPS[sampler]
        most = {"ddpm": NOISES, "ddim": NOISES, "dpm": NOISES, "euler": FLOW_NOISES, "once": 1}[sampler]
        if not 1 <= steps <= most:
            raise InputError(f"{steps} steps: sampler {sampler!r} takes from 1 to {most}")
        if not 0.0 < self.strength <= 1.0:
            raise InputError(f"strength = {self.strength:g}: must be above 0, and 1 at most")
        return Drawing(sampler, steps, self.strength)


class Process:
    """Noisy maps x_t of maps x and noise e of unit variance, and how wrong a network is about x.

    | kind | x_t | loss |
    | --- | --- | --- |
    | epsilon | sqrt(a) x + sqrt(1 - a) e, a = a_t of the cosine schedule, 100 levels | a / (1 - a) d^2 |
    | v | the same | 1 / (1 - a) d^2 |
    | flow | (1 - s) x + s e, t = 1000 s | 1 / s^2 d^2 |
    | regression | 0, t = 0 | d^2 |

    d = F(x_t, t) - x: networks say x itself. The losses are those of e, of v = sqrt(a) e - sqrt(1 - a) x, and
    of the velocity e - x, which follow from x and x_t; weights are cut at HEAVIEST. Noise has as many
    dimensions as a map has texels; a network of few channels could not even pass it on, but the maps are
    smooth (Li and He 2025, "Back to Basics: Let Denoising Generative Models Denoise").

    Sources: Ho et al. 2020, "Denoising Diffusion Probabilistic Models"; Nichol and Dhariwal 2021, "Improved
    Denoising Diffusion Probabilistic Models" (cosine schedule); Salimans and Ho 2022, "Progressive
    Distillation for Fast Sampling" (v); Lipman et al. 2023, "Flow Matching for Generative Modeling".
    """

    def __init__(self, kind: str) -> None:
        if kind not in KINDS:
            raise InputError(f"kind {kind!r}: must be one of {', '.join(KINDS)}")
        self.kind = kind
        self._options: dict[str, Any] = {
            "num_train_timesteps": NOISES,
            "beta_schedule": "squaredcos_cap_v2",
            "prediction_type": "sample",
        }
        self._noises = DDPMScheduler(**self._options)

    def times(self, count: int, generator: torch.Generator) -> Tensor:
        """(count,) t to learn at, random and uniform; of v and flow a share PURE at the highest."""
        if self.kind == "regression":
            return torch.zeros(count)
        if self.kind == "epsilon":
            return torch.randint(NOISES, (count,), generator=generator)
        pure = torch.rand(count, generator=generator) < PURE
        if self.kind == "v":
            return torch.randint(NOISES, (count,), generator=generator).where(~pure, NOISES - 1)
        shares = torch.rand(count, generator=generator).clamp_min(1.0 / FLOW_NOISES)
        return FLOW_NOISES * shares.where(~pure, 1.0)

    def noisy(self, x: Tensor, noise: Tensor, t: Tensor) -> Tensor:
        """x_t (B, 3, S, S) of x and noise (B, 3, S, S), t (B,)."""
        if self.kind == "regression":
            return torch.zeros_like(x)
        if self.kind == "flow":
            s = (t / FLOW_NOISES)[:, None, None, None]
            return (1.0 - s) * x + s * noise
        found: Tensor = self._noises.add_noise(x, noise, t)
        return found

    def weight(self, t: Tensor) -> Tensor:
        """(B,) of the square of what is wrong at t (B,)."""
        if self.kind == "regression":
            return torch.ones(len(t))
        if self.kind == "flow":
            return (t / FLOW_NOISES).square().reciprocal().clamp_max(HEAVIEST["flow"])
        kept = self._noises.alphas_cumprod[t]
        over = kept if self.kind == "epsilon" else torch.ones_like(kept)
        return (over / (1.0 - kept)).clamp_max(HEAVIEST[self.kind])

    def first(self, predict: Predict, noise: Tensor) -> Tensor:
        """x (B, 3, S, S) as it is said at once, of noise (B, 3, S, S) alone."""
        return self.draw(predict, noise, Drawing(ONE_STEP[self.kind], 1))

    def draw(
        self,
        predict: Predict,
        noise: Tensor,
        drawing: Drawing,
        generators: list[torch.Generator] | None = None,
        before: Tensor | None = None,
    ) -> Tensor:
        """x (B, 3, S, S) from noise (B, 3, S, S).

        before: maps of the frame before, from which it begins where the drawing's strength is below 1;
        generators: B of them, of the noise that "ddpm" adds on the way.
        """
        asked = drawing.of(self.kind)
        if asked.sampler == "once":
            return predict(torch.zeros_like(noise), torch.zeros(len(noise)))
        scheduler, times = self._scheduler(asked, before is not None)
        x = noise
        if before is not None and asked.strength < 1.0:
            x = self._begun(before, noise, times[0])
        for t in times:
            said = predict(x, t.to(torch.float32).expand(len(x)))
            if asked.sampler == "euler":
                said = (x - said) * (FLOW_NOISES / t)
            more = {"generator": generators} if asked.sampler == "ddpm" else {}
            x = scheduler.step(said, t, x, **more).prev_sample
        return x

    def _begun(self, before: Tensor, noise: Tensor, t: Tensor) -> Tensor:
        if self.kind == "flow":
            return (1.0 - t / FLOW_NOISES) * before + t / FLOW_NOISES * noise
        return self._noises.add_noise(before, noise, t.expand(len(before)).long())

    def _scheduler(self, asked: Drawing, begun: bool) -> tuple[Any, Tensor]:
        """Scheduler, and the t at which it steps: all, or of the share `strength` as many."""
        strength = asked.strength if begun else 1.0
        if asked.sampler == "euler":
            flow = FlowMatchEulerDiscreteScheduler(num_train_timesteps=FLOW_NOISES)
            flow.set_timesteps(sigmas=strength * np.linspace(1.0, 1.0 / asked.steps, asked.steps))
            return flow, flow.timesteps
        total = min(NOISES, round(asked.steps / strength))
        first = total - max(1, round(strength * total))
        scheduler: Any
        if asked.sampler == "ddpm":
            scheduler = DDPMScheduler(**self._options, clip_sample=True, clip_sample_range=FURTHEST)
            # Told the levels: from a number of steps that does not divide NOISES it would step by other ones.
            levels = np.round(NOISES - np.arange(total) * NOISES / total).astype(int) - 1
            scheduler.set_timesteps(timesteps=levels.tolist())
            return scheduler, scheduler.timesteps[first:]
        # DDIM is DPM-Solver++ of first order (Lu et al. 2022), and as diffusers has it goes by any levels.
        scheduler = DPMSolverMultistepScheduler(
            **self._options,
            solver_order=1 if asked.sampler == "ddim" else 2,
            timestep_spacing="trailing",
            final_sigmas_type="zero",
        )
        scheduler.set_timesteps(total)
        if first:
            scheduler.set_begin_index(first)
        return scheduler, scheduler.timesteps[first:]
