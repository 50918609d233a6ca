"""A folded strip at rest on a floor without friction: action and reaction.

The floor carries the weight, sum_i f_i = sum_i m_i g over the contacts between strip and floor, and the
contacts of the strip with itself add up to no force and no torque."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.eval.validate.case import CaseTable, Count, Outcome, Row
from muslin.eval.validate.colliders import slope
from muslin.eval.validate.meshes import rectangle
from muslin.eval.validate.world import DOWN, GRAVITY, balance, contact_forces, exact
from muslin.garments.errors import InputError
from muslin.sim.cloth import build_cloth
from muslin.sim.contact.system import ContactSettings
from muslin.sim.material import isotropic_fabric
from muslin.sim.solve.simulator import ClothSimulator
from muslin.sim.tables import Positive


class Support(CaseTable):
    """`length`, `width` m of the strip; `gap` m between its layers before it falls together; `residual` of
    the equilibrium, as a share of the weight, and the step `dt` s towards it."""

    young: Positive
    thickness: Positive
    density: Positive
    length: Positive
    width: Positive
    gap: Positive
    elements: Count
    across: Count
    dt: Positive
    residual: Positive
    bar_weight: Positive
    bar_balance: Positive


def run(p: Support) -> Outcome:
    """Rows: force of the floor over the weight, net force and torque of the strip on itself."""
    sim, off = simulate(p)
    weight = float(sim.cloth.mass.sum() * GRAVITY)
    x = sim.positions
    on_all = contact_forces(sim)
    # Out of reach of the floor, only the strip's contacts with itself are left.
    sim.place(x, sim.collider_vertices - [0.0, off, 0.0])
    on_itself = contact_forces(sim)
    floor = (on_all - on_itself).sum(axis=0)
    size = float(np.linalg.norm(on_itself, axis=1).sum())
    if size == 0.0:
        raise InputError("support: the layers of the strip do not touch; give a smaller thickness or gap")
    lever = float(np.linalg.norm(x, axis=1) @ np.linalg.norm(on_itself, axis=1))
    torque = np.cross(x, on_itself).sum(axis=0)
    return Outcome(
        [
            Row(
                "folded strip at rest: force of the floor over the weight",
                floor[1] / weight,
                1.0,
                p.bar_weight,
            ),
            Row(
                "folded strip at rest: sideways force of the floor over the weight",
                float(np.hypot(floor[0], floor[2]) / weight),
                0.0,
                p.bar_weight,
                "absolute",
            ),
            Row(
                "strip on itself: net force, relative",
                float(np.linalg.norm(on_itself.sum(axis=0)) / size),
                0.0,
                p.bar_balance,
                "absolute",
            ),
            Row(
                "strip on itself: net torque, relative",
                float(np.linalg.norm(torque) / lever),
                0.0,
                p.bar_balance,
                "absolute",
            ),
        ]
    )


def simulate(p: Support) -> tuple[ClothSimulator, float]:
    """The strip at rest, and a distance that takes the floor out of its reach."""
    contact = ContactSettings(friction_body=0.0, friction_cloth=0.0)
    mesh = rectangle(p.width, p.length, p.across, p.elements, "irregular", p.seed)
    x, y = folded(mesh.panel_vertices[:, 1], p.length, p.gap)
    places = np.stack([x, y + contact.range, -mesh.panel_vertices[:, 0]], axis=1)
    solver = exact(DOWN)
    cloth = build_cloth(mesh, isotropic_fabric(p.young, 0.3, p.thickness, p.density))
    sim = ClothSimulator(cloth, places, *slope(0.0, 4.0 * p.length), contact, solver)
    balance(sim, p.residual, p.dt)
    return sim, 10.0 * contact.range


def folded(
    s: NDArray[np.float64], length: float, gap: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Places of arc lengths s of a strip folded in half over a half circle of diameter `gap`."""
    straight = 0.5 * (length - 0.5 * np.pi * gap)
    bow = np.clip((s - straight) / (0.5 * gap), 0.0, np.pi)
    lower, upper = np.minimum(s, straight), np.maximum(s - length + straight, 0.0)
    return lower - upper + 0.5 * gap * np.sin(bow), 0.5 * gap * (1.0 - np.cos(bow))
