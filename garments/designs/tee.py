"""The tee family: tops, t-shirts, sweaters, short and long dresses from one layout with set-in sleeves.

Panel frames (metres). front: x = world x, y = height above the high point of the shoulder (HPS). back: x =
-world x (seen from behind), same y. Sleeves: y from cuff to shoulder, cap top at the origin, x = 0 along the
top of the arm; +x lies at the wearer's back on sleeve_left, at the wearer's front on sleeve_right.

Construction of the half front, wearer's left (x > 0):

    N = (n, 0)                          neck point, n half the neck width
    T = N + l (cos a, -sin a)           shoulder tip, l the shoulder length, a the shoulder slope
    U = (chest / 4, -d)                 underarm point, d the armhole depth
    H = U + drop (f, -1)                hem at the side seam, f the flare (tangent of its angle)

The armhole leaves T at a right angle to the shoulder seam and reaches U level, the sleeve cap is level at its
top and at its ends: around T and U the sewn panels lie flat, without a cone point. The half widths of the
sleeve are solved so that each half of the cap is as long as the armhole it is sewn into.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from scipy.optimize import brentq

from muslin.garments.curves import CubicBezier, Line, Point
from muslin.garments.design import Design, Parameter
from muslin.garments.panels import Panel, PanelEdge
from muslin.garments.pattern import Pattern
from muslin.garments.seams import EdgeRef, Seam

NECK_HALF_WIDTH = 0.0975
BACK_NECK_DROP = 0.022
SHOULDER_SLOPE = math.radians(20.0)
BASE_CHEST = 1.04  # chest circumference at which the lengths below hold
SHOULDER_LENGTH, SHOULDER_GRADE = 0.130, 0.12  # at the base chest; growth per metre of chest
ARMHOLE_DEPTH, ARMHOLE_GRADE = 0.235, 0.08
FRONT_SCOOP, BACK_SCOOP = 0.62, 0.50  # how far the armhole follows the shoulder's normal, share of its height
CAP_HEIGHT, CAP_GRADE = 0.110, 0.15  # of a long sleeve, for an arm raised some 35 degrees
LEAST_UNDERARM = 0.03  # underarm seam that the shortest sleeve keeps
SLEEVE_TAPER = 0.8  # share of its half width that the sleeve loses per metre of underarm length
HIP_CIRCUMFERENCE, HIP_DROP = 1.09, 0.60  # to be cleared; height of the hips below HPS
SKIRT_FLARE = 0.13
SKIRT_START, SKIRT_FULL = 0.65, 1.05  # garment lengths between which the flare comes in

PARAMETERS = {
    parameter.name: parameter
    for parameter in (
        Parameter("sleeve_length", 0.10, 0.62, 0.22, "m", "shoulder tip to cuff along the top of the sleeve"),
        Parameter("chest_circumference", 0.90, 1.30, 1.04, "m", "around the whole garment under the arms"),
        Parameter("garment_length", 0.48, 1.30, 0.64, "m", "high point of the shoulder to hem"),
        Parameter("neckline_depth", 0.06, 0.16, 0.09, "m", "high point of the shoulder to front neckline"),
    )
}

PRESETS = {
    "top": {
        "sleeve_length": 0.11,
        "chest_circumference": 0.98,
        "garment_length": 0.55,
        "neckline_depth": 0.14,
    },
    "tshirt": {},
    "sweater": {
        "sleeve_length": 0.58,
        "chest_circumference": 1.12,
        "garment_length": 0.66,
        "neckline_depth": 0.08,
    },
    "short_dress": {
        "sleeve_length": 0.18,
        "chest_circumference": 1.02,
        "garment_length": 0.90,
        "neckline_depth": 0.11,
    },
    "long_dress": {
        "sleeve_length": 0.30,
        "chest_circumference": 1.02,
        "garment_length": 1.22,
        "neckline_depth": 0.10,
    },
}

REFERENCE = {
    "sleeve_length": 0.28,
    "chest_circumference": 1.08,
    "garment_length": 0.76,
    "neckline_depth": 0.10,
}


def draw(p: Mapping[str, float]) -> Pattern:
    """The pattern of the tee with parameters p (metres); all seam lengths match to rounding."""
    chest = p["chest_circumference"]
    front = _body_panel("front", p, p["neckline_depth"], FRONT_SCOOP, "left")
    back = _body_panel("back", p, BACK_NECK_DROP, BACK_SCOOP, "right")
    armhole_front = front.edge("armhole_left").curve.length
    armhole_back = back.edge("armhole_left").curve.length
    height = _cap_height(p["sleeve_length"], chest)
    half_front, half_back = _cap_half_width(height, armhole_front), _cap_half_width(height, armhole_back)
    sleeve_left = _sleeve(
        "sleeve_left", p["sleeve_length"], height, ("back", half_back), ("front", half_front)
    )
    sleeve_right = _sleeve(
        "sleeve_right", p["sleeve_length"], height, ("front", half_front), ("back", half_back)
    )
    return Pattern("tee", (front, back, sleeve_left, sleeve_right), _seams(), dict(p))


def flare(chest: float, garment_length: float) -> float:
    """Tangent of the angle of the side seam to the vertical.

    Enough to clear the hips, plus a skirt's flare that comes in smoothly as the garment becomes a dress.
    """
    needed = (HIP_CIRCUMFERENCE - chest) / 4.0 / (HIP_DROP - armhole_depth(chest))
    to_clear_hips = 0.5 * (needed + math.hypot(needed, 0.04))  # smooth max(needed, 0)
    t = min(max((garment_length - SKIRT_START) / (SKIRT_FULL - SKIRT_START), 0.0), 1.0)
    return to_clear_hips + SKIRT_FLARE * t * t * (3.0 - 2.0 * t)


def armhole_depth(chest: float) -> float:
    """Height of HPS above the underarm point, metres."""
    return ARMHOLE_DEPTH + ARMHOLE_GRADE * (chest - BASE_CHEST)


def _body_panel(
    name: str, p: Mapping[str, float], neck_drop: float, scoop: float, positive_side: str
) -> Panel:
    """Front or back; `positive_side` is the wearer's side ("left", "right") that lies at x > 0."""
    chest, length = p["chest_circumference"], p["garment_length"]
    sin, cos, tan = math.sin(SHOULDER_SLOPE), math.cos(SHOULDER_SLOPE), math.tan(SHOULDER_SLOPE)
    shoulder = SHOULDER_LENGTH + SHOULDER_GRADE * (chest - BASE_CHEST)
    neck: Point = (NECK_HALF_WIDTH, 0.0)
    tip: Point = (NECK_HALF_WIDTH + shoulder * cos, -shoulder * sin)
    underarm: Point = (chest / 4.0, -armhole_depth(chest))

    slope = flare(chest, length)
    hem, hem_curve = _hem(underarm, slope, length)

    handle = scoop * (tip[1] - underarm[1])
    reach = 0.9 * (underarm[0] - (tip[0] - handle * sin))
    armhole = CubicBezier(
        underarm, (underarm[0] - reach, underarm[1]), (tip[0] - handle * sin, tip[1] - handle * cos), tip
    )
    # A symmetric cubic passes its centre at 3/4 of the height of its control points.
    low = 4.0 / 3.0 * neck_drop
    neckline = CubicBezier(neck, (neck[0] - low * tan, -low), (-neck[0] + low * tan, -low), _mirror(neck))
    half = (("side", Line(hem, underarm)), ("armhole", armhole), ("shoulder", Line(tip, neck)))
    other = "right" if positive_side == "left" else "left"
    return Panel(
        name,
        (
            PanelEdge("hem", hem_curve),
            *(PanelEdge(f"{part}_{positive_side}", curve) for part, curve in half),
            PanelEdge("neck", neckline),
            *(PanelEdge(f"{part}_{other}", curve.mirrored()) for part, curve in reversed(half)),
        ),
    )


