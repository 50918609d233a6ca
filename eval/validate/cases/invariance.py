"""What the elastic energy and its forces owe to mechanics, whatever the fabric.

On randomly deformed sheets x: forces are f = -dE/dx; they add up to no force and to no torque; energy and
forces turn with the sheet, E(R x + t) = E(x) and f(R x + t) = R f(x); a sheet and its mirror image M x store
the same, E(M x) = E(x), f(M x) = M f(x), so that a fold up is as stiff as a fold down."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from muslin.eval.validate.case import CaseTable, Count, Outcome, Row
from muslin.eval.validate.meshes import rectangle
from muslin.eval.validate.world import alone, elastic_energy, elastic_forces, exact
from muslin.sim.cloth import build_cloth
from muslin.sim.material import fabric_names, load_fabric
from muslin.sim.solve.simulator import ClothSimulator
from muslin.sim.tables import Positive

T = TypeVar("T")

DIFFERENCE = 1.0e-7
"""Step of the central differences, in sides of the sheet."""


class Invariance(CaseTable):
    """`fabrics` by name, or "all"; `side` m; `amplitude` of the random deformation, in grid spacings."""

    fabrics: list[str]
    side: Positive
    elements: Count
    amplitude: Positive
    bar_exact: Positive
    bar_difference: Positive


def run(p: Invariance) -> Outcome:
    """Rows: each property's relative violation, the worst over the fabrics."""
    names = fabric_names() if p.fabrics == ["all"] else p.fabrics
    sheets = [_deformed(p, name) for name in names]
    outcome = Outcome()
    properties: list[tuple[str, Callable[[ClothSimulator], float], float]] = [
        ("net force of inner forces", net_force, p.bar_exact),
        ("net torque of inner forces", net_torque, p.bar_exact),
        ("energy and forces after a turn and a shift", turned, p.bar_exact),
        ("energy and forces of the mirror image", mirrored, p.bar_exact),
        ("forces against differences of the energy", differences, p.bar_difference),
    ]
    for name, violation, bar in properties:
        worst = max(violation(sim) for sim in sheets)
        outcome.rows.append(Row(f"{name}, worst of {len(names)} fabrics", worst, 0.0, bar, "absolute"))
    return outcome


def net_force(sim: ClothSimulator) -> float:
    """|sum f| over sum |f|."""
    force = elastic_forces(sim)
    return float(np.linalg.norm(force.sum(axis=0)) / np.linalg.norm(force, axis=1).sum())


def net_torque(sim: ClothSimulator) -> float:
    """|sum x cross f| over sum |x| |f|."""
    force, x = elastic_forces(sim), sim.positions
    lever = np.linalg.norm(x, axis=1) @ np.linalg.norm(force, axis=1)
    return float(np.linalg.norm(np.cross(x, force).sum(axis=0)) / lever)


def turned(sim: ClothSimulator) -> float:
    """Violation by a random rotation and a shift by half the sheet."""
    turn = Rotation.from_euler("xyz", [0.4, -1.1, 2.3]).as_matrix()
    return _violation(sim, turn, 0.5 * np.ptp(sim.positions, axis=0))


def mirrored(sim: ClothSimulator) -> float:
    """Violation by the reflection in the sheet's plane."""
    return _violation(sim, np.diag([1.0, 1.0, -1.0]), np.zeros(3))


def differences(sim: ClothSimulator) -> float:
    """|dE + f . d| over |f| |d| for a random direction d, dE by central differences."""
    x, force = sim.positions, elastic_forces(sim)
    direction = np.random.default_rng(1).normal(size=x.shape)
    direction *= DIFFERENCE * np.ptp(x, axis=0).max() / np.abs(direction).max()
    ahead, behind = (_at(sim, x + sign * direction, elastic_energy) for sign in (0.5, -0.5))
    sim.place(x, sim.collider_vertices)
    size = np.linalg.norm(force) * np.linalg.norm(direction)
    return float(abs(ahead - behind + (force * direction).sum()) / size)


def _violation(sim: ClothSimulator, turn: NDArray[np.float64], shift: NDArray[np.float64]) -> float:
    x, energy, force = sim.positions, elastic_energy(sim), elastic_forces(sim)
    image = x @ turn.T + shift
    energy_error = abs(_at(sim, image, elastic_energy) / energy - 1.0)
    force_error = np.abs(_at(sim, image, elastic_forces) - force @ turn.T).max() / np.abs(force).max()
    sim.place(x, sim.collider_vertices)
    return float(max(energy_error, force_error))


def _at(sim: ClothSimulator, x: NDArray[np.float64], measure: Callable[[ClothSimulator], T]) -> T:
    sim.place(x, sim.collider_vertices)
    return measure(sim)


def _deformed(p: Invariance, fabric: str) -> ClothSimulator:
    mesh = rectangle(p.side, p.side, p.elements, p.elements, "irregular", p.seed)
    flat = np.pad(mesh.panel_vertices, ((0, 0), (0, 1)))
    noise = np.random.default_rng(p.seed).normal(size=flat.shape)
    places = flat + p.amplitude * p.side / p.elements * np.clip(noise, -2.0, 2.0)
    return alone(build_cloth(mesh, load_fabric(fabric)), places, exact((0.0, 0.0, 0.0)))
