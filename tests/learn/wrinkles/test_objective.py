from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from muslin.garments.errors import InputError
from muslin.learn.wrinkles.clips import Clip, Told
from muslin.learn.wrinkles.degrade import MOST_OWN, Degrading
from muslin.learn.wrinkles.layout import map_layout
from muslin.learn.wrinkles.network import Seen
from muslin.learn.wrinkles.objective import Batch, Frames, WrinkleObjective
from muslin.learn.wrinkles.process import FLOW_NOISES, Process

SIZE, SPREAD = 32, 0.02
LAYOUT = map_layout("tee", SIZE)
MASK = torch.from_numpy(LAYOUT.mask).float()
LENGTHS = (5, 1, 4)
CLEAN = Degrading(blur=0.0, colour=0.0, noise=0.0, unknown=0.0, conditions=0.0, own=0)


def clip(number: int, frames: int) -> Clip:
    """Of a frame its number, `number` and a half, and so on, in every value of its map and its condition."""
    values = number + np.arange(frames, dtype=np.float32) / 10.0
    maps = SPREAD * values[:, None, None] * np.ones((1, LAYOUT.count, 3), np.float32)
    fields = values[:, None, None, None] * np.ones((1, 2, 8, 8), np.float32)
    return Clip(f"clip-{number}", maps, Told(values[:, None] * np.ones((1, 4), np.float32), fields))


CLIPS = [clip(k, frames) for k, frames in enumerate(LENGTHS)]
VALUES = [k + t / 10.0 for k, frames in enumerate(LENGTHS) for t in range(frames)]


def objective(
    degrading: Degrading = CLEAN, kind: str = "regression", temporal: bool = True
) -> WrinkleObjective:
    return WrinkleObjective(
        {"train": CLIPS}, LAYOUT, SPREAD, Process(kind), degrading, batch=4, seed=3, temporal=temporal
    )


class AddsOne(nn.Module):
    """Says the map before plus one, and a thousand where none is known; remembers what it saw."""

    def __init__(self) -> None:
        super().__init__()
        self.unused = nn.Parameter(torch.zeros(()))
        self.asked: list[tuple[Tensor, Tensor, Seen]] = []

    def forward(self, x: Tensor, t: Tensor, seen: Seen) -> Tensor:
        self.asked.append((x, t, seen))
        known = seen.known[:, None, None, None]
        said: Tensor = (known * (seen.previous + 1.0) + (1.0 - known) * 1000.0) * MASK
        return said + 0.0 * self.unused


def loss_of(own: WrinkleObjective, model: nn.Module, batch: Batch) -> float:
    return own.loss(model, batch).item()


def level(maps: Tensor) -> list[float]:
    """The value of every map, the same in all texels of the mask."""
    inside = maps[..., MASK > 0]
    assert float((inside - inside[:, :1, :1]).abs().max()) < 1e-4
    return [round(float(own), 3) for own in inside[:, 0, 0]]


def test_frames_come_with_what_is_seen_of_them() -> None:
    frames = Frames(CLIPS, LAYOUT, SPREAD)
    assert len(frames) == sum(LENGTHS)
    maps, seen = frames.read(range(len(frames)))
    assert level(maps) == pytest.approx(VALUES)
    np.testing.assert_allclose(seen.conditions[:, 0], VALUES)
    np.testing.assert_allclose(seen.fields[:, 1, 2, 3], VALUES)
    first = [t == 0 for length in LENGTHS for t in range(length)]
    assert seen.known.tolist() == [float(not own) for own in first]
    before = [value - 0.1 * (not own) for value, own in zip(VALUES, first, strict=True)]
    assert level(seen.previous) == pytest.approx(before)


@pytest.mark.parametrize("earlier", [1, 2, 7])
def test_earlier_frames_are_of_the_same_sequence(earlier: int) -> None:
    frames = Frames(CLIPS, LAYOUT, SPREAD)
    maps, seen = frames.read(range(len(frames)), earlier)
    expected = [k + max(t - earlier, 0) / 10.0 for k, length in enumerate(LENGTHS) for t in range(length)]
    assert level(maps) == pytest.approx(expected)
    known = [float(t - earlier > 0) for length in LENGTHS for t in range(length)]
    assert seen.known.tolist() == known


def test_the_loss_is_the_mean_square_over_texels_of_the_mask() -> None:
    own, model = objective(), AddsOne()
    # Frames 1 to 4 of the first sequence, whose maps before are 0.1 less: it says 0.9 too much.
    batch = own.batch([1, 2, 3, 4], torch.Generator().manual_seed(0))
    assert loss_of(own, model, batch) == pytest.approx(0.81, rel=1e-4)
    # Of the second and the third it knows none: it says 999 and 998 too much.
    batch = own.batch([5, 6], torch.Generator().manual_seed(0))
    assert loss_of(own, model, batch) == pytest.approx((999.0**2 + 998.0**2) / 2, rel=1e-4)


@pytest.mark.parametrize("kind", ["flow", "v", "epsilon"])
def test_losses_are_weighted_as_the_process_does(kind: str) -> None:
    own, model = objective(kind=kind), AddsOne()
    batch = own.batch([1, 2, 3, 4], torch.Generator().manual_seed(1))
    weight = Process(kind).weight(batch.t)
    assert loss_of(own, model, batch) == pytest.approx(0.81 * float(weight.mean()), rel=1e-4)
    x, t, _ = model.asked[0]
    assert torch.equal(t, batch.t)
    torch.testing.assert_close(x, Process(kind).noisy(batch.target, batch.noise, batch.t))


