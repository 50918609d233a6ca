"""A square of isotropic cloth stretched one way, two ways, and sheared.

Plane stress St. Venant-Kirchhoff with Young's modulus E, Poisson ratio nu, thickness h:

    S = E h / (1 - nu^2) ((1 - nu) G + nu tr(G) 1),   G = (F^T F - 1) / 2,   P = F S.

Pulled one way by lambda with free sides, S11 = 0 across: G11 = -nu G22, so that S22 = E h G22 and the width
shrinks by sqrt(1 - nu (lambda^2 - 1)).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.eval.validate.case import CaseTable, Count, Outcome, Plot, Row, Series
from muslin.eval.validate.patch import pull
from muslin.sim.material import isotropic_fabric
from muslin.sim.tables import Positive


class Stretch(CaseTable):
    """`young` Pa; `stretches` lambda - 1 of the pulls; `shears` tan of the angle; `side` m of the square."""

    young: Positive
    poisson: float
    thickness: Positive
    density: Positive
    side: Positive
    elements: Count
    stretches: list[Positive]
    shears: list[Positive]
    bar: Positive


def run(p: Stretch) -> Outcome:
    """Rows: forces per width of the held edges and, for the pull one way, the width that is left."""
    outcome = Outcome()
    fabric = isotropic_fabric(p.young, p.poisson, p.thickness, p.density)
    found: dict[str, list[float]] = {"one way": [], "two ways": [], "sheared": []}
    for e in p.stretches:
        along = 1.0 + e
        gradient = np.diag([np.sqrt(1.0 - p.poisson * (along**2 - 1.0)), along])
        pulled = pull(fabric, p.side, p.elements, gradient, "ends", p.seed)
        found["one way"].append(float(pulled.first[1, 1]))
        expected = float(known_stress(p, gradient)[1, 1])
        name = f"uniaxial stretch by {e:g}"
        outcome.rows.append(
            Row(f"{name}: force per width", found["one way"][-1], expected, p.bar, unit="N/m")
        )
        right = pulled.mesh.panel_vertices[:, 0] == p.side
        inner = right & (np.abs(pulled.mesh.panel_vertices[:, 1] - 0.5 * p.side) < 0.4 * p.side)
        width = float(2.0 * pulled.positions[inner, 0].mean() / p.side)
        outcome.rows.append(Row(f"{name}: width", width, float(gradient[0, 0]), p.bar))
    for e in p.stretches:
        gradient = np.diag([1.0 + 0.5 * e, 1.0 + e])
        pulled = pull(fabric, p.side, p.elements, gradient, "edge", p.seed)
        stress = known_stress(p, gradient)
        found["two ways"].append(float(pulled.first[1, 1]))
        for k, direction in enumerate(("weft", "warp")):
            name = f"biaxial stretch by {0.5 * e:g} and {e:g}: force per width along {direction}"
            outcome.rows.append(Row(name, float(pulled.first[k, k]), stress[k, k], p.bar, unit="N/m"))
    for shear in p.shears:
        gradient = np.array([[1.0, shear], [0.0, 1.0]])
        pulled = pull(fabric, p.side, p.elements, gradient, "edge", p.seed)
        stress = known_stress(p, gradient)
        found["sheared"].append(float(pulled.first[0, 1]))
        name = f"shear by {shear:g}: force per width"
        outcome.rows.append(Row(f"{name} along it", found["sheared"][-1], stress[0, 1], p.bar, unit="N/m"))
        outcome.rows.append(
            Row(f"{name} across it", float(pulled.first[1, 1]), stress[1, 1], p.bar, unit="N/m")
        )
    outcome.plots = [_plot(p, found)]
    return outcome


def known_stress(p: Stretch, gradient: NDArray[np.float64]) -> NDArray[np.float64]:
    """First Piola-Kirchhoff stress (2, 2), N/m, of a deformation gradient (2, 2)."""
    strain = 0.5 * (gradient.T @ gradient - np.eye(2))
    factor = p.young * p.thickness / (1.0 - p.poisson**2)
    return gradient @ (factor * ((1.0 - p.poisson) * strain + p.poisson * np.trace(strain) * np.eye(2)))


def _plot(p: Stretch, found: dict[str, list[float]]) -> Plot:
    grid = np.linspace(0.0, max(p.stretches + p.shears), 40)
    gradients = {
        "one way": lambda e: np.diag([np.sqrt(1.0 - p.poisson * ((1.0 + e) ** 2 - 1.0)), 1.0 + e]),
        "two ways": lambda e: np.diag([1.0 + 0.5 * e, 1.0 + e]),
        "sheared": lambda e: np.array([[1.0, e], [0.0, 1.0]]),
    }
    series = []
    for name, gradient in gradients.items():
        entry = (0, 1) if name == "sheared" else (1, 1)
        values = [float(known_stress(p, gradient(e))[entry]) for e in grid]
        series.append(Series(f"{name}, known", grid.tolist(), values))
        at = p.shears if name == "sheared" else p.stretches
        series.append(Series(name, at, found[name], "points"))
    return Plot("Isotropic cloth: force per width", "stretch - 1, or shear", "N/m", series)
