"""The ten measured fabrics pulled along warp, weft and 45 degrees, against the table they come from.

A patch is stretched along one direction d and kept as wide as it was: G = g d d^T, g = (lambda^2 - 1) / 2.
All its vertices are held, since some fabrics would rather be strained unevenly at their table's far end. The
stress along d, in the table's terms (see the head of the file), with c = c_rest + 6 (lambda - 1) (c_strained
- c_rest) up to lambda = 7/6 and negative coefficients read as zero:

    warp: 2 c11 g,   weft: 2 c22 g,   45 degrees: (c11 + 2 c12 + c22 + c33) g / 2.

Source: Wang, O'Brien and Ramamoorthi 2011, "Data-driven elastic models for cloth".
"""

from __future__ import annotations

import tomllib
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from muslin.eval.validate.case import CaseTable, Count, Outcome, Plot, Row, Series
from muslin.eval.validate.patch import pull
from muslin.sim.material import load_fabric
from muslin.sim.tables import Positive

DIRECTIONS = {"warp": (0.0, 0), "45 degrees": (45.0, 2), "weft": (90.0, 4)}
"""Angle to the warp, degrees, and the row of `stretch_strained` measured there."""
MEASURED_TO = 1.0 / 6.0


class Fabrics(CaseTable):
    """`fabrics` by name, or "all"; `stretches` lambda - 1; `side` m of the patch."""

    fabrics: list[str]
    stretches: list[Positive]
    side: Positive
    elements: Count
    bar: Positive


def run(p: Fabrics) -> Outcome:
    """Rows: for each fabric and direction the stress at the stretch where it is furthest from the table."""
    outcome = Outcome()
    table = measured_table()
    for name in sorted(table) if p.fabrics == ["all"] else p.fabrics:
        series = []
        for direction, (degrees, _) in DIRECTIONS.items():
            found = [simulate(p, name, degrees, e) for e in p.stretches]
            known = [known_stress(table[name], direction, e) for e in p.stretches]
            worst = int(np.argmax(np.abs(np.array(found) / known - 1.0)))
            row = (
                f"{name}, {direction}: stress at stretch {p.stretches[worst]:.4g}, the worst of {len(found)}"
            )
            outcome.rows.append(Row(row, found[worst], known[worst], p.bar, unit="N/m"))
            grid = np.linspace(0.0, max(p.stretches), 40)
            curve = [known_stress(table[name], direction, e) for e in grid]
            series.append(Series(f"{direction}, table", grid.tolist(), curve))
            series.append(Series(direction, p.stretches, found, "points"))
        outcome.plots.append(Plot(f"{name}: stress along the pull", "stretch - 1", "N/m", series))
    return outcome


def measured_table() -> dict[str, dict[str, Any]]:
    """The file of the measurements, as it is."""
    file = resources.files("muslin.sim").joinpath("assets/wang2011_fabrics.toml")
    return tomllib.loads(file.read_text(encoding="utf-8"))


def known_stress(entry: dict[str, Any], direction: str, stretch: float) -> float:
    """Stress along the pull, N/m, at lambda - 1 = `stretch`, from the table's `entry` of a fabric."""
    rest = np.maximum(entry["stretch_rest"], 0.0)
    strained = np.maximum(entry["stretch_strained"][DIRECTIONS[direction][1]], 0.0)
    c11, c12, c22, c33 = rest + min(stretch / MEASURED_TO, 1.0) * (strained - rest)
    strain = stretch + 0.5 * stretch**2
    stiffness = {"warp": 2.0 * c11, "weft": 2.0 * c22, "45 degrees": 0.5 * (c11 + 2.0 * c12 + c22 + c33)}
    return float(stiffness[direction] * strain)


def simulate(p: Fabrics, name: str, degrees: float, stretch: float) -> float:
    """Stress along the pull, N/m, that holds the edge of the patch."""
    turn = np.radians(degrees)
    along: NDArray[np.float64] = np.array([np.sin(turn), np.cos(turn)])
    gradient = np.eye(2) + stretch * np.outer(along, along)
    pulled = pull(load_fabric(name), p.side, p.elements, gradient, "all", p.seed)
    return float(along @ pulled.second @ along)
