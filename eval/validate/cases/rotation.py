"""Drape, turn the world by 90 degrees about the vertical axis, drape again: the same shape.

Two ways: the rest turned together with its sphere has to stay at rest, and a sheet laid on the turned sphere
has to come to the turned rest."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from muslin.eval.validate.case import CaseTable, Count, Outcome, Row
from muslin.eval.validate.colliders import sphere
from muslin.eval.validate.meshes import rectangle
from muslin.eval.validate.world import DOWN, equilibrium, exact, level
from muslin.sim.cloth import build_cloth
from muslin.sim.contact.system import ContactSettings
from muslin.sim.material import isotropic_fabric
from muslin.sim.solve.simulator import ClothSimulator
from muslin.sim.tables import Positive
from muslin.sim.world.tables import Subdivisions

TURN = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])

START_GAP = 0.8
"""Height of the sheet above the sphere, in ranges of the barrier."""


class RotationCase(CaseTable):
    """`side` m of the sheet, `radius` m of the sphere; `friction` mu; `tolerance` m: largest move of a step
    of `dt` s at rest, in at most `steps`; `bar` m."""

    young: Positive
    poisson: float
    thickness: Positive
    density: Positive
    side: Positive
    radius: Positive
    sphere_subdivisions: Subdivisions
    elements: Count
    friction: Annotated[float, Field(ge=0.0)]
    dt: Positive
    tolerance: Positive
    steps: Count
    bar: Positive


def run(p: RotationCase) -> Outcome:
    """Rows: largest distance of a vertex from its turned place, both ways."""
    turned, again = _laid(p, np.eye(3)), _laid(p, TURN)
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


def _laid(p: RotationCase, turn: NDArray[np.float64]) -> ClothSimulator:
    """A sheet laid level on the sphere, held at its centre, both turned."""
    contact = ContactSettings(friction_body=p.friction, friction_cloth=p.friction)
    mesh = rectangle(p.side, p.side, p.elements, p.elements, "structured", p.seed)
    panel = mesh.panel_vertices - 0.5 * p.side
    flat = level(panel, p.radius + START_GAP * contact.range)
    vertices, faces = sphere(p.radius, p.sphere_subdivisions)
    cloth = build_cloth(mesh, isotropic_fabric(p.young, p.poisson, p.thickness, p.density))
    solver = exact(DOWN, 1.0e-9)
    sim = ClothSimulator(cloth, flat @ turn.T, vertices @ turn.T, faces, contact, solver)
    sim.pins[np.argmin(np.linalg.norm(panel, axis=1))] = True
    return sim
