"""The air around one cloth: its density, its wind and how hard it holds on to the cloth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import NDArray

from muslin.sim.cloth import ClothModel
from muslin.sim.energies.air import AirModel, air_begin_step, air_derivatives, air_value
from muslin.sim.solve.block_matrix import BlockMatrix


@dataclass(frozen=True)
class AirSettings:
    """`density` kg/m^3; `wind` m/s; coefficients of drag `across` and `along` a triangle, dimensionless.

    1.2 is the drag of a square plate held across the wind, 0.02 the friction of a rough one along it
    (Hoerner 1965, chapters 3 and 2).
    """

    density: float = 1.2
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    across: float = 1.2
    along: float = 0.02


class AirDrag:
    """The potential of `muslin.sim.energies.air` for one cloth on a device."""

    def __init__(self, cloth: ClothModel, settings: AirSettings, device: str) -> None:
        self.device = device
        self.num_faces = len(cloth.faces)
        self.pressure = 0.5 * settings.density * settings.across
        self.friction = 0.5 * settings.density * settings.along
        model = AirModel()
        model.faces = wp.array(cloth.faces, dtype=wp.vec3i, device=device)
        model.slots = wp.array(cloth.slots(cloth.faces), dtype=wp.int32, device=device)
        model.normal = wp.zeros(self.num_faces, dtype=wp.vec3d, device=device)
        model.across = wp.zeros(self.num_faces, dtype=wp.float64, device=device)
        model.along = wp.zeros(self.num_faces, dtype=wp.float64, device=device)
        model.wind = wp.vec3d(*settings.wind)
        self.model = model

    def begin_step(self, x: wp.array, velocity: NDArray[np.float64]) -> None:
        """Take normals and coefficients from positions x and velocities (V, 3), m/s."""
        v = wp.array(velocity, dtype=wp.vec3d, device=self.device)
        args = [x, v, self.pressure, self.friction, self.model]
        wp.launch(air_begin_step, self.num_faces, args, device=self.device)

    def add_value(self, x: wp.array, start: wp.array, inverse_dt: float, energy: wp.array) -> None:
        wp.launch(air_value, self.num_faces, [x, start, self.model, inverse_dt, energy], device=self.device)

    def add_derivatives(
        self, x: wp.array, start: wp.array, inverse_dt: float, gradient: wp.array, matrix: BlockMatrix
    ) -> None:
        args = [x, start, self.model, inverse_dt, gradient, matrix]
        wp.launch(air_derivatives, self.num_faces, args, device=self.device)
