"""Fabrics: the measured table of Wang et al. 2011, isotropic materials, and how to scale either.

A `Fabric` holds what the elastic energies need, in SI units; see `muslin.sim.energies.stretch` and
`muslin.sim.energies.bending` for the equations the coefficients enter.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from typing import Any

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
    `bend`: (3, 5) N m, coefficients k of hinges along 0, 45, 90 degrees to the warp (rows), at curvatures
    alpha = theta l / (2 A) of 0 to 20 1/m (columns), for an energy A k alpha^2 / 2.
    `bend_poisson`: Poisson's ratio in bending, which no cylinder shows.
    """

    name: str
    density: float
    stretch_rest: NDArray[np.float64]
    stretch_strained: NDArray[np.float64]
    bend: NDArray[np.float64]
    bend_poisson: float = 0.0

    @property
    def rigidity(self) -> NDArray[np.float64]:
        """Rigidities (5, 4) [D11, D12, D22, D66], N m, at curvatures 0, 10, 20, 30, 40 1/m.

        Equilateral triangles rolled to curvature kappa about a family of their edges fold these by
        theta = kappa h, so alpha = kappa / 2, and store k kappa^2 / 8 an area: D(kappa) = k(kappa / 2) / 4
        for bending about the edges' direction. About the weft that is D11, about the warp D22, and at 45
        degrees D45 = (D11 + D22 + 2 D12 + 4 D66) / 4. Three directions leave D12 open:

            D12 = nu m  where m > 0, else m,   m = min(sqrt(D11 D22), 2 D45 - (D11 + D22) / 2),

        nu = `bend_poisson`, and D66 is what then gives D45. For an isotropic plate this is D12 = nu B,
        D66 = B (1 - nu) / 2. The form is positive semi-definite where m >= -sqrt(D11 D22), as in every table.
        """
        about_warp, about_45, about_weft = 0.25 * self.bend
        d11, d22 = about_weft, about_warp
        twice = 2.0 * about_45 - 0.5 * (d11 + d22)
        m = np.minimum(np.sqrt(d11 * d22), twice)
        d12 = np.where(m > 0.0, self.bend_poisson * m, m)
        return np.stack([d11, d12, d22, 0.5 * (twice - d12)], axis=1)

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
    return fabric_from_table(name, table[name])


def fabric_from_table(name: str, entry: dict[str, Any]) -> Fabric:
    """A fabric of the values that the tables hold, made admissible as `load_fabric` says."""
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
    c12 = nu c11, c33 = E h / (1 + nu). Bending rigidity B = E h^3 / (12 (1 - nu^2)), so `Fabric.bend` is 4 B.

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
    return Fabric(name, density, rest, np.tile(rest, (5, 1)), np.full((3, 5), 4.0 * rigidity), poisson)


def bend_moments(rigidity: NDArray[np.float64]) -> NDArray[np.float64]:
    """Integrals of D(s) s, N m / m^2, from 0 to each curvature of `Fabric.rigidity` (5, 4): (5, 4)."""
    h = 2.0 * BEND_CURVATURE_STEP
    start = h * np.arange(len(rigidity) - 1)[:, None]
    d, slope = rigidity[:-1], np.diff(rigidity, axis=0) / h
    # D(s) s over one interval, with s = start + t: (d + slope t)(start + t)
    piece = d * (start * h + h**2 / 2.0) + slope * (start * h**2 / 2.0 + h**3 / 3.0)
    return np.concatenate([np.zeros((1, rigidity.shape[1])), np.cumsum(piece, axis=0)])


def _admissible(c: NDArray[np.float64]) -> NDArray[np.float64]:
    c = np.maximum(c, 0.0)
    c[..., 1] = np.minimum(c[..., 1], 0.95 * np.sqrt(c[..., 0] * c[..., 2]))
    return c
