"""A heavy strip without stiffness to bending, hung by both ends: the catenary.

With span D and length L > D, the lowest point at s = 0,

    x = a asinh(s / a),   y = sqrt(a^2 + s^2) - a,   2 a sinh(D / (2 a)) = L.

The strip of the simulation is stiff enough to lengthen little: by sigma g L / (E h) at most.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from muslin.eval.validate.case import Outcome, Plot, Row, Series
from muslin.eval.validate.meshes import Triangulation
from muslin.eval.validate.strip import Strip
from muslin.eval.validate.world import DOWN, alone, equilibrium, exact
from muslin.sim.cloth import build_cloth
from muslin.sim.material import isotropic_fabric
from muslin.sim.tables import Positive


class Catenary(Strip):
    """`spans` D / L; `young` Pa; `bar` as a share of the span."""

    spans: list[Positive]
    young: Positive


def run(p: Catenary) -> Outcome:
    """Rows: sag, and the largest distance of a vertex from its place on the catenary, in spans."""
    outcome = Outcome()
    series: list[Series] = []
    for span in p.spans:
        x, y = catenary(np.linspace(-0.5, 0.5, 80), span)
        series.append(Series(f"catenary, D = {span:g} L", x.tolist(), y.tolist()))
        for kind in p.triangulations:
            s, found = simulate(p, span, kind)
            x, y = catenary(s, span)
            name = f"catenary, span {span:g} of the length, {kind}"
            sag = float(catenary(np.array([0.5]), span)[1][0] - catenary(np.zeros(1), span)[1][0])
            lowest = float(-found[:, 1].min())
            outcome.rows.append(Row(f"{name}: sag/span", lowest / span, sag / span, p.bar, "absolute"))
            away = float(np.hypot(found[:, 0] - x, found[:, 1] - y).max() / span)
            outcome.rows.append(Row(f"{name}: largest distance/span", away, 0.0, p.bar, "absolute"))
            order = np.argsort(s)
            at = found[order]
            series.append(Series(f"{kind}, {span:g}", at[:, 0].tolist(), at[:, 1].tolist(), "points"))
    outcome.plots = [Plot("Catenary, in lengths of the strip", "x / L", "y / L", series, same_scale=True)]
    return outcome


def catenary(s: NDArray[np.float64], span: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """x and y at arc lengths s from the middle; all in lengths of the strip, the ends at y = 0."""
    a = brentq(lambda a: 2.0 * a * np.sinh(span / (2.0 * a)) - 1.0, 1.0e-2 * span, 1.0e3 * span)
    return a * np.arcsinh(s / a), np.sqrt(a**2 + s**2) - np.sqrt(a**2 + 0.25)


def arc(s: NDArray[np.float64], span: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The circular arc of the same length and span that hangs down; where the simulation starts."""
    half = brentq(lambda half: np.sin(half) / half - span, 1.0e-6, np.pi)
    radius, turn = 0.5 / half, 2.0 * half * s
    return radius * np.sin(turn), radius * (np.cos(half) - np.cos(turn))


def simulate(
    p: Catenary, span: float, kind: Triangulation
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Arc length of every vertex from the middle and its place (V, 2), in lengths of the strip."""
    mesh = p.mesh(kind)
    s = mesh.panel_vertices[:, 1] / p.length - 0.5
    x, y = arc(s, span)
    start = np.stack([x * p.length, y * p.length, -mesh.panel_vertices[:, 0]], axis=1)
    cloth = build_cloth(mesh, isotropic_fabric(p.young, 0.0, p.thickness, p.density))
    sim = alone(cloth, start, exact(DOWN))
    sim.pins[:] = np.abs(s) == 0.5
    equilibrium(sim, 1.0e-6 * p.length)
    return s, sim.positions[:, :2] / p.length
