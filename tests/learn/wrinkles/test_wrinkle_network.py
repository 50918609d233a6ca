"""The network of displacement maps, what it sees of the frame before, sequences, and its files."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.ndimage import gaussian_filter

from muslin.garments.errors import InputError
from muslin.learn.drape.mean import MeanDrape
from muslin.learn.training.machine import count_weights
from muslin.learn.wrinkles.clips import Told
from muslin.learn.wrinkles.condition import Condition
from muslin.learn.wrinkles.degrade import REACH, Degrading, blurred
from muslin.learn.wrinkles.layout import map_layout
from muslin.learn.wrinkles.model import WRINKLES, WrinkleModel, load_wrinkles
from muslin.learn.wrinkles.network import FURTHEST, SIZES, NetworkConfig, Seen, WrinkleNetwork
from muslin.learn.wrinkles.process import Drawing, Process
from muslin.learn.wrinkles.rollout import roll_out
from muslin.learn.wrinkles.world import SequenceWorld
from muslin.sim.body.load import load_body

CONDITION = Condition(1, ("garment_length", "sleeve_length"))
SIZE, SIDE, FIELDS = 64, 16, 12
MASK = torch.from_numpy(map_layout("tee", SIZE).mask).float()


def small(previous: bool = True, seed: int = 0) -> WrinkleNetwork:
    torch.manual_seed(seed)
    config = NetworkConfig("tee", SIZE, CONDITION.count, FIELDS, previous, **SIZES["tiny"])  # type: ignore[arg-type]
    return WrinkleNetwork(config).eval()


def seen(count: int, seed: int = 0) -> Seen:
    made = torch.Generator().manual_seed(seed)
    return Seen(
        torch.randn(count, CONDITION.count, generator=made),
        torch.randn(count, FIELDS, SIDE, SIDE, generator=made),
        torch.randn(count, 3, SIZE, SIZE, generator=made) * MASK,
        torch.ones(count),
    )


def told(frames: int, seed: int = 0) -> Told:
    made = np.random.default_rng(seed)
    return Told(
        made.normal(size=(frames, CONDITION.count)).astype(np.float32),
        made.normal(size=(frames, FIELDS, SIDE, SIDE)).astype(np.float32),
    )


@pytest.mark.parametrize(
    ("name", "millions"), [("tiny", 0.36), ("small", 3.7), ("medium", 7.7), ("thesis", 113.9)]
)
def test_sizes(name: str, millions: float) -> None:
    with torch.device("meta"):
        config = NetworkConfig("tee", 128, 165, 0, True, **SIZES[name])  # type: ignore[arg-type]
        network = WrinkleNetwork(config)
    assert count_weights([network]) / 1e6 == pytest.approx(millions, rel=0.02)


def test_nothing_is_drawn_outside_of_the_mask() -> None:
    with torch.no_grad():
        out = small()(torch.randn(2, 3, SIZE, SIZE), torch.tensor([0.0, 500.0]), seen(2))
    assert not out[:, :, MASK == 0].any()
    assert out[:, :, MASK == 1].abs().min() > 0.0


def test_a_map_before_counts_where_it_is_known() -> None:
    network, x, t = small(), torch.randn(2, 3, SIZE, SIZE), torch.zeros(2)
    first = seen(2)
    other = replace(first, previous=torch.flip(first.previous, (0,)), known=torch.tensor([1.0, 0.0]))
    unknown = replace(first, known=torch.tensor([1.0, 0.0]))
    with torch.no_grad():
        a, b = network(x, t, unknown), network(x, t, other)
    assert (a[0] - b[0]).abs().max() > 1e-4
    torch.testing.assert_close(a[1], b[1])


def test_all_that_is_seen_matters_and_all_weights_learn() -> None:
    network, x, t = small(), torch.randn(1, 3, SIZE, SIZE), torch.tensor([300.0])
    base, other = seen(1), seen(1, 1)
    out = network(x, t, base)
    for changed in (replace(base, conditions=other.conditions), replace(base, fields=other.fields)):
        assert (network(x, t, changed) - out).abs().max() > 1e-4
    assert (network(x, t + 300.0, base) - out).abs().max() > 1e-4
    out.square().sum().backward()
    assert all(weight.grad is not None and weight.grad.any() for weight in network.parameters())


def test_conditions_are_cut_where_none_was_seen() -> None:
    network, x, t = small(), torch.randn(1, 3, SIZE, SIZE), torch.zeros(1)
    known = 5.0 + 2.0 * torch.randn(100, CONDITION.count)
    network.normalise(known, 0.02)
    edge = known.mean(0) + FURTHEST * known.std(0, correction=0)
    base = seen(1)
    with torch.no_grad():
        found = [
            network(x, t, replace(base, conditions=own[None]))
            for own in (edge, edge + 100.0, edge - 0.5 * known.std(0))
        ]
    torch.testing.assert_close(found[0], found[1], atol=1e-4, rtol=1e-4)
    assert (found[0] - found[2]).abs().max() > 1e-4
    assert float(network.spread) == pytest.approx(0.02)


def test_configs() -> None:
    config = NetworkConfig("tee", 128, 10, 12, True, **SIZES["thesis"])  # type: ignore[arg-type]
    assert NetworkConfig.from_json(json.loads(json.dumps(asdict(config)))) == config
    with pytest.raises(InputError, match="multiple of 16"):
        NetworkConfig("tee", 72, 10, 12, True)


def test_blurring_is_a_mean_over_the_mask() -> None:
    maps = torch.randn(2, 3, SIZE, SIZE)
    torch.testing.assert_close(blurred(torch.ones(1, 3, SIZE, SIZE), MASK, 2.0)[0, 0], MASK)
    torch.testing.assert_close(blurred(maps, MASK, 0.0), maps * MASK)
    outside = maps + 100.0 * (1.0 - MASK)
    torch.testing.assert_close(blurred(outside, MASK, 2.0), blurred(maps, MASK, 2.0), atol=1e-4, rtol=1e-4)
    width = 2.0
    full = blurred(maps, torch.ones(SIZE, SIZE), width)[0, 0].numpy()
    expected = gaussian_filter(maps[0, 0].double().numpy(), width, truncate=REACH)
    inner = slice(8, -8)
    np.testing.assert_allclose(full[inner, inner], expected[inner, inner], atol=1e-5)


def test_worse_maps_are_a_function_of_the_generator_and_of_the_size_that_is_said() -> None:
    maps = torch.zeros(200, 3, SIZE, SIZE)
    worse = Degrading(blur=0.0, colour=0.0, noise=0.3)

    def made(how: Degrading, seed: int = 0) -> torch.Tensor:
        return how(maps, MASK, torch.Generator().manual_seed(seed))

    assert torch.equal(made(worse), made(worse))
    assert not torch.equal(made(worse), made(worse, 1))
    assert not made(worse)[..., MASK == 0].any()
    # Interpolation between independent numbers loses some of their spread.
    assert 0.15 < float(made(worse)[..., MASK == 1].std()) < 0.35
    shifted = made(Degrading(blur=0.0, colour=0.2, noise=0.0))[..., MASK == 1]
    assert float(shifted.std(-1).max()) < 1e-6
    assert float(shifted.mean(-1).std()) == pytest.approx(0.2, rel=0.1)
    with pytest.raises(InputError, match=r"blur = 0\.5"):
        Degrading(blur=0.5)


@pytest.mark.parametrize("previous", [False, True])
def test_sequences_do_not_depend_on_which_go_together(previous: bool) -> None:
    network, process = small(previous), Process("flow")
    clips = [told(3, 1), told(5, 2), told(1, 3)]
    together = roll_out(network, process, clips, Drawing(), noise="fresh")
    assert [len(maps) for maps in together] == [3, 5, 1]
    for clip, maps in zip(clips, together, strict=True):
        (alone,) = roll_out(network, process, [clip], Drawing(), noise="fresh", batch=2)
        np.testing.assert_allclose(alone, maps, atol=1e-5)
    assert np.abs(roll_out(network, process, clips, Drawing(), seed=1)[1] - together[1]).max() > 1e-4


def test_frames_follow_from_the_frame_before() -> None:
    process, first = Process("flow"), told(2)
    other = Told(first.conditions.copy(), first.fields)
    other.conditions[0] += 1.0
    for previous in (True, False):
        (a,), (b,) = (roll_out(small(previous), process, [clip], Drawing()) for clip in (first, other))
        assert np.abs(a[0] - b[0]).max() > 1e-4
        assert (np.abs(a[1] - b[1]).max() > 1e-5) == previous


def test_noise_is_fixed_or_fresh() -> None:
    network, one = small(False), told(1)
    still = Told(np.repeat(one.conditions, 3, axis=0), np.repeat(one.fields, 3, axis=0))
    (fixed,) = roll_out(network, Process("v"), [still], Drawing("ddim", 2), noise="fixed")
    (fresh,) = roll_out(network, Process("v"), [still], Drawing("ddim", 2), noise="fresh")
    np.testing.assert_allclose(fixed[1:], fixed[:-1], atol=1e-6)
    assert np.abs(fresh[1] - fresh[0]).max() > 1e-4


def test_models_are_stored_and_loaded(tmp_path: Path) -> None:
    body = load_body("female")
    world = SequenceWorld("tee", "female", body.digest, ("gray-interlock",), 30.0)
    templates = MeanDrape("tee", list(CONDITION.names), 403)
    model = WrinkleModel(world, templates, CONDITION, Process("v"), small())
    model.network.normalise(torch.randn(10, CONDITION.count), 0.03)
    clip = told(2)
    (expected,) = model.maps([clip])
    model.save(tmp_path / "whole")
    model.save(tmp_path / "half", torch.bfloat16)
    whole, half = load_wrinkles(tmp_path / "whole"), load_wrinkles(tmp_path / "half")
    assert (whole.world, whole.condition, whole.process.kind) == (world, CONDITION, "v")
    np.testing.assert_array_equal(whole.maps([clip])[0], expected)
    np.testing.assert_allclose(half.maps([clip])[0], expected, atol=0.05 * np.abs(expected).max())
    sizes = [(tmp_path / name / WRINKLES).stat().st_size for name in ("whole", "half")]
    assert sizes[1] < 0.55 * sizes[0]
    with pytest.raises(InputError, match="holds no model of animated garments"):
        load_wrinkles(tmp_path)
