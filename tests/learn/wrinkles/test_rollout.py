from pathlib import Path

import numpy as np
import pytest
import torch

from muslin.garments.errors import InputError
from muslin.learn.drape.mean import MeanDrape
from muslin.learn.wrinkles.clips import Told
from muslin.learn.wrinkles.condition import Condition
from muslin.learn.wrinkles.fields import FIELDS
from muslin.learn.wrinkles.layout import map_layout
from muslin.learn.wrinkles.model import WRINKLES, WrinkleModel, holds_wrinkles, load_wrinkles
from muslin.learn.wrinkles.network import SIZES, NetworkConfig, Seen, WrinkleNetwork
from muslin.learn.wrinkles.process import Drawing, Process
from muslin.learn.wrinkles.rollout import Noise, roll_out
from muslin.learn.wrinkles.world import SequenceWorld
from muslin.sim.body.load import load_body
from tests.learn.wrinkles.worn import FPS

SIZE, CONDITIONS, SPREAD = 64, 5, 0.02
COUNT = map_layout("tee", SIZE).count
NAMES = ("sleeve_length", "garment_length")


def network(previous: bool, conditions: int = CONDITIONS) -> WrinkleNetwork:
    torch.manual_seed(0)
    own = WrinkleNetwork(
        NetworkConfig("tee", SIZE, conditions, FIELDS, previous, **SIZES["tiny"])  # type: ignore[arg-type]
    )
    own.normalise(torch.randn(50, conditions), SPREAD)
    return own.eval()


def told(frames: int, seed: int = 0) -> Told:
    draw = np.random.default_rng(seed)
    side = SIZE // 4
    return Told(
        draw.standard_normal((frames, CONDITIONS)).astype(np.float32),
        draw.standard_normal((frames, FIELDS, side, side)).astype(np.float32),
    )


def still(frames: int) -> Told:
    one = told(1)
    return Told(one.conditions.repeat(frames, 0), one.fields.repeat(frames, 0))


def rolled(
    own: WrinkleNetwork,
    sequences: list[Told],
    *,
    drawing: Drawing | None = None,
    kind: str = "flow",
    seed: int = 0,
    noise: Noise = "fixed",
    batch: int = 16,
) -> list[np.ndarray]:
    usual = drawing or Drawing(steps=2 if kind == "flow" else 3)
    return roll_out(own, Process(kind), sequences, usual, seed=seed, noise=noise, batch=batch)


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """The largest difference, in spreads."""
    return float(np.abs(one - other).max()) / SPREAD


@pytest.mark.parametrize("previous", [False, True])
def test_sequences_of_all_lengths_get_a_map_for_every_frame(previous: bool) -> None:
    maps = rolled(network(previous), [told(3), told(1, 1), told(4, 2)])
    assert [own.shape for own in maps] == [(3, COUNT, 3), (1, COUNT, 3), (4, COUNT, 3)]
    for own in maps:
        assert own.dtype == np.float32
        assert (own != 0.0).mean() > 0.99


@pytest.mark.parametrize("kind", ["v", "flow", "regression"])
@pytest.mark.parametrize("previous", [False, True])
def test_neither_company_nor_batches_make_a_difference(previous: bool, kind: str) -> None:
    own, drawing = network(previous), Drawing(steps=1 if kind == "regression" else 3)
    sequences = [told(2), told(4, 1), told(3, 2)]
    together = rolled(own, sequences, kind=kind, drawing=drawing)
    turned = rolled(own, sequences[::-1], kind=kind, drawing=drawing)[::-1]
    pairs = rolled(own, sequences, kind=kind, drawing=drawing, batch=2)
    alone = [rolled(own, [one], kind=kind, drawing=drawing, batch=1)[0] for one in sequences]
    for others in (turned, pairs, alone):
        for one, other in zip(together, others, strict=True):
            assert apart(one, other) < 1e-5


@pytest.mark.parametrize("kind", ["v", "flow"])
def test_fixed_noise_keeps_still_what_stands_still_and_fresh_noise_does_not(kind: str) -> None:
    own = network(previous=False)
    (fixed,) = rolled(own, [still(3)], kind=kind, noise="fixed")
    (fresh,) = rolled(own, [still(3)], kind=kind, noise="fresh")
    assert apart(fixed[0], fixed[1]) < 1e-5
    assert apart(fixed[0], fixed[2]) < 1e-5
    assert apart(fresh[0], fresh[1]) > 0.1
    assert apart(fresh[1], fresh[2]) > 0.1
    # The first frame is the same with either.
    assert apart(fixed[0], fresh[0]) < 1e-5


