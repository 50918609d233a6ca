"""A sheet on an incline, with Coulomb friction: whether it slides, and how fast.

On a slope of angle theta it sticks while tan theta <= mu; above, it accelerates by

    a = g (sin theta - mu cos theta).

The threshold is found by bisection. A sheet slides if, a while after it was let go, it is faster than
`still_speed`, which puts the threshold found above the true one by still_speed / (seconds g) at most.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from muslin.eval.validate.case import CaseTable, Count, Outcome, Plot, Row, Series
from muslin.eval.validate.colliders import slope
from muslin.eval.validate.meshes import rectangle
from muslin.eval.validate.world import DOWN, GRAVITY, balance, exact
from muslin.sim.cloth import build_cloth
from muslin.sim.contact.system import ContactSettings
from muslin.sim.material import load_fabric
from muslin.sim.solve.simulator import ClothSimulator
from muslin.sim.tables import Positive

BRACKET = 0.2
"""The threshold is looked for within this share of atan(mu)."""
START_GAP = 0.7
"""Height above the slope from which the sheet is pressed on, in ranges of the barrier."""
PRESSED = 1.0e-5
"""Forces left when it is let go, as a share of its weight."""


class Incline(CaseTable):
    """`frictions` mu; `steeper` angles above the threshold, in thresholds; `held` one below; `dt` and
    `seconds` of a run, s; `still_speed` and `bar_creep` m/s; `halvings` of the bracket."""

    frictions: list[Positive]
    steeper: list[Positive]
    held: Positive
    fabric: str
    side: Positive
    elements: Count
    dt: Positive
    seconds: Positive
    halvings: Count
    still_speed: Positive
    bar_threshold: Positive
    bar_acceleration: Positive
    bar_creep: Positive


@dataclass(frozen=True)
class Slide:
    """Times, s, and mean speed down the slope, m/s."""

    times: NDArray[np.float64]
    speeds: NDArray[np.float64]


def run(p: Incline) -> Outcome:
    """Rows: angle of the threshold, acceleration above it, speed below it."""
    outcome = Outcome()
    series: list[Series] = []
    for mu in p.frictions:
        known = float(np.arctan(mu))
        found = np.degrees(threshold(p, mu))
        row = Row(
            f"incline, mu = {mu:g}: angle at which it slides", found, np.degrees(known), p.bar_threshold
        )
        outcome.rows.append(Row(row.name, row.measured, row.expected, row.bar, unit="degrees"))
        still = slide(p, mu, p.held * known).speeds
        creep = float(np.abs(still[len(still) // 2 :]).mean())
        name = f"incline, mu = {mu:g}, {p.held:g} of that angle: speed"
        outcome.rows.append(Row(name, creep, 0.0, p.bar_creep, "absolute", "m/s"))
        for share in p.steeper:
            angle = share * known
            expected = GRAVITY * (np.sin(angle) - mu * np.cos(angle))
            result = slide(p, mu, angle)
            half = len(result.times) // 2
            found = float(np.polyfit(result.times[half:], result.speeds[half:], 1)[0])
            name = f"incline, mu = {mu:g}, {share:g} of that angle: acceleration"
            outcome.rows.append(Row(name, found, float(expected), p.bar_acceleration, unit="m/s^2"))
            label = f"μ = {mu:g}, {np.degrees(angle):.0f}°"
            t = result.times
            series.append(Series(f"known, {label}", t.tolist(), (expected * t).tolist()))
            series.append(Series(label, t[::4].tolist(), result.speeds[::4].tolist(), "points"))
    outcome.plots = [Plot("Incline: speed of the sliding sheet", "s", "m/s", series)]
    return outcome


def threshold(p: Incline, mu: float) -> float:
    """The angle, radians, below which the sheet stays and above which it slides."""
    low, high = (1.0 - BRACKET) * np.arctan(mu), (1.0 + BRACKET) * np.arctan(mu)
    for _ in range(p.halvings):
        middle = 0.5 * (low + high)
        if slide(p, mu, middle).speeds[-1] > p.still_speed:
            high = middle
        else:
            low = middle
    return float(0.5 * (low + high))


def slide(p: Incline, mu: float, angle: float) -> Slide:
    """Press the sheet on the slope, then let it go."""
    contact = ContactSettings(friction_body=mu, friction_cloth=mu)
    down = np.array([np.cos(angle), -np.sin(angle), 0.0])
    normal = np.array([np.sin(angle), np.cos(angle), 0.0])
    mesh = rectangle(p.side, p.side, p.elements, p.elements, "irregular", p.seed)
    panel = mesh.panel_vertices - 0.5 * p.side
    across = np.array([0.0, 0.0, -1.0])
    places = np.outer(panel[:, 0], down) + np.outer(panel[:, 1], across) + START_GAP * contact.range * normal
    # Large enough that the sheet never comes to an edge.
    ground = slope(angle, 4.0 * (p.side + GRAVITY * p.seconds**2))
    press = -GRAVITY * np.cos(angle) * normal
    sim = ClothSimulator(
        build_cloth(mesh, load_fabric(p.fabric)), places, *ground, contact, exact((*press.tolist(),), 1.0e-7)
    )
    balance(sim, PRESSED, dt=0.2)
    sim.set_gravity(DOWN)
    steps = round(p.seconds / p.dt)
    speeds = np.zeros(steps)
    for k in range(steps):
        sim.advance(None, p.dt)
        speeds[k] = (sim.cloth.mass @ sim.velocity @ down) / sim.cloth.mass.sum()
    return Slide(p.dt * np.arange(1.0, steps + 1.0), speeds)
