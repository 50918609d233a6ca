"""A strip that bends under its own weight, against the heavy elastica.

Its shape depends on one number, Gamma = sigma g L^3 / B: area density sigma, rigidity B = E h^3 / 12 (Poisson
ratio 0, so that a strip of any width bends as a beam). The clamp is made by symmetry: a strip of length 2 L
and its mirror image, held along the line between them, which stays level there. A clamp of held rows would
itself bend over half an element.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from muslin.eval.validate.case import Outcome, Plot, Row, Series
from muslin.eval.validate.elastica import heavy_elastica
from muslin.eval.validate.meshes import Triangulation, mirrored
from muslin.eval.validate.strip import Strip
from muslin.eval.validate.world import DOWN, GRAVITY, alone, equilibrium, exact, level
from muslin.sim.cloth import build_cloth
from muslin.sim.material import isotropic_fabric
from muslin.sim.tables import Positive


class Cantilever(Strip):
    """`numbers`: Gamma; `length` is L, of one arm."""

    numbers: list[Positive]


def run(p: Cantilever) -> Outcome:
    """Rows: drop of the tip over its reach, for each number and triangulation."""
    outcome = Outcome()
    shapes: list[Series] = []
    ratios: dict[str, list[float]] = {kind: [] for kind in p.triangulations}
    for number in p.numbers:
        known = heavy_elastica(number)
        shapes.append(Series(f"elastica, {number:g}", known.x.tolist(), (-known.y).tolist()))
        for kind in p.triangulations:
            x, y = simulate(p, number, kind)
            ratios[kind].append(float(-y[-1] / x[-1]))
            name = f"cantilever, sigma g L^3/B = {number:g}, {kind}: tip drop/reach"
            outcome.rows.append(Row(name, ratios[kind][-1], known.ratio, p.bar))
            if kind == p.triangulations[-1]:
                shapes.append(Series(f"{kind}, {number:g}", x.tolist(), y.tolist(), "points"))
    grid = np.geomspace(0.5 * min(p.numbers), 2.0 * max(p.numbers), 25)
    curve = Series("elastica", grid.tolist(), [heavy_elastica(float(g)).ratio for g in grid])
    points = partial(Series, style="points")
    outcome.plots = [
        Plot(
            "Cantilever: drop of the tip over its reach",
            "σ g L³ / B",
            "drop / reach",
            [curve, *(points(kind, p.numbers, ratios[kind]) for kind in p.triangulations)],
            log_x=True,
            log_y=True,
        ),
        Plot("Cantilever: shapes, in lengths of the strip", "x / L", "y / L", shapes, same_scale=True),
    ]
    return outcome


def simulate(
    p: Cantilever, number: float, kind: Triangulation
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mid line of the bent strip, from clamp to tip: reach and height in lengths of the strip, of both arms
    and of all vertices of a cell along."""
    rigidity = p.density * GRAVITY * p.length**3 / number
    young = 12.0 * rigidity / p.thickness**3
    fabric = isotropic_fabric(young, 0.0, p.thickness, p.density)
    mesh = mirrored(p.mesh(kind))
    along = np.abs(mesh.panel_vertices[:, 1])
    sim = alone(build_cloth(mesh, fabric), level(mesh.panel_vertices), exact(DOWN))
    sim.pins[:] = along == 0.0
    equilibrium(sim, 1.0e-6 * p.length)
    reach, height = np.abs(sim.positions[:, 2]) / p.length, sim.positions[:, 1] / p.length
    cell = np.round(along / p.length * p.elements).astype(int)
    count = np.bincount(cell)
    ends = np.flatnonzero(along == p.length)
    x, y = np.bincount(cell, reach) / count, np.bincount(cell, height) / count
    x[-1], y[-1] = reach[ends].mean(), height[ends].mean()
    return x, y
