"""The sheet: one rectangular panel, for drapes over simple shapes and for tests."""

from __future__ import annotations

from collections.abc import Mapping

from muslin.garments.curves import Line
from muslin.garments.design import Design, Parameter
from muslin.garments.panels import Panel, PanelEdge
from muslin.garments.pattern import Pattern

PARAMETERS = {
    parameter.name: parameter
    for parameter in (
        Parameter("width", 0.05, 5.0, 1.0, "m", "extent along the weft"),
        Parameter("length", 0.05, 5.0, 1.0, "m", "extent along the warp"),
    )
}


def draw(p: Mapping[str, float]) -> Pattern:
    """A rectangle centred on the origin, warp along y."""
    x, y = 0.5 * p["width"], 0.5 * p["length"]
    corners = ((-x, -y), (x, -y), (x, y), (-x, y))
    names = ("bottom", "right", "top", "left")
    edges = tuple(PanelEdge(name, Line(corners[k], corners[(k + 1) % 4])) for k, name in enumerate(names))
    return Pattern("sheet", (Panel("sheet", edges),), (), dict(p))


SHEET = Design("sheet", PARAMETERS, draw, {"width": 1.0, "length": 1.0})