def _hem(underarm: Point, slope: float, length: float) -> tuple[Point, CubicBezier]:
    """Hem point at x > 0 and the hem: an arc, lowest at (0, -length), square to both side seams.

    An arc about the point where the side seams would meet hangs level. Radius R and half angle phi =
    atan(slope); the cubic through both ends has handles (4/3) tan(phi / 2) R.
    """
    phi = math.atan(slope)
    apex = underarm[1] + underarm[0] / slope
    radius = apex + length
    x, y = radius * math.sin(phi), apex - radius * math.cos(phi)
    handle = 4.0 / 3.0 * math.tan(phi / 2.0) * radius
    inner = (x - handle * math.cos(phi), y - handle * math.sin(phi))
    return (x, y), CubicBezier((-x, y), _mirror(inner), inner, (x, y))


def _cap_height(sleeve_length: float, chest: float) -> float:
    """Height of the sleeve cap, smooth in the sleeve length and always shorter than it, metres."""
    full = CAP_HEIGHT + CAP_GRADE * (chest - BASE_CHEST)
    return full * math.tanh((sleeve_length - LEAST_UNDERARM) / full)


def _cap(half_width: float, height: float) -> CubicBezier:
    """Half of the sleeve cap, from its end at (half_width, -height) to its top, level at both."""
    return CubicBezier(
        (half_width, -height), (0.62 * half_width, -height), (0.42 * half_width, 0.0), (0.0, 0.0)
    )