@pytest.mark.parametrize("kind", ["v", "flow"])
def test_another_seed_draws_other_maps_and_the_same_seed_the_same(kind: str) -> None:
    own = network(previous=True)
    (one,), (again,), (other,) = (rolled(own, [told(2)], kind=kind, seed=seed) for seed in (3, 3, 4))
    assert np.array_equal(one, again)
    assert apart(one[0], other[0]) > 0.1


def test_regression_knows_no_seed() -> None:
    own, drawing = network(previous=True), Drawing()
    (one,), (other,) = (
        rolled(own, [told(2)], kind="regression", drawing=drawing, seed=seed) for seed in (3, 4)
    )
    assert np.array_equal(one, other)


def test_only_a_temporal_network_remembers_the_frame_before() -> None:
    before, after = told(3), told(3)
    after.conditions[0] += 1.0
    for previous in (False, True):
        own = network(previous)
        (one,), (other,) = rolled(own, [before]), rolled(own, [after])
        assert apart(one[0], other[0]) > 1e-3
        # What comes later is told the same; only by way of the map before can it know.
        assert (apart(one[1], other[1]) > 1e-4) == previous
        assert (apart(one[2], other[2]) > 1e-6) == previous


def test_the_first_frame_knows_of_no_frame_before() -> None:
    own = network(previous=True)
    (long,), (short,) = (
        rolled(own, [told(3)]),
        rolled(own, [Told(told(3).conditions[1:], told(3).fields[1:])]),
    )
    # The frame that is second in one and first in the other is told the same but for that.
    assert apart(long[1], short[0]) > 1e-3


def test_less_strength_draws_frames_that_are_nearer_to_the_ones_before() -> None:
    """With a network that says half of what it is given, what differs is what there was of noise."""

    class Half(WrinkleNetwork):
        def forward(self, x: torch.Tensor, t: torch.Tensor, seen: Seen) -> torch.Tensor:
            return 0.5 * x * self.mask

    own = Half(network(previous=True).config)
    steps = [
        float(
            np.diff(
                rolled(own, [still(4)], drawing=Drawing(steps=4, strength=s), noise="fresh")[0], axis=0
            ).std()
        )
        for s in (1.0, 0.5, 0.1)
    ]
    assert steps[0] > steps[1] > steps[2]


def model(names: tuple[str, ...] = NAMES) -> WrinkleModel:
    condition = Condition(2, names)
    templates = MeanDrape("tee", names, 403)
    with torch.no_grad():
        templates.mean.normal_(generator=torch.Generator().manual_seed(0))
    world = SequenceWorld("tee", "female", load_body("female").digest, ("gray-interlock", "denim"), FPS)
    own = network(True, condition.count)
    own.normalise(torch.randn(50, condition.count), 0.0123)
    return WrinkleModel(world, templates, condition, Process("v"), own)


def test_a_model_comes_back_as_it_was_saved(tmp_path: Path) -> None:
    own = model()
    assert not holds_wrinkles(tmp_path)
    own.save(tmp_path)
    assert holds_wrinkles(tmp_path)
    again = load_wrinkles(tmp_path)
    assert (again.world, again.condition, again.process.kind) == (own.world, own.condition, "v")
    assert again.network.config == own.network.config
    assert (again.templates.design, again.templates.names, again.templates.resolution) == ("tee", NAMES, 403)
    for before, after in ((own.network, again.network), (own.templates, again.templates)):
        assert before.state_dict().keys() == after.state_dict().keys()
        for name, value in before.state_dict().items():
            assert torch.equal(value, after.state_dict()[name]), name
    side = again.network.config.side
    seen = Told(np.ones((2, own.condition.count), np.float32), np.zeros((2, FIELDS, side, side), np.float32))
    own.drawing = again.drawing = Drawing("ddim", 2)
    assert np.array_equal(own.maps([seen])[0], again.maps([seen])[0])


def test_half_the_bits_say_nearly_the_same(tmp_path: Path) -> None:
    own = model()
    own.save(tmp_path / "whole")
    own.save(tmp_path / "half", torch.bfloat16)
    whole, half = (tmp_path / name / WRINKLES for name in ("whole", "half"))
    assert half.stat().st_size < 0.6 * whole.stat().st_size
    again = load_wrinkles(tmp_path / "half")
    for name, value in own.network.state_dict().items():
        kept = again.network.state_dict()[name]
        assert kept.dtype == torch.float32
        # bfloat16 has 8 bits; what conditions and maps are measured by is kept whole.
        exact = value.ndim <= 1
        torch.testing.assert_close(kept, value, rtol=0.0 if exact else 2.0**-8, atol=0.0)


def test_what_holds_no_model_or_a_damaged_one_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no model of animated garments"):
        load_wrinkles(tmp_path)
    model().save(tmp_path)
    file = tmp_path / WRINKLES
    file.write_bytes(file.read_bytes()[:-9])
    with pytest.raises(InputError, match="not readable"):
        load_wrinkles(tmp_path)
