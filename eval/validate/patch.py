"""A patch of cloth pulled at its edge: the mean stress that the simulator's own forces there amount to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from muslin.eval.validate.meshes import rectangle
from muslin.eval.validate.world import alone, elastic_forces, equilibrium, exact
from muslin.garments.mesh import GarmentMesh
from muslin.sim.cloth import build_cloth
from muslin.sim.material import Fabric

SHAKE = 0.1
"""Largest shift of the free vertices before they are solved for, in grid spacings."""


@dataclass(frozen=True)
class Pulled:
    """`first` and `second` (2, 2): mean first and second Piola-Kirchhoff stress, N/m, rows and columns weft,
    warp; `positions` (V, 2) in the plane; `mesh` the patch."""

    first: NDArray[np.float64]
    second: NDArray[np.float64]
    positions: NDArray[np.float64]
    mesh: GarmentMesh


def pull(
    fabric: Fabric,
    side: float,
    elements: int,
    gradient: NDArray[np.float64],
    held: Literal["all", "edge", "ends"],
    seed: int,
) -> Pulled:
    """Hold vertices of a square patch where the deformation `gradient` F (2, 2) puts them; solve for the
    rest.

    `held`: all vertices, those of the edge, or those of the two ends of the warp. The mean stress is that of
    the forces f_i with which the held vertices X_i are held (mean stress theorem),

        P = 1 / A sum_i f_i X_i^T,   S = F^-1 P.
    """
    mesh = rectangle(side, side, elements, elements, "irregular", seed)
    panel = mesh.panel_vertices - 0.5 * side
    side_end = np.abs(panel) > 0.5 * side * (1.0 - 1e-9)
    choices: dict[str, NDArray[np.bool_]] = {
        "all": np.ones(len(panel), dtype=bool),
        "edge": side_end[:, 0] | side_end[:, 1],
        "ends": side_end[:, 1],
    }
    pins = choices[held]
    places = panel @ gradient.T
    shake = np.random.default_rng(seed).uniform(-SHAKE, SHAKE, panel.shape) * side / elements
    start = np.where(pins[:, None], places, places + shake)
    sim = alone(build_cloth(mesh, fabric), np.pad(start, ((0, 0), (0, 1))), exact((0.0, 0.0, 0.0)))
    sim.pins[:] = pins
    equilibrium(sim, 1.0e-9 * side)
    forces = -elastic_forces(sim)[pins, :2]
    first = forces.T @ panel[pins] / side**2
    return Pulled(first, np.linalg.inv(gradient) @ first, sim.positions[:, :2], mesh)
