import numpy as np
import pytest
import torch
from torch import Tensor

from muslin.garments.errors import InputError
from muslin.learn.wrinkles.process import (
    FLOW_NOISES,
    HEAVIEST,
    KINDS,
    NOISES,
    PURE,
    SAMPLERS,
    STEPS,
    Drawing,
    Predict,
    Process,
)

MEAN, SPREAD = 0.7, 0.3
SHAPE = (8, 3, 48, 48)
DIFFUSIONS = ("epsilon", "v")
EVERY = [(kind, sampler) for kind in KINDS for sampler in SAMPLERS[kind] if kind != "regression"]


def cosine() -> np.ndarray:
    """(NOISES,) a_t, the square of the share of x in x_t: Nichol and Dhariwal 2021, eq. 17, betas cut at
    0.999."""
    bar = np.cos((np.linspace(0.0, 1.0, NOISES + 1) + 0.008) / 1.008 * 0.5 * np.pi) ** 2
    return np.cumprod(1.0 - np.minimum(1.0 - bar[1:] / bar[:-1], 0.999))


def shares(kind: str, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of x and of noise in x_t."""
    if kind == "flow":
        return 1.0 - t / FLOW_NOISES, t / FLOW_NOISES
    a = cosine()[np.asarray(t).astype(int)]
    return np.sqrt(a), np.sqrt(1.0 - a)


def mean_of(kind: str, mean: float = MEAN, spread: float = SPREAD) -> Predict:
    """The mean of x, given x_t, of maps whose every value is normal: what a perfect network says."""

    def predict(x: Tensor, t: Tensor) -> Tensor:
        alpha, sigma = (
            torch.tensor(own, dtype=x.dtype)[:, None, None, None] for own in shares(kind, t.numpy())
        )
        gain = alpha * spread**2 / (alpha**2 * spread**2 + sigma**2)
        return mean + gain * (x - alpha * mean)

    return predict


def noise(seed: int = 0, shape: tuple[int, ...] = SHAPE) -> Tensor:
    return torch.randn(shape, generator=torch.Generator().manual_seed(seed))


def generators(count: int = SHAPE[0]) -> list[torch.Generator]:
    return [torch.Generator().manual_seed(100 + k) for k in range(count)]


# Some 55 000 values: their spread is sure to 1 %. Few steps draw too little spread, never too much.
@pytest.mark.parametrize(
    ("sampler", "steps", "least"),
    [
        ("ddpm", 25, 0.24),
        ("ddpm", 100, 0.28),
        ("ddim", 10, 0.23),
        ("ddim", 100, 0.29),
        ("dpm", 5, 0.185),
        ("dpm", 10, 0.25),
        ("dpm", 20, 0.285),
        ("dpm", 100, 0.297),
        ("euler", 2, 0.08),
        ("euler", 20, 0.265),
        ("euler", 100, 0.29),
        ("euler", 500, 0.297),
    ],
)
def test_a_perfect_network_draws_normal_maps_as_they_are(sampler: str, steps: int, least: float) -> None:
    for kind in KINDS:
        if sampler in SAMPLERS[kind]:
            drawn = Process(kind).draw(mean_of(kind), noise(), Drawing(sampler, steps), generators())
            assert float(drawn.mean()) == pytest.approx(MEAN, abs=0.005)
            assert least < float(drawn.std()) < 0.303
            standard = (drawn - drawn.mean()) / drawn.std()
            # That of a normal distribution is 3; known here to 0.04.
            assert float(standard.pow(4).mean()) == pytest.approx(3.0, abs=0.1)


@pytest.mark.parametrize("steps", [1, 2, 7, 10, 25, 60, 100])
@pytest.mark.parametrize("kind", ["v", "flow"])
def test_ddim_and_euler_go_the_straight_steps_of_their_equations(kind: str, steps: int) -> None:
    """x_s = alpha_s x + sigma_s e with x as it is said and e as it follows, down to sigma = 0."""
    if kind == "flow":
        levels = FLOW_NOISES * np.linspace(1.0, 1.0 / steps, steps)
    else:
        levels = np.round(NOISES - np.arange(steps) * NOISES / steps) - 1
    alpha, sigma = (np.append(own, end) for own, end in zip(shares(kind, levels), (1.0, 0.0), strict=True))
    begun = noise(1, (1, 3, 16, 16)).double()
    x = begun.numpy()
    for k in range(steps):
        gain = alpha[k] * SPREAD**2 / (alpha[k] ** 2 * SPREAD**2 + sigma[k] ** 2)
        said = MEAN + gain * (x - alpha[k] * MEAN)
        x = alpha[k + 1] * said + sigma[k + 1] * (x - alpha[k] * said) / sigma[k]
    drawing = Drawing("euler" if kind == "flow" else "ddim", steps)
    # The schedulers hold their levels in float32.
    np.testing.assert_allclose(Process(kind).draw(mean_of(kind), begun, drawing), x, atol=2e-4)


@pytest.mark.parametrize("steps", [1, 2, 3, 10, 33, 100])
@pytest.mark.parametrize(("kind", "sampler"), EVERY)
def test_the_only_map_there_is_is_drawn_exactly(kind: str, sampler: str, steps: int) -> None:
    only = noise(5, (2, 3, 8, 8)).clamp(-4.0, 4.0)
    drawn = Process(kind).draw(
        lambda x, t: only, noise(6, (2, 3, 8, 8)), Drawing(sampler, steps), generators(2)
    )
    torch.testing.assert_close(drawn, only, atol=1e-6, rtol=0.0)


@pytest.mark.parametrize(("kind", "sampler"), EVERY)
@pytest.mark.parametrize("steps", [1, 4, 10])
def test_the_network_is_asked_once_a_step_from_pure_noise_on(kind: str, sampler: str, steps: int) -> None:
    asked: list[tuple[Tensor, float]] = []

    def predict(x: Tensor, t: Tensor) -> Tensor:
        assert (t == t[0]).all()
        asked.append((x, float(t[0])))
        return 0.1 * x

    begun = noise(2, (2, 3, 8, 8))
    Process(kind).draw(predict, begun, Drawing(sampler, steps), generators(2))
    assert torch.equal(asked[0][0], begun)
    levels = [t for _, t in asked]
    assert len(levels) == steps
    assert levels == sorted(levels, reverse=True)
    assert levels[0] == (FLOW_NOISES if kind == "flow" else NOISES - 1)


@pytest.mark.parametrize("kind", ["epsilon", "v", "flow"])
def test_noisy_maps_go_from_the_map_to_pure_noise(kind: str) -> None:
    process, x, e = Process(kind), 0.5 * noise(0), noise(1)
    last = FLOW_NOISES if kind == "flow" else NOISES - 1
    levels = np.linspace(0, last, 8).astype(int)
    alpha, sigma = shares(kind, levels)
    expected = alpha[:, None, None, None] * x.numpy() + sigma[:, None, None, None] * e.numpy()
    found = process.noisy(x, e, torch.tensor(levels) if kind != "flow" else torch.tensor(levels).float())
    np.testing.assert_allclose(found, expected, atol=1e-5)
    assert float((found[0] - x[0]).std()) < 0.03
    assert float((found[-1] - e[-1]).std()) < 1e-3
    if kind != "flow":
        np.testing.assert_allclose(alpha**2 + sigma**2, 1.0)


@pytest.mark.parametrize("kind", ["epsilon", "v", "flow"])
def test_the_weighted_loss_is_that_of_noise_of_v_or_of_the_velocity(kind: str) -> None:
    """Another x, said of the same x_t, means another e: those that follow are compared as the papers do."""
    last = FLOW_NOISES if kind == "flow" else NOISES - 1
    levels = np.linspace(0.0, last, 12).round()[1:]
    x, said, e = np.random.default_rng(0).standard_normal((3, 11))
    alpha, sigma = shares(kind, levels)
    follows = (alpha * x + sigma * e - alpha * said) / sigma
    wrong = {
        "epsilon": follows - e,
        "v": alpha * (follows - e) - sigma * (said - x),
        "flow": (follows - said) - (e - x),
    }[kind]
    t = torch.tensor(levels) if kind == "flow" else torch.tensor(levels).long()
    weight = Process(kind).weight(t).numpy()
    exact = wrong**2 / (said - x) ** 2
    np.testing.assert_allclose(weight, np.minimum(exact, HEAVIEST[kind]), rtol=1e-3, atol=1e-6)
    assert exact.max() > HEAVIEST[kind]
    # That of e is 0 at pure noise, the others' are 1 at least.
    assert (exact < HEAVIEST[kind]).sum() >= (5 if kind == "epsilon" else 0)
    assert exact.min() == pytest.approx(0.0 if kind == "epsilon" else 1.0, abs=1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_times_are_uniform_but_for_those_of_pure_noise(kind: str) -> None:
    t = Process(kind).times(20_000, torch.Generator().manual_seed(0))
    again = Process(kind).times(20_000, torch.Generator().manual_seed(0))
    assert torch.equal(t, again)
    if kind == "regression":
        assert (t == 0).all()
        return
    last = FLOW_NOISES if kind == "flow" else NOISES - 1
    least = 1 if kind == "flow" else 0
    assert least <= t.min() < last / 100
    assert t.max() == last
    pure = t == last
    share = {"epsilon": 1.0 / NOISES, "v": PURE + (1.0 - PURE) / NOISES, "flow": PURE}[kind]
    # Of 20 000 the share is sure to 0.0036.
    assert float(pure.float().mean()) == pytest.approx(share, abs=0.015)
    rest = t[~pure]
    counts = np.histogram(rest, bins=9, range=(0, last))[0] / len(rest)
    np.testing.assert_allclose(counts, 1.0 / 9.0, atol=0.015)


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_said_first_is_what_is_said_of_pure_noise(kind: str) -> None:
    asked: list[tuple[Tensor, Tensor]] = []

    def predict(x: Tensor, t: Tensor) -> Tensor:
        asked.append((x, t))
        return 0.2 * x + 1.5

    e = noise(4, (2, 3, 8, 8))
    found = Process(kind).first(predict, e)
    ((x, t),) = asked
    assert torch.equal(x, torch.zeros_like(e) if kind == "regression" else e)
    last = {"regression": 0, "flow": FLOW_NOISES}.get(kind, NOISES - 1)
    assert t.tolist() == [last, last]
    torch.testing.assert_close(found, 0.2 * x + 1.5, atol=1e-5, rtol=0.0)


@pytest.mark.parametrize(
    ("kind", "drawing", "level"),
    [
        ("v", Drawing("ddim", 10, 0.5), 49),
        ("epsilon", Drawing("dpm", 5, 0.5), 49),
        ("v", Drawing("ddpm", 20, 0.2), 19),
        ("flow", Drawing("euler", 4, 0.5), 500),
        ("flow", Drawing("euler", 2, 0.1), 100),
    ],
)
def test_less_strength_begins_from_the_map_before(kind: str, drawing: Drawing, level: int) -> None:
    before, only, e = 2.0 + 0.1 * noise(1), noise(3), noise(2)
    asked: list[tuple[Tensor, float]] = []

    def predict(x: Tensor, t: Tensor) -> Tensor:
        asked.append((x, float(t[0])))
        return only

    drawn = Process(kind).draw(predict, e, drawing, generators(), before)
    alpha, sigma = shares(kind, np.array([level]))
    assert len(asked) == drawing.steps
    assert asked[0][1] == pytest.approx(level, abs=1e-3)
    torch.testing.assert_close(
        asked[0][0], float(alpha[0]) * before + float(sigma[0]) * e, atol=1e-4, rtol=0.0
    )
    torch.testing.assert_close(drawn, only, atol=1e-5, rtol=0.0)


@pytest.mark.parametrize(("kind", "sampler"), EVERY)
def test_the_strength_is_kept_with_the_usual_number_of_steps(kind: str, sampler: str) -> None:
    levels: list[float] = []

    def predict(x: Tensor, t: Tensor) -> Tensor:
        levels.append(float(t[0]))
        return x

    Process(kind).draw(predict, noise(), Drawing(sampler, strength=0.5), generators(), noise(1))
    assert levels[0] == pytest.approx(500.0 if kind == "flow" else 49.0)


@pytest.mark.parametrize(("kind", "sampler"), EVERY)
def test_full_strength_or_no_map_before_begins_from_noise_alone(kind: str, sampler: str) -> None:
    process, before = Process(kind), 2.0 + noise(1)
    fresh = process.draw(mean_of(kind), noise(), Drawing(sampler, 5), generators())
    full = process.draw(mean_of(kind), noise(), Drawing(sampler, 5), generators(), before)
    without = process.draw(mean_of(kind), noise(), Drawing(sampler, 5, 0.3), generators())
    assert torch.equal(fresh, full)
    assert torch.equal(fresh, without)


def test_from_a_likely_map_half_the_noise_ends_at_a_likely_map() -> None:
    """Half way through, the perfect network cannot tell where it began."""
    for kind, drawing in (("v", Drawing("dpm", 20, 0.5)), ("flow", Drawing("euler", 100, 0.5))):
        before = MEAN + SPREAD * noise(7)
        drawn = Process(kind).draw(mean_of(kind), noise(), drawing, None, before)
        assert float(drawn.mean()) == pytest.approx(MEAN, abs=0.005)
        assert float(drawn.std()) == pytest.approx(SPREAD, abs=0.01)
        # Yet it stays near it.
        both = torch.stack([drawn.flatten(), before.flatten()])
        assert 0.1 < float(torch.corrcoef(both)[0, 1]) < 0.9


@pytest.mark.parametrize("kind", DIFFUSIONS)
def test_noise_on_the_way_is_that_of_the_generators(kind: str) -> None:
    draw = Drawing("ddpm", 10)
    first, again = (Process(kind).draw(mean_of(kind), noise(), draw, generators()) for _ in range(2))
    assert torch.equal(first, again)
    other = Process(kind).draw(mean_of(kind), noise(), draw, generators()[::-1])
    assert float((other - first).std()) > 0.05


def test_regression_draws_what_the_network_says_of_nothing() -> None:
    asked = []

    def predict(x: Tensor, t: Tensor) -> Tensor:
        asked.append((x, t))
        return x + 3.0

    drawn = Process("regression").draw(predict, noise(), Drawing())
    assert (drawn == 3.0).all()
    ((x, t),) = asked
    assert x.shape == SHAPE
    assert (t == 0.0).all()
    assert (Process("regression").noisy(noise(0), noise(1), t) == 0.0).all()
    assert (Process("regression").weight(t) == 1.0).all()


def test_usual_samplers_and_steps_are_filled_in() -> None:
    assert Drawing().of("flow") == Drawing("euler", STEPS["euler"], 1.0)
    assert Drawing("dpm").of("v") == Drawing("dpm", STEPS["dpm"], 1.0)
    assert Drawing(steps=7, strength=0.4).of("epsilon") == Drawing("ddpm", 7, 0.4)


@pytest.mark.parametrize(
    ("kind", "drawing", "says"),
    [
        ("flow", Drawing("ddim"), "sampler 'ddim': a model of kind 'flow' takes euler"),
        ("v", Drawing("euler"), "sampler 'euler'"),
        ("regression", Drawing("ddpm"), "takes once"),
        ("v", Drawing("ddim", 101), "101 steps.*from 1 to 100"),
        ("flow", Drawing("euler", 1001), "from 1 to 1000"),
        ("regression", Drawing("once", 2), "from 1 to 1$"),
        ("v", Drawing("dpm", -1), "-1 steps"),
        ("v", Drawing(strength=0.0), "strength = 0"),
        ("flow", Drawing(strength=1.2), "strength = 1.2"),
        ("flow", Drawing(strength=float("nan")), "strength = nan"),
    ],
)
def test_what_cannot_be_drawn_is_told(kind: str, drawing: Drawing, says: str) -> None:
    with pytest.raises(InputError, match=says):
        Process(kind).draw(mean_of("v"), noise(), drawing, generators())


def test_an_unknown_kind_is_told() -> None:
    with pytest.raises(InputError, match="'score': must be one of epsilon, v, flow, regression"):
        Process("score")
