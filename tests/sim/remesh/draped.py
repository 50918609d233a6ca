"""Garments in the world, free of intersections: rolled up, waved, sewn to tubes and darts, or worn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from muslin.garments.designs.tee import TEE
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template
from muslin.sim.body import load_body
from muslin.sim.cloth import build_cloth
from muslin.sim.contact.system import ContactSettings
from muslin.sim.material import load_fabric
from muslin.sim.remesh.sewn_mesh import GarmentState
from muslin.sim.solve.settings import SolverSettings
from muslin.sim.wear import WornGarment
from tests.sim.meshes import sheet
from tests.sim.remesh.panels import annulus, dart, tube

Array = NDArray[np.float64]
NOBODY = np.zeros((0, 3)), np.zeros((0, 3), np.int32)


@dataclass(frozen=True, eq=False)
class Draped:
    """A garment where it lies, positions (V, 3), metres, and a body, (N, 3) metres and (M, 3)."""

    mesh: GarmentMesh
    positions: Array
    body: tuple[Array, NDArray[np.int32]] = NOBODY

    def state(self, seed: int = 0) -> GarmentState:
        """Moving smoothly, and shaken a little, held by friction at random, nothing locked."""
        rng = np.random.default_rng(seed)
        return GarmentState(
            self.mesh,
            self.positions.copy(),
            moving(self.positions, rng),
            1e-3 * rng.normal(size=self.positions.shape),
            np.zeros(self.mesh.num_vertices, np.int32),
        )


def moving(positions: Array, rng: np.random.Generator) -> Array:
    """(V, 3) velocities, m/s: a smooth field and white noise."""
    wave = rng.normal(0.0, 6.0, (3, 3))
    return np.sin(positions @ wave + rng.uniform(0.0, 6.0, 3)) + 0.1 * rng.normal(size=positions.shape)


def at_vertices(mesh: GarmentMesh, place: Callable[[Array], Array]) -> Array:
    """(V, 3) of a function of panel space that gives all copies of a vertex one place."""
    positions = np.zeros((mesh.num_vertices, 3))
    positions[mesh.panel_to_vertex] = place(mesh.panel_vertices)
    return positions


def flat_sheet(seed: int) -> Draped:
    """A sheet in a slanting plane."""
    mesh = sheet("irregular", 0.3, 0.3, 0.03, seed)
    frame = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return Draped(mesh, at_vertices(mesh, lambda p: p @ frame[:2] + [0.1, 0.9, -0.2]))


def rolled_sheet(seed: int) -> Draped:
    """A sheet rolled up without strain to an Archimedean spiral, its layers 6 mm apart."""
    mesh = sheet("irregular", 0.4, 0.2, 0.02, seed)
    pitch, start = 0.006 / (2.0 * np.pi), 0.03
    turn = np.linspace(0.0, 4.0 * np.pi, 4001)
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(start + pitch * turn, pitch)[:-1] * np.diff(turn))])

    def place(p: Array) -> Array:
        angle = np.interp(p[:, 0], arc, turn)
        radius = start + pitch * angle
        return np.stack([radius * np.cos(angle), p[:, 1], radius * np.sin(angle)], axis=1)

    return Draped(mesh, at_vertices(mesh, place))


def waved_annulus(seed: int) -> Draped:
    """A ring with waves around it."""
    mesh = annulus(0.05, 0.2, 40, 7)
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi)

    def place(p: Array) -> Array:
        angle, radius = np.arctan2(p[:, 1], p[:, 0]), np.linalg.norm(p, axis=1)
        return np.stack([p[:, 0], 0.15 * radius * np.sin(3.0 * angle + phase), -p[:, 1]], axis=1)

    return Draped(mesh, at_vertices(mesh, place))


def waved_tube(seed: int) -> Draped:
    """A tube, one panel sewn to itself, with pleats that wander along it."""
    mesh = tube(0.6, 0.4, 30, 20)
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi)

    def place(p: Array) -> Array:
        angle = 2.0 * np.pi * p[:, 0] / 0.6
        radius = 0.09 * (1.0 + 0.1 * np.sin(5.0 * angle + phase + 4.0 * p[:, 1]))
        # The two sides of the seam are one place: whole turns, exactly.
        angle = np.where(angle > 2.0 * np.pi - 1e-9, 0.0, angle)
        return np.stack([radius * np.cos(angle), p[:, 1], -radius * np.sin(angle)], axis=1)

    return Draped(mesh, at_vertices(mesh, place))


def sewn_dart(seed: int) -> Draped:
    """A dart sewn to a cone, its hem waved."""
    opening = 1.2
    mesh = dart(0.2, opening, 30, 9)
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi)
    whole = 2.0 * np.pi - opening

    def place(p: Array) -> Array:
        radius = np.linalg.norm(p, axis=1)
        turned = np.mod(np.arctan2(p[:, 1], p[:, 0]) + 1e-9, 2.0 * np.pi) * 2.0 * np.pi / whole
        share = whole / (2.0 * np.pi)
        height = np.sqrt(1.0 - share**2) * radius - 0.4 * radius**2 * np.sin(3.0 * turned + phase)
        return np.stack([share * radius * np.cos(turned), -height, -share * radius * np.sin(turned)], axis=1)

    return Draped(mesh, at_vertices(mesh, place))


@cache
def worn_tee(resolution: int = 403) -> Draped:
    """A top on a body in the T-pose, from its template."""
    mesh = template("tee", TEE.preset("top"), resolution)
    model = load_body("female")
    cloth = build_cloth(mesh, load_fabric("gray-interlock"))
    worn = WornGarment([mesh], [cloth], model, np.zeros(10), ContactSettings(), SolverSettings(), "cpu")
    return Draped(mesh, worn.sim.positions, (worn.sim.collider_vertices, model.faces.astype(np.int32)))


DRAPED: dict[str, Callable[[int], Draped]] = {
    "flat sheet": flat_sheet,
    "rolled sheet": rolled_sheet,
    "waved annulus": waved_annulus,
    "waved tube": waved_tube,
    "sewn dart": sewn_dart,
    "worn tee": lambda _: worn_tee(),
}
