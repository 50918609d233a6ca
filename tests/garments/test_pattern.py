"""Panels and patterns: areas, and one clear error for each way to get them wrong."""

from __future__ import annotations

import math

import pytest

from muslin.garments.curves import CubicBezier, Line, Point
from muslin.garments.errors import InputError
from muslin.garments.panels import Panel, PanelEdge
from muslin.garments.pattern import Pattern
from muslin.garments.seams import EdgeRef, Seam


def polygon(name: str, *points: Point) -> Panel:
    """Panel with straight edges e0, e1, ..."""
    ends = points[1:] + points[:1]
    return Panel(
        name, tuple(PanelEdge(f"e{i}", Line(a, b)) for i, (a, b) in enumerate(zip(points, ends, strict=True)))
    )


SQUARE = polygon("square", (0, 0), (1, 0), (1, 1), (0, 1))
OTHER = polygon("other", (0, 0), (2, 0), (2, 1), (0, 1))


def test_area_of_a_square_and_of_a_disc() -> None:
    assert SQUARE.area == pytest.approx(1.0, abs=1e-15)
    k = 4.0 / 3.0 * math.tan(math.pi / 8.0)
    corners = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]
    edges = []
    for i, (x, y) in enumerate(corners):
        u, v = corners[(i + 1) % 4]
        edges.append(
            PanelEdge(f"q{i}", CubicBezier((x, y), (x - k * y, y + k * x), (u + k * v, v - k * u), (u, v)))
        )
    disc = Panel("disc", tuple(edges))
    disc.validate()
    # Four cubic arcs leave the unit circle by at most 2.7e-4, always outwards.
    assert math.pi < disc.area < math.pi * (1 + 2.7e-4) ** 2


def test_sound_pattern_passes_and_lists_its_free_edges() -> None:
    pattern = Pattern("two", (SQUARE, OTHER), (Seam(EdgeRef("square", "e1"), EdgeRef("other", "e3")),))
    pattern.validate()
    assert pattern.area == pytest.approx(3.0)
    assert [str(ref) for ref in pattern.free_edges] == [
        "square.e0", "square.e2", "square.e3", "other.e0", "other.e1", "other.e2",
    ]  # fmt: skip


def seamed(first: str, second: str) -> Pattern:
    return Pattern("two", (SQUARE, OTHER), (Seam(EdgeRef(*first.split(".")), EdgeRef(*second.split("."))),))


def one(panel: Panel) -> Pattern:
    return Pattern("p", (panel,), ())


@pytest.mark.parametrize(
    ("pattern", "message"),
    [
        (seamed("square.e0", "other.e0"), r"square\.e0 is 1\.0.* other\.e0 is 2\.0"),
        (seamed("square.e0", "other.waist"), r"no edge 'waist'; its edges are: e0, e1"),
        (seamed("square.e0", "skirt.e0"), r"no panel 'skirt'; its panels are: square, other"),
        (seamed("square.e0", "square.e0"), r"square\.e0 is sewn twice"),
        (Pattern("none", (), ()), r"no panels"),
        (Pattern("twice", (SQUARE, SQUARE), ()), r"panel 'square' twice"),
        (one(polygon("cw", (0, 0), (0, 1), (1, 1), (1, 0))), r"signed area -1 .*counter-clockwise"),
        (one(polygon("nan", (0, 0), (1, math.nan), (1, 1))), r"'nan', edge 'e0'.*NaN"),
        (one(polygon("inf", (0, 0), (math.inf, 0), (1, 1))), r"infinite"),
        (one(polygon("dot", (0, 0), (0, 0), (1, 1))), r"length 0 m"),
        (one(polygon("bow", (0, 0), (1, 1), (2, 0), (2, 1), (1, 0.4), (0, 1))), r"crosses itself"),
        (one(Panel("one", SQUARE.edges[:1])), r"needs at least 2"),
        (one(Panel("gap", SQUARE.edges[:3])), r"ends 1 m from the start of 'e0'"),
        (one(Panel("names", (*SQUARE.edges[:3], PanelEdge("e0", SQUARE.edges[3].curve)))), r"'e0' twice"),
    ],
)  # fmt: skip
def test_unsound_patterns_are_refused(pattern: Pattern, message: str) -> None:
    with pytest.raises(InputError, match=message):
        pattern.validate()