def _cap_half_width(height: float, armhole: float) -> float:
    """Half width for which half the cap is as long as the armhole; the length grows with the width."""
    return brentq(lambda w: _cap(w, height).length - armhole, 0.01, armhole, xtol=1e-15, rtol=1e-15)


def _sleeve(
    name: str, length: float, height: float, positive: tuple[str, float], negative: tuple[str, float]
) -> Panel:
    """Sleeve whose half at x > 0 is `positive` (side, half width), at x < 0 `negative`."""
    (right, w_right), (left, w_left) = positive, negative
    narrowing = SLEEVE_TAPER * 0.5 * (w_right + w_left) * (length - height)
    cuff_right, cuff_left = (w_right - narrowing, -length), (-(w_left - narrowing), -length)
    cap_right, cap_left = _cap(w_right, height), _cap(w_left, height).mirrored()
    return Panel(
        name,
        (
            PanelEdge("cuff", Line(cuff_left, cuff_right)),
            PanelEdge(f"underarm_{right}", Line(cuff_right, cap_right.start)),
            PanelEdge(f"cap_{right}", cap_right),
            PanelEdge(f"cap_{left}", cap_left),
            PanelEdge(f"underarm_{left}", Line(cap_left.end, cuff_left)),
        ),
    )


def _seams() -> tuple[Seam, ...]:
    seams = []
    for side in ("left", "right"):
        sleeve = f"sleeve_{side}"
        seams += [
            Seam(EdgeRef("front", f"shoulder_{side}"), EdgeRef("back", f"shoulder_{side}")),
            Seam(EdgeRef("front", f"side_{side}"), EdgeRef("back", f"side_{side}")),
            Seam(EdgeRef("front", f"armhole_{side}"), EdgeRef(sleeve, "cap_front")),
            Seam(EdgeRef("back", f"armhole_{side}"), EdgeRef(sleeve, "cap_back")),
            Seam(EdgeRef(sleeve, "underarm_front"), EdgeRef(sleeve, "underarm_back")),
        ]
    return tuple(seams)


def _mirror(point: Point) -> Point:
    return (-point[0], point[1])


TEE = Design("tee", PARAMETERS, draw, REFERENCE, PRESETS)
