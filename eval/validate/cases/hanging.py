"""A strip that hangs from one end and stretches under its own weight.

St. Venant-Kirchhoff along the strip, Poisson ratio 0: second Piola-Kirchhoff stress S = E h (lambda^2 - 1) /
2, tension per width of the unstretched strip P = lambda S. At arc length s from the top all below has to be
carried,

    E h lambda (lambda^2 - 1) / 2 = sigma g (L - s),

and since ds = -dP / (sigma g), the depth of a point is a polynomial of its stretch:

    y(s) = int_0^s lambda ds = E h / (2 sigma g) [3/4 lambda^4 - 1/2 lambda^2] between s and 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.eval.validate.case import Outcome, Plot, Row, Series
from muslin.eval.validate.meshes import Triangulation
from muslin.eval.validate.strip import Strip
from muslin.eval.validate.world import DOWN, GRAVITY, alone, equilibrium, exact
from muslin.sim.cloth import build_cloth
from muslin.sim.material import isotropic_fabric
from muslin.sim.tables import Positive


class Hanging(Strip):
    """`loads`: sigma g L / (E h), the weight over the stiffness."""

    loads: list[Positive]


def run(p: Hanging) -> Outcome:
    """Rows: lengthening of the strip, and the largest error of any vertex's depth as a share of it."""
    outcome = Outcome()
    series: list[Series] = []
    for load in p.loads:
        s = np.linspace(0.0, 1.0, 60)
        series.append(Series(f"known, {load:g}", s.tolist(), (depth(s, load) - s).tolist()))
        for kind in p.triangulations:
            at, down = simulate(p, load, kind)
            known = depth(at, load)
            lengthening = float(known[at == 1.0].mean() - 1.0)
            name = f"hanging strip, sigma g L/(E h) = {load:g}, {kind}"
            found = float(down[at == 1.0].mean() - 1.0)
            outcome.rows.append(Row(f"{name}: lengthening", found, lengthening, p.bar))
            error = float(np.abs(down - known).max() / lengthening)
            outcome.rows.append(Row(f"{name}: largest error over lengthening", error, 0.0, p.bar, "absolute"))
            series.append(Series(f"{kind}, {load:g}", at.tolist(), (down - at).tolist(), "points"))
    outcome.plots = [Plot("Hanging strip: displacement", "s / L", "displacement / L", series)]
    return outcome


def stretch(tension: NDArray[np.float64]) -> NDArray[np.float64]:
    """The root above 1 of lambda (lambda^2 - 1) / 2 = `tension` >= 0, in units of E h (Cardano)."""
    c = np.sqrt(27.0) * tension
    angle = np.where(
        c < 1.0, np.cos(np.arccos(np.minimum(c, 1.0)) / 3.0), np.cosh(np.arccosh(np.maximum(c, 1.0)) / 3.0)
    )
    return 2.0 / np.sqrt(3.0) * angle


def depth(s: NDArray[np.float64], load: float) -> NDArray[np.float64]:
    """Depth below the top, in lengths of the strip, of the points at arc length s in [0, 1]."""

    def primitive(stretched: NDArray[np.float64]) -> NDArray[np.float64]:
        return (0.75 * stretched**4 - 0.5 * stretched**2) / (2.0 * load)

    return primitive(stretch(np.array(load))) - primitive(stretch(load * (1.0 - s)))


def simulate(p: Hanging, load: float, kind: Triangulation) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Arc length and depth of every vertex, in lengths of the strip."""
    young = p.density * GRAVITY * p.length / (load * p.thickness)
    mesh = p.mesh(kind)
    s = 1.0 - mesh.panel_vertices[:, 1] / p.length
    start = np.stack([mesh.panel_vertices[:, 0], -s * p.length, np.zeros(len(s))], axis=1)
    cloth = build_cloth(mesh, isotropic_fabric(young, 0.0, p.thickness, p.density))
    sim = alone(cloth, start, exact(DOWN))
    sim.pins[:] = s == 0.0
    equilibrium(sim, 1.0e-7 * p.length)
    return s, -sim.positions[:, 1] / p.length
