"""The tee: seam lengths, stated dimensions, room for the body, smooth corners, over the whole range."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from muslin.garments import catalogue
from muslin.garments.curves import CubicBezier
from muslin.garments.errors import InputError
from muslin.garments.pattern import Pattern

TEE = catalogue.get("tee")
CORNERS = [
    dict(zip(TEE.parameters, values, strict=True))
    for values in itertools.product(*((p.low, p.high) for p in TEE.parameters.values()))
]
RANDOM = [
    {p.name: float(rng.uniform(p.low, p.high)) for p in TEE.parameters.values()}
    for rng in map(np.random.default_rng, range(12))
]
MEMBERS = [*CORNERS, *RANDOM, *(TEE.preset(name) for name in TEE.presets)]


@pytest.fixture(params=MEMBERS, ids=range(len(MEMBERS)))
def member(request: pytest.FixtureRequest) -> tuple[dict[str, float], Pattern]:
    return request.param, TEE.pattern(**request.param)


def length(pattern: Pattern, panel: str, edge: str) -> float:
    return pattern.panel(panel).edge(edge).curve.length


def test_is_sound_and_every_seam_matches(member: tuple[dict[str, float], Pattern]) -> None:
    _, pattern = member
    pattern.validate()
    for seam in pattern.seams:
        assert pattern.edge(seam.first).curve.length == pytest.approx(
            pattern.edge(seam.second).curve.length, abs=1e-9
        )


def test_has_the_dimensions_that_its_parameters_state(member: tuple[dict[str, float], Pattern]) -> None:
    p, pattern = member
    front, back, sleeve = pattern.panel("front"), pattern.panel("back"), pattern.panel("sleeve_left")
    chest = 0.0
    for panel in (front, back):
        left, right = panel.edge("side_left").curve, panel.edge("side_right").curve
        ends = [left.start, left.end, right.start, right.end]
        top = sorted(ends, key=lambda point: point[1])[-2:]
        chest += abs(top[0][0] - top[1][0])
        assert panel.edge("hem").curve.at(0.5) == pytest.approx([0.0, -p["garment_length"]], abs=1e-12)
    assert chest == pytest.approx(p["chest_circumference"], abs=1e-12)
    assert front.edge("neck").curve.at(0.5) == pytest.approx([0.0, -p["neckline_depth"]], abs=1e-12)
    assert sleeve.edge("cap_back").curve.end == (0.0, 0.0)
    assert sleeve.edge("cuff").curve.at(0.5)[1] == pytest.approx(-p["sleeve_length"], abs=1e-12)


def test_leaves_room_for_the_body(member: tuple[dict[str, float], Pattern]) -> None:
    _, pattern = member
    sleeve = pattern.panel("sleeve_left")
    bicep = sleeve.edge("cap_back").curve.start[0] - sleeve.edge("cap_front").curve.end[0]
    assert 0.36 <= bicep <= 0.55
    assert length(pattern, "sleeve_left", "cuff") >= 0.20
    assert length(pattern, "sleeve_left", "underarm_back") >= 0.03
    assert length(pattern, "front", "neck") + length(pattern, "back", "neck") >= 0.44
    assert 0.10 <= length(pattern, "front", "shoulder_left") <= 0.17
    side = pattern.panel("front").edge("side_left").curve
    below = (0.60 + side.end[1]) / (side.end[1] - side.start[1])
    if below <= 1.0:
        hips = 4.0 * (side.end[0] + below * (side.start[0] - side.end[0]))
        assert hips >= 1.085


def test_lies_flat_around_shoulder_tip_and_underarm_point(member: tuple[dict[str, float], Pattern]) -> None:
    """The panel angles at these sewn vertices sum to about 2 pi: no cone point that would stick out."""
    _, pattern = member

    def angle(panel: str, before: str, after: str) -> float:
        first, second = pattern.panel(panel).edge(before).curve, pattern.panel(panel).edge(after).curve
        u = np.subtract(first.at(1.0 - 1e-6), first.end)
        v = np.subtract(second.at(1e-6), second.start)
        return float(np.arccos(u @ v / np.linalg.norm(u) / np.linalg.norm(v)))

    tip = angle("front", "armhole_left", "shoulder_left") + angle("back", "shoulder_left", "armhole_left")
    tip += angle("sleeve_left", "cap_back", "cap_front")
    assert np.degrees(tip) == pytest.approx(360.0, abs=0.1)
    underarm = angle("front", "side_left", "armhole_left") + angle("back", "armhole_left", "side_left")
    underarm += angle("sleeve_left", "underarm_back", "cap_back")
    underarm += angle("sleeve_left", "cap_front", "underarm_front")
    assert np.degrees(underarm) == pytest.approx(360.0, abs=40.0)


def test_hem_meets_the_side_seams_squarely(member: tuple[dict[str, float], Pattern]) -> None:
    _, pattern = member
    hem, side = pattern.panel("front").edge("hem").curve, pattern.panel("front").edge("side_left").curve
    assert isinstance(hem, CubicBezier)
    assert hem.derivative(1.0) @ np.subtract(side.end, side.start) == pytest.approx(0.0, abs=1e-12)


def test_left_and_right_are_mirror_images(member: tuple[dict[str, float], Pattern]) -> None:
    _, pattern = member
    for panel, part in itertools.product(("front", "back"), ("side", "armhole", "shoulder")):
        edges = [pattern.panel(panel).edge(f"{part}_{side}").curve for side in ("left", "right")]
        assert edges[0].mirrored() == edges[1] or edges[1].mirrored() == edges[0]
    for part in ("underarm_front", "cap_front", "cap_back"):
        left, right = (pattern.panel(f"sleeve_{side}").edge(part).curve for side in ("left", "right"))
        np.testing.assert_allclose(left.mirrored().at([0, 0.3, 1]), right.at([0, 0.3, 1]), atol=1e-15)


def test_dresses_flare_and_shirts_hardly_do() -> None:
    def flare(preset: str) -> float:
        pattern = TEE.pattern(**TEE.preset(preset))
        return 2.0 * length(pattern, "front", "hem") - TEE.preset(preset)["chest_circumference"]

    assert 0.0 < flare("tshirt") < 0.10
    assert flare("tshirt") < flare("short_dress") < flare("long_dress")
    assert 2.0 * length(TEE.pattern(**TEE.preset("long_dress")), "front", "hem") > 1.6


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"sleeve_lenght": 0.2}, r"no parameter 'sleeve_lenght'; allowed: sleeve_length, chest"),
        ({"sleeve_length": 0.9}, r"sleeve_length = 0\.9 is out of range; allowed: 0\.1 to 0\.62 m"),
        ({"garment_length": float("nan")}, r"garment_length = nan is out of range"),
        ({"neckline_depth": float("-inf")}, r"neckline_depth = -inf is out of range"),
        ({"neckline_depth": "deep"}, r"neckline_depth = deep is out of range; allowed: 0\.06 to 0\.16 m"),
    ],
)
def test_wrong_parameters_name_key_value_and_range(parameters: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        TEE.pattern(**parameters)


def test_catalogue_refuses_unknown_names() -> None:
    assert "tee" in catalogue.names()
    with pytest.raises(InputError, match=r"no design 'trousers'; allowed: .*tee"):
        catalogue.get("trousers")
    with pytest.raises(InputError, match="no preset 'gown'; allowed: top, tshirt, sweater"):
        TEE.preset("gown")


def test_defaults_and_references_lie_in_their_ranges() -> None:
    for name in catalogue.names():
        design = catalogue.get(name)
        assert design.complete(design.reference) == design.reference
        for parameter in design.parameters.values():
            assert parameter.low < parameter.default < parameter.high
        for preset in design.presets:
            design.pattern(**design.preset(preset)).validate()