def batch_with_own(own: WrinkleObjective, places: list[int], count: int) -> tuple[AddsOne, Batch]:
    """A model that was asked about a batch with as many leading frames, and the batch."""
    for seed in range(200):
        batch = own.batch(places, torch.Generator().manual_seed(seed))
        if len(batch.leading) == count:
            model = AddsOne()
            own.loss(model, batch)
            return model, batch
    raise AssertionError(f"no batch with {count} leading frames")


@pytest.mark.parametrize("count", [1, 2, 3, 4])
@pytest.mark.parametrize("kind", ["regression", "flow", "v"])
def test_the_frame_before_is_the_networks_own_map(kind: str, count: int) -> None:
    """A truth, then one more in every frame that leads: what the rollout would give."""
    own = objective(replace(CLEAN, own=4), kind)
    model, _ = batch_with_own(own, [4], count)
    assert len(model.asked) == count + 1
    start = 0.4 - 0.1 * (count + 1)
    for k, (_, _, seen) in enumerate(model.asked):
        # In the first frame, to which three lead back, none is known before, and it is said to be a thousand.
        expected = start + k if count < 4 else 999.0 + k
        if k > 0 or count < 4:
            assert level(seen.previous) == pytest.approx([expected], abs=2e-3)
        assert float(seen.conditions[0, 0]) == pytest.approx(0.4 - 0.1 * (count - k))
    if kind == "flow":
        for x, t, _ in model.asked[:-1]:
            assert float(t) == FLOW_NOISES
            assert torch.equal(x, model.asked[0][0])


def test_sequences_begin_from_nothing_whatever_leads_to_them() -> None:
    own = objective(replace(CLEAN, own=3))
    model, _ = batch_with_own(own, [0, 1, 5, 7], 3)
    known = [seen.known.tolist() for _, _, seen in model.asked]
    assert known == [[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0], [0, 1, 0, 1]]
    # Second frames see what was said of first ones.
    assert level(model.asked[-1][2].previous)[1] == pytest.approx(1000.0)
    assert level(model.asked[-1][2].previous)[3] == pytest.approx(1000.0)


def test_no_gradient_goes_through_the_maps_that_lead() -> None:
    class Scales(nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.factor = nn.Parameter(torch.tensor(2.0))

        def forward(self, x: Tensor, t: Tensor, seen: Seen) -> Tensor:
            return self.factor * seen.previous

    own, model = objective(replace(CLEAN, own=1)), Scales()
    for seed in range(100):
        batch = own.batch([2, 3, 4], torch.Generator().manual_seed(seed))
        if batch.leading:
            break
    own.loss(model, batch).backward()
    # What is said is f (2 a), a the truth of two frames before; the derivative of the last f alone counts.
    truth, before = np.array([0.2, 0.3, 0.4]), np.array([0.0, 0.1, 0.2])
    expected = np.mean(2.0 * (4.0 * before - truth) * 2.0 * before)
    assert float(model.factor.grad) == pytest.approx(expected, rel=1e-4)


def test_all_numbers_of_leading_frames_are_as_likely() -> None:
    own = objective(replace(CLEAN, own=2))
    counts = np.bincount(
        [len(own.batch([3], torch.Generator().manual_seed(seed)).leading) for seed in range(600)]
    )
    # A third of them each, 200, is sure to 12.
    assert len(counts) == 3
    assert np.abs(counts - 200).max() < 50


def test_networks_that_see_no_frame_before_are_led_nowhere() -> None:
    own = objective(replace(CLEAN, own=3), temporal=False)
    assert not any(own.batch([3, 4], torch.Generator().manual_seed(seed)).leading for seed in range(20))


def test_batches_are_functions_of_the_epoch() -> None:
    own = objective(Degrading(), "flow")
    one, again, other = (list(own.batches(epoch, 0, 1)) for epoch in (2, 2, 3))
    assert len(one) == own.steps() == sum(LENGTHS) // 4
    for a, b in zip(one, again, strict=True):
        assert torch.equal(a.x, b.x)
        assert torch.equal(a.seen.previous, b.seen.previous)
        assert len(a.leading) == len(b.leading)
        model = AddsOne()
        assert torch.equal(own.loss(model, a), own.loss(model, b))
    assert any(not torch.equal(a.x, b.x) for a, b in zip(one, other, strict=True))


def test_conditions_are_off_by_as_much_in_all_frames_that_lead() -> None:
    own = objective(replace(CLEAN, own=2, conditions=0.5))
    _, batch = batch_with_own(own, [3, 4], 2)
    off = [
        seen.conditions - torch.tensor([0.3, 0.4])[:, None] + 0.1 * (2 - k)
        for k, seen in enumerate((*batch.leading, batch.seen))
    ]
    assert float(off[0].abs().max()) > 0.01
    for one in off[1:]:
        torch.testing.assert_close(one, off[0], atol=1e-5, rtol=0.0)


@pytest.mark.parametrize("count", [-1, MOST_OWN + 1])
def test_numbers_of_leading_frames_out_of_range_are_told(count: int) -> None:
    with pytest.raises(InputError, match=f"own = {count}"):
        Degrading(own=count)
