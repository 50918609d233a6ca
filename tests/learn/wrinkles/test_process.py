"""Maps drawn from noise: with exact predictions, what is drawn is exactly distributed."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from torch import Tensor

from muslin.garments.errors import InputError
from muslin.learn.wrinkles.process import FLOW_NOISES, HEAVIEST, NOISES, Drawing, Process

MEAN, SPREAD = 0.4, 0.3
SHAPE = (64, 3, 16, 16)


def levels() -> np.ndarray:
    """a_t of the cosine schedule (Nichol and Dhariwal 2021, equation 17), each step cut at 0.999."""
    f = np.cos((np.arange(NOISES + 1) / NOISES + 0.008) / 1.008 * np.pi / 2) ** 2
    return np.cumprod(1.0 - np.minimum(1.0 - f[1:] / f[:-1], 0.999))


def parts(process: Process, t: float) -> tuple[float, float]:
    """Of x and of noise in x_t."""
    if process.kind == "flow":
        return 1.0 - t / FLOW_NOISES, t / FLOW_NOISES
    kept = levels()[int(t)]
    return float(np.sqrt(kept)), float(np.sqrt(1.0 - kept))


def gaussian(process: Process):
    """E[x | x_t] of x normal with MEAN and SPREAD."""

    def predict(x: Tensor, t: Tensor) -> Tensor:
        signal, noise = parts(process, float(t[0]))
        gain = SPREAD**2 * signal / (SPREAD**2 * signal**2 + noise**2)
        return MEAN + gain * (x - signal * MEAN)

    return predict


def noise(seed: int = 0) -> Tensor:
    return torch.randn(SHAPE, generator=torch.Generator().manual_seed(seed))


def generators() -> list[torch.Generator]:
    return [torch.Generator().manual_seed(100 + k) for k in range(SHAPE[0])]


@pytest.mark.parametrize("kind", ["epsilon", "v"])
def test_noisy_maps_are_of_the_cosine_schedule(kind: str) -> None:
    process = Process(kind)
    x, e = noise(1)[:NOISES], noise(2)[:NOISES]
    t = torch.arange(len(x)) * (NOISES - 1) // (len(x) - 1)
    for k, found in zip(t.tolist(), process.noisy(x, e, t), strict=True):
        signal, rest = parts(process, k)
        place = (t == k).nonzero()[0, 0]
        torch.testing.assert_close(found, signal * x[place] + rest * e[place], atol=1e-5, rtol=1e-4)
    assert parts(process, 0)[0] > 0.999
    assert parts(process, NOISES - 1)[0] < 0.01


def test_weights_are_those_of_what_follows_from_x() -> None:
    """A wrong x makes e, v and the velocity wrong by so much, but for the cut."""
    x, wrong = 0.7, 0.01
    for kind, t in (("epsilon", 60), ("v", 60), ("flow", 600.0)):
        process = Process(kind)
        signal, rest = parts(process, t)
        seen = signal * x + rest * 0.2
        if kind == "epsilon":
            said = [(seen - signal * own) / rest for own in (x, x + wrong)]
        elif kind == "v":
            said = [signal * (seen - signal * own) / rest - rest * own for own in (x, x + wrong)]
        else:
            said = [(seen - own) / rest for own in (x, x + wrong)]
        weight = float(process.weight(torch.tensor([t]))[0])
        assert weight == pytest.approx(((said[1] - said[0]) / wrong) ** 2, rel=1e-3)
        assert float(process.weight(torch.tensor([1]))[0]) == HEAVIEST


@pytest.mark.parametrize("kind", ["epsilon", "v", "flow"])
def test_times_cover_all_noise(kind: str) -> None:
    process = Process(kind)
    t = process.times(4000, torch.Generator().manual_seed(0)).double()
    most = FLOW_NOISES if kind == "flow" else NOISES - 1
    assert t.min() >= 0.0
    assert t.max() <= most
    assert t.mean() / most == pytest.approx(0.5, abs=0.02)
    assert t.std() / most == pytest.approx(1.0 / np.sqrt(12.0), abs=0.02)


@pytest.mark.parametrize(
    ("kind", "sampler", "steps", "off"),
    [
        ("epsilon", "ddpm", 100, 0.07),
        ("v", "ddim", 10, 0.25),
        ("v", "ddim", 100, 0.03),
        ("v", "dpm", 5, 0.4),
        ("epsilon", "dpm", 20, 0.03),
        ("flow", "euler", 4, 0.5),
        ("flow", "euler", 100, 0.03),
    ],
)
def test_a_normal_distribution_is_drawn(kind: str, sampler: str, steps: int, off: float) -> None:
    # Few steps draw what is too narrow: at each the prediction is a mean.
    process = Process(kind)
    drawn = process.draw(gaussian(process), noise(), Drawing(sampler, steps), generators())
    # Means of 49,152 numbers are exact to 0.002.
    assert float(drawn.mean()) == pytest.approx(MEAN, abs=0.01)
    assert float(drawn.std()) == pytest.approx(SPREAD, rel=off)


@pytest.mark.parametrize(
    ("kind", "sampler"), [("epsilon", "ddpm"), ("v", "ddim"), ("epsilon", "dpm"), ("flow", "euler")]
)
@pytest.mark.parametrize("steps", [1, 2, 5, 20])
def test_what_is_certain_is_drawn_in_any_number_of_steps(kind: str, sampler: str, steps: int) -> None:
    x = noise(3)
    drawn = Process(kind).draw(lambda *_: x, noise(), Drawing(sampler, steps), generators())
    torch.testing.assert_close(drawn, x, atol=1e-4, rtol=1e-4)


@pytest.mark.parametrize(("kind", "sampler"), [("v", "ddim"), ("epsilon", "dpm"), ("flow", "euler")])
def test_little_noise_stays_near_the_frame_before(kind: str, sampler: str) -> None:
    """Begun from `before` with a fifth of the noise, nothing is left but what is between the two."""
    process = Process(kind)
    before = torch.full(SHAPE, MEAN + 2.0 * SPREAD)
    drawn = [
        process.draw(gaussian(process), noise(), Drawing(sampler, 4, strength), generators(), before).mean()
        for strength in (0.2, 0.6, 1.0)
    ]
    assert drawn[0] > drawn[1] > drawn[2]
    assert float(drawn[0]) > MEAN + SPREAD
    assert float(drawn[2]) == pytest.approx(MEAN, abs=0.01)


def test_regression_says_it_at_once() -> None:
    process = Process("regression")
    x, seen = noise(3), []

    def predict(given: Tensor, t: Tensor) -> Tensor:
        seen.append((given, t))
        return x

    assert torch.equal(process.draw(predict, noise(), Drawing()), x)
    ((given, t),) = seen
    assert not given.any()
    assert not t.any()
    assert not process.noisy(x, noise(), t).any()


@pytest.mark.parametrize(
    ("kind", "drawing", "why"),
    [
        ("flow", Drawing("dpm"), "takes euler"),
        ("v", Drawing("euler"), "takes ddpm, ddim, dpm"),
        ("v", Drawing("ddpm", 101), "from 1 to 100"),
        ("regression", Drawing("once", 2), "from 1 to 1"),
        ("v", Drawing(strength=0.0), "above 0"),
        ("v", Drawing(strength=1.1), "1 at most"),
    ],
)
def test_drawings_that_cannot_be(kind: str, drawing: Drawing, why: str) -> None:
    with pytest.raises(InputError, match=why):
        drawing.of(kind)
    with pytest.raises(InputError, match="must be one of"):
        Process("gan")
