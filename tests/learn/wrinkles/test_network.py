import json
from dataclasses import asdict, replace

import pytest
import torch

from muslin.garments.errors import InputError
from muslin.learn.wrinkles.fields import FIELDS
from muslin.learn.wrinkles.layout import map_layout
from muslin.learn.wrinkles.network import FURTHEST, NARROWEST, SIZES, NetworkConfig, Seen, WrinkleNetwork

CONDITIONS, COUNT = 5, 3


def config(size: str = "tiny", texels: int = 64, previous: bool = True) -> NetworkConfig:
    return NetworkConfig("tee", texels, CONDITIONS, FIELDS, previous, **SIZES[size])  # type: ignore[arg-type]


def network(previous: bool = True) -> WrinkleNetwork:
    torch.manual_seed(0)
    return WrinkleNetwork(config(previous=previous)).eval()


def noise(*shape: int, seed: int = 0) -> torch.Tensor:
    return torch.randn(shape, generator=torch.Generator().manual_seed(seed))


def told(own: WrinkleNetwork, known: float = 1.0) -> tuple[torch.Tensor, torch.Tensor, Seen]:
    """x, t and what is seen, of COUNT frames."""
    side = own.config.side
    return (
        noise(COUNT, 3, 64, 64),
        torch.tensor([3.0, 400.0, 990.0]),
        Seen(
            noise(COUNT, CONDITIONS, seed=1),
            noise(COUNT, own.config.fields, side, side, seed=2),
            noise(COUNT, 3, 64, 64, seed=3),
            torch.full((COUNT,), known),
        ),
    )


@torch.no_grad()
def test_maps_are_zero_outside_of_the_mask() -> None:
    own = network()
    out = own(*told(own))
    mask = torch.from_numpy(map_layout("tee", 64).mask)
    assert out.shape == (COUNT, 3, 64, 64)
    assert (out[..., ~mask] == 0.0).all()
    assert (out[..., mask] != 0.0).float().mean() > 0.99


@torch.no_grad()
def test_what_is_not_known_of_the_frame_before_makes_no_difference() -> None:
    own = network()
    x, t, seen = told(own)
    other = replace(seen, previous=noise(COUNT, 3, 64, 64, seed=9))
    mixed = torch.tensor([0.0, 1.0, 0.0])
    one, two = (own(x, t, replace(sight, known=mixed)) for sight in (seen, other))
    assert torch.equal(one[mixed == 0.0], two[mixed == 0.0])
    assert float((one[1] - two[1]).abs().max()) > 1e-3
    # Whether it is known is told too: a map of zeros is not the same as none.
    nothing = replace(seen, previous=torch.zeros_like(seen.previous))
    apart = own(x, t, nothing) - own(x, t, replace(nothing, known=torch.zeros(COUNT)))
    assert float(apart.abs().max()) > 1e-3


@torch.no_grad()
def test_a_network_of_single_frames_does_not_look_at_the_frame_before() -> None:
    own = network(previous=False)
    x, t, seen = told(own)
    other = replace(seen, previous=noise(COUNT, 3, 64, 64, seed=9), known=torch.zeros(COUNT))
    assert torch.equal(own(x, t, seen), own(x, t, other))


@torch.no_grad()
@pytest.mark.parametrize("what", ["x", "t", "conditions", "fields", "previous"])
def test_all_that_is_told_makes_a_difference_and_to_its_own_frame_alone(what: str) -> None:
    own = network()
    x, t, seen = told(own)
    before = own(x, t, seen)
    if what == "x":
        x = x.clone()
        x[1] += 0.5
    elif what == "t":
        t = torch.tensor([3.0, 500.0, 990.0])
    else:
        value = getattr(seen, what).clone()
        value[1] += 0.5
        seen = replace(seen, **{what: value})
    apart = (own(x, t, seen) - before).abs().flatten(1).amax(1)
    assert apart[1] > 1e-4
    # What is summed up together with others may round another way.
    assert max(apart[0], apart[2]) < 1e-5


