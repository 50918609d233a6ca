"""Cloth that is thrown, squeezed and struck in large steps: no intersection at any of them.

ipctk counts, exactly, in every frame. A sheet falls on a sphere; the sphere jumps by more than its radius a
step, through where the sheet was; a strip falls folded onto a floor; a sheet is twisted by its ends."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from muslin.eval.validate.case import CaseTable, Count, Outcome, Row
from muslin.eval.validate.colliders import slope, sphere
from muslin.eval.validate.meshes import rectangle
from muslin.eval.validate.world import NO_FACES, level
from muslin.sim.cloth import build_cloth
from muslin.sim.contact.system import ContactSettings
from muslin.sim.dataset.intersections import count_intersections
from muslin.sim.material import load_fabric
from muslin.sim.solve.settings import SolverSettings
from muslin.sim.solve.simulator import ClothSimulator
from muslin.sim.tables import Positive
from muslin.sim.world.tables import Subdivisions


class Guarantee(CaseTable):
    """`side` m of the sheets; `radius` m of the sphere and the way of its jumps; `dt` s; `turns` of the
    twist."""

    fabrics: list[str]
    side: Positive
    radius: Positive
    sphere_subdivisions: Subdivisions
    elements: Count
    dt: Positive
    frames: Count
    turns: Positive


def run(p: Guarantee) -> Outcome:
    """Rows: intersections, summed over the frames."""
    outcome = Outcome()
    for fabric in p.fabrics:
        for name, frames in (
            ("sheet struck by a sphere", struck),
            ("strip folded on a floor", folded),
            ("sheet twisted", twisted),
        ):
            found = sum(_count(sim) for sim in frames(p, fabric))
            row = f"{name}, {fabric}: intersections in {p.frames} frames"
            outcome.rows.append(Row(row, float(found), 0.0, 0.0, "absolute", "pairs"))
    return outcome


def struck(p: Guarantee, fabric: str) -> Iterator[ClothSimulator]:
    """A sheet falls on a sphere that jumps up and down and sideways, each jump a step."""
    vertices, faces = sphere(p.radius, p.sphere_subdivisions)
    sim = _sheet(p, fabric, p.radius + 0.01, vertices, faces)
    rng = np.random.default_rng(p.seed)
    for frame in range(p.frames):
        moving = frame % 2 == 1
        centre = p.radius * rng.uniform(-1.0, 1.0, 3) * [1.0, 2.0, 1.0] if moving else np.zeros(3)
        sim.advance(vertices + centre, p.dt)
        yield sim


def folded(p: Guarantee, fabric: str) -> Iterator[ClothSimulator]:
    """A sheet hung on edge above a floor drops onto it and folds up."""
    vertices, faces = slope(0.0, 20.0 * p.side)
    sim = _sheet(p, fabric, 0.0, vertices - [0.0, 0.01, 0.0], faces, upright=True)
    for _ in range(p.frames):
        sim.advance(None, p.dt)
        yield sim


def twisted(p: Guarantee, fabric: str) -> Iterator[ClothSimulator]:
    """Two ends of a sheet are turned against each other and brought together by a third."""
    sim = _sheet(p, fabric, 0.0, np.zeros((0, 3)), NO_FACES)
    start = sim.positions
    z = start[:, 2]
    sim.pins[:] = np.abs(z) > 0.5 * p.side * (1.0 - 1e-9)
    for frame in range(1, p.frames + 1):
        share = frame / p.frames
        angle = 2.0 * np.pi * p.turns * share * np.sign(z)
        targets = np.stack(
            [start[:, 0] * np.cos(angle), start[:, 0] * np.sin(angle), z * (1.0 - share / 3.0)], axis=1
        )
        sim.advance(None, p.dt, pin_targets=targets)
        yield sim


def _sheet(
    p: Guarantee,
    fabric: str,
    height: float,
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    upright: bool = False,
) -> ClothSimulator:
    mesh = rectangle(p.side, p.side, p.elements, p.elements, "irregular", p.seed)
    places = level(mesh.panel_vertices - 0.5 * p.side, height)
    if upright:
        # A little wavy, so that it knows how to fold.
        places = np.stack(
            [places[:, 0], 0.5 * p.side - places[:, 2], 0.01 * np.sin(20.0 * places[:, 2])], axis=1
        )
    cloth = build_cloth(mesh, load_fabric(fabric))
    return ClothSimulator(cloth, places, vertices, faces, ContactSettings(), SolverSettings())


def _count(sim: ClothSimulator) -> int:
    found = count_intersections(
        sim.positions, sim.cloth.faces, sim.collider_vertices, sim.contact.collider_faces
    )
    return found.cloth_cloth + found.cloth_body
