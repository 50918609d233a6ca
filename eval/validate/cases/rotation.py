"""Drape, turn the world by 90 degrees about the vertical axis, drape again: the same shape.

Two ways: the rest turned together with its sphere has to stay at rest, and a sheet laid on the turned sphere
has to come to the turned rest."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from muslin.eval.validate.case import Count, Outcome, Row
from muslin.eval.validate.meshes import rectangle
from muslin.eval.validate.on_sphere import UPRIGHT, SheetOnSphere
from muslin.eval.validate.world import equilibrium
from muslin.sim.solve.simulator import ClothSimulator
from muslin.sim.tables import Positive

TURN = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


class RotationCase(SheetOnSphere):
    """`elements` along a side; `friction` mu; equilibrium in at most `steps`; `bar` m."""

    elements: Count
    friction: Annotated[float, Field(ge=0.0)]
    steps: Count
    bar: Positive


def run(p: RotationCase) -> Outcome:
    """Rows: largest distance of a vertex from its turned place, both ways."""
    mesh = rectangle(p.side, p.side, p.elements, p.elements, "structured", p.seed)
    turned, again = (p.laid(mesh, p.friction, 1.0e-9, turn) for turn in (UPRIGHT, TURN))
    _settle(p, turned)
    rest = turned.positions @ TURN.T
    turned.turn_world(TURN, np.zeros(3))
    _settle(p, turned)
    _settle(p, again)
    names = ("rest turned by 90 degrees, settled again", "draped in the world turned by 90 degrees")
    return Outcome(
        [
            Row(f"round trip, {name}: largest distance", away, 0.0, p.bar, "absolute", "m")
            for name, sim in zip(names, (turned, again), strict=True)
            for away in [float(np.linalg.norm(sim.positions - rest, axis=1).max())]
        ]
    )


def _settle(p: RotationCase, sim: ClothSimulator) -> None:
    equilibrium(sim, p.tolerance, p.dt, p.steps, friction=p.friction > 0.0)
