"""Fabrics: the measured table of Wang et al. 2011, isotropic materials, and how to scale either.

A `Fabric` holds what the elastic energies need, in SI units; see `muslin.sim.energies.stretch` and
`muslin.sim.energies.bending` for the equations the coefficients enter.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError

STRAINED_STRETCH = 7.0 / 6.0
"""Principal stretch at which `Fabric.stretch_strained` was measured."""

BEND_CURVATURE_STEP = 5.0
"""Spacing of the curvatures, 1/m, of the columns of `Fabric.bend`: 0, 5, 10, 15, 20."""


@dataclass(frozen=True, eq=False)
class Fabric:
    """Coefficients of one fabric.

    `density`: kg/m^2.
    `stretch_rest`: (4,) [c11, c12, c22, c33], N/m, at zero strain; 1 is the warp, 2 the weft.
    `stretch_strained`: (5, 4) the same at principal stretch 7/6, for the angle of the larger principal strain
    to the warp of 0, 22.5, 45, 67.5 and 90 degrees.
    `bend`: (3, 5) N m, rows: edge direction 0, 45, 90 degrees to the warp; columns: curvature 0 to 20 1/m.
    """

    name: str
    density: float
    stretch_rest: NDArray[np.float64]
    stretch_strained: NDArray[np.float64]
    bend: NDArray[np.float64]

    def scaled(self, density: float = 1.0, stretch: float = 1.0, bend: float = 1.0) -> Fabric:
        """The same fabric with multiplied density, stretch and bending stiffness (all > 0)."""
        for key, value in {"density": density, "stretch": stretch, "bend": bend}.items():
            if not (np.isfinite(value) and value > 0.0):
                raise InputError(
                    f"fabric multiplier {key} = {value}: must be a finite number above 0; use 1 for no change"
                )
        return replace(
            self,
            density=self.density * density,
            stretch_rest=self.stretch_rest * stretch,
            stretch_strained=self.stretch_strained * stretch,
            bend=self.bend * bend,
        )


@cache
def _table() -> dict[str, dict]:
    text = resources.files("muslin.sim").joinpath("assets/wang2011_fabrics.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def fabric_names() -> list[str]:
    """Names of the measured fabrics."""
    return sorted(_table())


def load_fabric(name: str) -> Fabric:
    """A measured fabric by name.

    Negative coefficients of the table are artefacts of its fit and are clamped to zero; the off-diagonal c12
    is limited to 95% of the geometric mean of c11 and c22, so that every interpolated tensor is positive
    semi-definite.

    Source: Wang, O'Brien, Ramamoorthi, "Data-driven elastic models for cloth: modeling and measurement",
    ACM TOG 30(4), 2011.
    """
    table = _table()
    if name not in table:
        raise InputError(f"fabric = {name!r}: unknown; choose one of {', '.join(sorted(table))}")
    entry = table[name]
    return Fabric(
        name=name,
        density=float(entry["density"]),
        stretch_rest=_admissible(np.asarray(entry["stretch_rest"], dtype=np.float64)),
        stretch_strained=_admissible(np.asarray(entry["stretch_strained"], dtype=np.float64)),
        bend=np.asarray(entry["bend"], dtype=np.float64),
    )


def isotropic_fabric(
    young: float, poisson: float, thickness: float, density: float, name: str = "isotropic"
) -> Fabric:
    """St. Venant-Kirchhoff membrane and plate of an isotropic sheet.

    Plane stress: s = E h / (1 - nu^2) [(1 - nu) G + nu tr(G) I], so c11 = c22 = E h / (2 (1 - nu^2)),
    c12 = nu c11, c33 = E h / (1 + nu). Bending rigidity B = E h^3 / (12 (1 - nu^2)); the hinge coefficient of
    `muslin.sim.energies.bending` that a regular mesh needs for it is k = 4 B (E = B theta^2 / sqrt(3) a hinge
    of equilateral triangles; Seung, Nelson 1988).

    `young` Pa, `thickness` m, `density` kg/m^2, `poisson` in (-1, 0.5].
    """
    for key, value in {"young": young, "thickness": thickness, "density": density}.items():
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(f"{key} = {value}: must be a finite number above 0")
    if not -1.0 < poisson <= 0.5:
        raise InputError(f"poisson = {poisson}: must lie in (-1, 0.5]")
    c11 = young * thickness / (2.0 * (1.0 - poisson**2))
    rest = np.array([c11, poisson * c11, c11, young * thickness / (1.0 + poisson)])
    rigidity = young * thickness**3 / (12.0 * (1.0 - poisson**2))
    return Fabric(name, density, rest, np.tile(rest, (5, 1)), np.full((3, 5), 4.0 * rigidity))


def _admissible(c: NDArray[np.float64]) -> NDArray[np.float64]:
    c = np.maximum(c, 0.0)
    c[..., 1] = np.minimum(c[..., 1], 0.95 * np.sqrt(c[..., 0] * c[..., 2]))
    return c
