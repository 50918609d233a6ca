import numpy as np
import pytest
import torch
from scipy.ndimage import gaussian_filter

from muslin.garments.errors import InputError
from muslin.learn.wrinkles.degrade import PATCH, REACH, Degrading, blurred
from muslin.learn.wrinkles.layout import map_layout

SIZE = 64
MASK = torch.from_numpy(map_layout("tee", SIZE).mask).float()


def maps(seed: int = 0, count: int = 4) -> torch.Tensor:
    """Maps of noise, also where no garment is."""
    return torch.randn((count, 3, SIZE, SIZE), generator=torch.Generator().manual_seed(seed))


def drawn(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


@pytest.mark.parametrize("width", [0.4, 1.0, 2.5, 8.0])
def test_blurring_keeps_constants_over_the_mask(width: float) -> None:
    found = blurred(torch.full((2, 3, SIZE, SIZE), 0.7), MASK, width)
    torch.testing.assert_close(found, 0.7 * MASK.expand(2, 3, -1, -1))


@pytest.mark.parametrize("width", [0.4, 1.0, 2.5])
def test_blurring_is_that_of_scipy_inside(width: float) -> None:
    x = maps()
    found = blurred(x, torch.ones(SIZE, SIZE), width)
    reach = int(REACH * width)
    expected = gaussian_filter(x.numpy(), width, axes=(2, 3), radius=reach)
    inner = slice(reach, SIZE - reach)
    np.testing.assert_allclose(found[..., inner, inner], expected[..., inner, inner], atol=1e-5)


@pytest.mark.parametrize("width", [0.0, 0.3, 1.5, 5.0])
def test_nothing_leaks_in_from_outside_of_the_mask(width: float) -> None:
    x = maps()
    outside = x + 1e3 * (1.0 - MASK)
    torch.testing.assert_close(blurred(outside, MASK, width), blurred(x, MASK, width), atol=1e-5, rtol=0.0)
    assert (blurred(outside, MASK, width)[..., MASK == 0.0] == 0.0).all()


@pytest.mark.parametrize("width", [0.0, 0.3])
def test_a_width_of_nothing_or_of_less_than_a_texel_changes_nothing(width: float) -> None:
    assert torch.equal(blurred(maps(), MASK, width), maps() * MASK)


def test_blurring_stays_between_the_extremes_and_smooths() -> None:
    x = maps()
    found = blurred(x, MASK, 2.0)
    within = x[..., MASK > 0.0]
    assert found.min() >= within.min()
    assert found.max() <= within.max()
    # Means of 4 pi sigma^2 independent values.
    spread = float(found[..., MASK > 0.0].std())
    assert spread == pytest.approx((4.0 * np.pi * 2.0**2) ** -0.5, rel=0.25)


def test_maps_made_worse_are_a_function_of_the_generator() -> None:
    worse = Degrading()
    assert torch.equal(worse(maps(), MASK, drawn(3)), worse(maps(), MASK, drawn(3)))
    assert not torch.equal(worse(maps(), MASK, drawn(3)), worse(maps(), MASK, drawn(4)))
    outside = worse(maps(), MASK, drawn(3))[..., MASK == 0.0]
    assert (outside == 0.0).all()


def test_without_anything_to_do_maps_stay_as_they_are() -> None:
    assert torch.equal(Degrading(0.0, 0.0, 0.0, 0.0)(maps(), MASK, drawn()), maps() * MASK)


def test_colours_are_scaled_and_shifted_a_channel_by_as_much_as_is_said() -> None:
    x = maps(count=600)
    found = Degrading(blur=0.0, colour=0.2, noise=0.0)(x, MASK, drawn())
    inside = MASK > 0.0
    y, before = found[..., inside], x[..., inside]
    centred = before - before.mean(-1, keepdim=True)
    scale = (y * centred).sum(-1) / centred.square().sum(-1)
    offset = y.mean(-1) - scale * before.mean(-1)
    left = y - scale[..., None] * before - offset[..., None]
    assert float(left.abs().max()) < 1e-4
    # Up to 0.2, uniform over maps: a root mean square of 0.2 / sqrt(3), of 600 maps sure to some 4 %.
    assert float(scale.mean()) == pytest.approx(1.0, abs=0.02)
    assert float(scale.std()) == pytest.approx(0.2 / 3.0**0.5, rel=0.12)
    assert float(offset.std()) == pytest.approx(0.2 / 3.0**0.5, rel=0.12)
    assert abs(float(torch.corrcoef(torch.stack([scale.flatten(), offset.flatten()]))[0, 1])) < 0.12


def test_noise_is_smooth_and_up_to_as_large_as_is_said() -> None:
    full = torch.ones(SIZE, SIZE)
    noise = Degrading(blur=0.0, colour=0.0, noise=0.5)(torch.zeros(300, 3, SIZE, SIZE), full, drawn())
    spread = float(noise.std())
    # Over maps as colours; and between the coarse places a cubic takes means of several, which vary less.
    assert 0.8 < spread / (0.5 / 3.0**0.5) < 1.0
    of_maps = noise.square().mean((1, 2, 3)).sqrt()
    assert float(of_maps.min()) < 0.05
    assert 0.4 < float(of_maps.max()) < 0.65
    near = noise[..., 1:] - noise[..., :-1]
    far = noise[..., PATCH + 2 :] - noise[..., : -PATCH - 2]
    assert float(near.std()) < 0.25 * spread
    # Nearly independent: their difference has the variance of two.
    assert float(far.std()) > 1.1 * spread


def test_the_blur_is_drawn_up_to_its_most() -> None:
    """An impulse spreads by the width that was drawn: half of the most on the average."""
    full = torch.ones(SIZE, SIZE)
    impulse = torch.zeros(1, 3, SIZE, SIZE)
    impulse[..., 32, 32] = 1.0
    row = torch.arange(SIZE) - 32.0
    widths = []
    for seed in range(60):
        found = Degrading(blur=0.08, colour=0.0, noise=0.0)(impulse, full, drawn(seed))[0, 0]
        widths.append(float((found.sum(1) * row**2).sum().sqrt()))
    assert max(widths) < 0.08 * SIZE
    assert np.mean(widths) == pytest.approx(0.04 * SIZE, rel=0.25)


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"blur": 0.3}, "blur = 0.3: must be from 0 to 0.25"),
        ({"blur": -0.01}, "blur"),
        ({"colour": 1.5}, "colour = 1.5: must be from 0 to 1"),
        ({"noise": -1.0}, "noise"),
        ({"unknown": 1.01}, "unknown"),
        ({"unknown": float("nan")}, "unknown"),
        ({"conditions": 2.0}, "conditions"),
    ],
)
def test_ranges_are_told(changed: dict[str, float], says: str) -> None:
    with pytest.raises(InputError, match=says):
        Degrading(**changed)