@torch.no_grad()
def test_conditions_are_told_over_their_spread_and_cut_where_none_was_seen() -> None:
    own = network()
    seen_before = noise(200, CONDITIONS, seed=4) * torch.tensor([5.0, 1.0, 0.5, 0.01, 0.0]) + 2.0
    own.normalise(seen_before, 0.02)
    assert float(own.spread) == pytest.approx(0.02)
    torch.testing.assert_close(own.centre, seen_before.mean(0))
    assert own.width[:3].tolist() == pytest.approx(seen_before.std(0, correction=0)[:3].tolist())
    # What hardly varied is not blown up.
    assert own.width[3:].tolist() == pytest.approx([NARROWEST, NARROWEST])
    x, t, seen = told(own)

    def at(spreads: float) -> torch.Tensor:
        return own(x, t, replace(seen, conditions=(own.centre + spreads * own.width).expand(COUNT, -1)))

    torch.testing.assert_close(at(10.0), at(FURTHEST), atol=1e-5, rtol=0.0)
    torch.testing.assert_close(at(-1e4), at(-FURTHEST), atol=1e-5, rtol=0.0)
    assert float((at(0.9 * FURTHEST) - at(FURTHEST)).abs().max()) > 1e-4


@pytest.mark.parametrize("previous", [False, True])
def test_the_gradient_reaches_every_parameter(previous: bool) -> None:
    own = network(previous)
    own(*told(own)).square().sum().backward()
    for name, weight in own.named_parameters():
        assert weight.grad is not None, name
        assert float(weight.grad.abs().max()) > 0.0, name


def test_places_of_the_layout_are_told_apart() -> None:
    """Of the same nothing everywhere, the network says other things in other places."""
    own = network()
    x, t, seen = told(own, known=0.0)
    with torch.no_grad():
        out = own(torch.zeros_like(x), t, replace(seen, fields=torch.zeros_like(seen.fields)))
    # Patches that lie in the mask as a whole, so that what differs is not their shape.
    whole = torch.from_numpy(map_layout("tee", 64).mask).unfold(0, 4, 4).unfold(1, 4, 4).all(-1).all(-1)
    patches = out[0].unfold(1, 4, 4).unfold(2, 4, 4)[:, whole]
    assert float(patches.std(dim=1).mean()) > 1e-3


@pytest.mark.parametrize(
    ("size", "texels", "millions"),
    [("tiny", 64, 0.36), ("small", 128, 3.7), ("medium", 128, 7.7), ("thesis", 128, 113.9)],
)
def test_sizes_have_as_many_weights_as_is_said(size: str, texels: int, millions: float) -> None:
    with torch.device("meta"):
        own = WrinkleNetwork(config(size, texels))
    assert sum(weight.numel() for weight in own.parameters()) == pytest.approx(1e6 * millions, rel=0.05)


@pytest.mark.parametrize("size", ["tiny", "small", "medium"])
def test_networks_of_all_sizes_draw(size: str) -> None:
    own = WrinkleNetwork(config(size)).eval()
    with torch.no_grad():
        assert own(*told(own)).isfinite().all()


@pytest.mark.parametrize(
    ("size", "texels", "step"), [("tiny", 60, 8), ("small", 72, 16), ("medium", 120, 16), ("thesis", 112, 32)]
)
def test_maps_that_do_not_divide_into_patches_and_levels_are_told(size: str, texels: int, step: int) -> None:
    with pytest.raises(InputError, match=f"maps of {texels} texels: .* need a multiple of {step}"):
        config(size, texels)


def test_a_configuration_comes_back_from_json() -> None:
    for size in SIZES:
        own = config(size, 128, previous=False)
        assert NetworkConfig.from_json(json.loads(json.dumps(asdict(own)))) == own
