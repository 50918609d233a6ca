"""A square sheet draped over a sphere: refinement of the mesh, and meshes of other orientation.

No closed form is known. The shape must converge as elements shrink, err(n) ~ n^-p against the finest mesh,
and must not depend on how the triangles lie in the fabric. The sheet is isotropic, and stiff enough to
bending that there is one way to hang; it is held at its centre and slides without friction, so that its rest
is that of an energy and of nothing that happened before."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import LinearNDInterpolator

from muslin.eval.validate.case import Count, Outcome, Plot, Row, Series
from muslin.eval.validate.meshes import Triangulation, centred, mirrored, rectangle
from muslin.eval.validate.on_sphere import SheetOnSphere
from muslin.eval.validate.world import equilibrium
from muslin.garments.mesh import GarmentMesh
from muslin.sim.solve.simulator import ClothSimulator
from muslin.sim.tables import Positive

SAMPLES = 21
"""Points along a side at which shapes are compared."""


class Drape(SheetOnSphere):
    """`elements` along a side and steps `dts` s of the fall, each half as large as the one before; the fall
    lasts `seconds`; `orientations` and `seeds` are compared at `compared` elements; bars: of the orders,
    and of the distance as a share of the side."""

    elements: list[Count]
    orientations: list[Triangulation]
    seeds: list[int]
    compared: Count
    dts: list[Positive]
    seconds: Positive
    fall_elements: Count
    order_mesh: Positive
    bar_order_mesh: Positive
    bar_order_dt: Positive
    bar_orientation: Positive


Shape = NDArray[np.float64]
"""A drape: places (S, S, 3), metres, of a grid of material points."""


def run(p: Drape) -> Outcome:
    """Rows: order in the mesh, distance between meshes of other orientation, order in dt."""
    outcome = Outcome()
    finer = [drape(p, sheet(p.side, n, "irregular", p.seed)) for n in p.elements]
    outcome.rows.append(
        Row(
            f"drape, {p.elements[-3]} to {p.elements[-1]} elements along: order in their size",
            _order(finer),
            p.order_mesh,
            p.bar_order_mesh,
            "absolute",
        )
    )
    kinds: list[tuple[Triangulation, int]] = [
        (kind, seed) for kind in p.orientations for seed in (p.seeds if kind != "structured" else p.seeds[:1])
    ]
    meshes = [drape(p, sheet(p.side, p.compared, kind, seed)) for kind, seed in kinds]
    apart = max(distance(a, b) for a in meshes for b in meshes) / p.side
    name = f"drape, {len(meshes)} meshes of {p.compared} elements along: largest distance/side"
    outcome.rows.append(Row(name, apart, 0.0, p.bar_orientation, "absolute"))
    mesh = sheet(p.side, p.fall_elements, "irregular", p.seed)
    falls = [fall(p, mesh, dt) for dt in p.dts]
    name = f"drape, {p.seconds:g} s of the fall: order in dt"
    outcome.rows.append(Row(name, _order(falls), 1.0, p.bar_order_dt, "absolute"))
    outcome.plots = [
        _section([f"{n} elements" for n in p.elements], finer, p),
        _section([f"{kind}, {seed}" for kind, seed in kinds], meshes, p),
        _convergence(
            "Drape: distance to the next finer mesh", "element, m", [p.side / n for n in p.elements], finer
        ),
        _convergence("Drape: distance to the next smaller step", "dt, s", p.dts, falls),
    ]
    return outcome


def _order(shapes: list[Shape]) -> float:
    """Order of convergence from the last three shapes of a sequence of halvings."""
    return float(np.log2(distance(shapes[-3], shapes[-2]) / distance(shapes[-2], shapes[-1])))


def _convergence(caption: str, x_label: str, sizes: list[float], shapes: list[Shape]) -> Plot:
    found = [distance(a, b) for a, b in pairwise(shapes)]
    points = Series("simulated", sizes[:-1], found, "points")
    order = 2 if x_label.startswith("element") else 1
    known = [found[-1] * (size / sizes[-2]) ** order for size in sizes[:-1]]
    line = Series("second order" if order == 2 else "first order", sizes[:-1], known)
    return Plot(caption, x_label, "m", [line, points], log_x=True, log_y=True)


def _section(names: list[str], shapes: list[Shape], p: Drape) -> Plot:
    """Profiles of the drapes through the centre along the diagonal of the cloth."""
    series = []
    for k, (name, shape) in enumerate(zip(names, shapes, strict=True)):
        places = shape[np.arange(SAMPLES), np.arange(SAMPLES)]
        reach = np.sign(np.arange(SAMPLES) - SAMPLES // 2) * np.hypot(places[:, 0], places[:, 2])
        finest = k == len(names) - 1
        series.append(Series(name, reach.tolist(), places[:, 1].tolist(), "line" if finest else "points"))
    angle = np.linspace(0.0, np.pi, 60)
    ball = Series("sphere", (p.radius * np.cos(angle)).tolist(), (p.radius * np.sin(angle)).tolist())
    return Plot("Drape: section along the diagonal", "m", "m", [ball, *series], same_scale=True)


def sheet(side: float, elements: int, triangulation: Triangulation, seed: int) -> GarmentMesh:
    """A square with a vertex at its centre."""
    half = rectangle(side, 0.5 * side, elements, elements // 2, triangulation, seed)
    return mirrored(half)


def drape(p: Drape, mesh: GarmentMesh) -> Shape:
    """The equilibrium of a sheet laid level on the sphere."""
    sim = _laid(p, mesh)
    equilibrium(sim, p.tolerance, dt=p.dt)
    return sample(p, mesh, sim)


def sample(p: Drape, mesh: GarmentMesh, sim: ClothSimulator) -> Shape:
    """The drape as it stands, linear between vertices; the same material points for all meshes."""
    line = np.linspace(-0.5, 0.5, SAMPLES) * p.side * (1.0 - 1e-9)
    return LinearNDInterpolator(centred(mesh), sim.positions)(*np.meshgrid(line, line, indexing="ij"))


def fall(p: Drape, mesh: GarmentMesh, dt: float) -> Shape:
    """The sheet `seconds` after it was let go, level, above the sphere."""
    sim = _laid(p, mesh)
    for _ in range(round(p.seconds / dt)):
        sim.advance(None, dt)
    return sample(p, mesh, sim)


def distance(a: Shape, b: Shape) -> float:
    """Root mean square distance of the same material points, metres, b turned about the vertical to fit a.

    Nothing but the facets of the sphere holds a sheet against turning about its centre. With w = x + i z the
    best turn is the argument of sum_k a_k conj(b_k).
    """
    w_a, w_b = (shape[..., 0] + 1j * shape[..., 2] for shape in (a, b))
    turn = np.sum(w_a * w_b.conj())
    level_part = np.abs(w_a - w_b * turn / abs(turn)) ** 2
    return float(np.sqrt((level_part + (a[..., 1] - b[..., 1]) ** 2).mean()))


def _laid(p: Drape, mesh: GarmentMesh) -> ClothSimulator:
    return p.laid(mesh, friction=0.0, accuracy=1.0e-8)
