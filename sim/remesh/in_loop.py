"""Remeshing in the loop: the mesh of a simulated cloth follows what the cloth does."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from muslin.garments.merge import face_owner
from muslin.garments.mesh import GarmentMesh
from muslin.sim.cloth import build_cloth
from muslin.sim.material import Fabric
from muslin.sim.remesh.adapt import Changes, adapt
from muslin.sim.remesh.curves import curves
from muslin.sim.remesh.obstacle import Obstacle
from muslin.sim.remesh.settings import RemeshSettings
from muslin.sim.remesh.sewn_mesh import PINNED, GarmentState
from muslin.sim.remesh.sizing import sizing_field
from muslin.sim.solve.simulator import ClothSimulator

CALM = 0.02
"""Changes over faces: fewer do not show, and a cloth that comes to rest would wait for the last of them."""


class Remesher:
    """Keeps the mesh of the cloth of one simulator as fine as it has to be, and no finer.

    mesh       the mesh that the cloth has now; another object after every change
    seconds    spent on remeshing, what it takes to go on with another mesh included
    changes    what was done so far
    calm       whether the last remeshing changed next to nothing
    """

    def __init__(self, settings: RemeshSettings, mesh: GarmentMesh, fabrics: Sequence[Fabric]) -> None:
        """`fabrics`: one of each garment in `mesh`, in their order."""
        self.settings = settings
        self.mesh = mesh
        self.seconds = 0.0
        self.changes = Changes(0, 0, 0)
        self.calm = False
        self._fabrics = tuple(fabrics)
        self._corners = np.zeros(mesh.num_vertices, np.int32)
        for curve in curves(mesh):
            self._corners[curve.vertices[[0, -1]]] = 1
        self._obstacle: Obstacle | None = None
        self._steps = 0

    def step(self, sim: ClothSimulator) -> NDArray[np.int32] | None:
        """Call after every time step: remeshes after every so many of them, and then returns as `remesh`."""
        self._steps += 1
        return self.remesh(sim) if self._steps % self.settings.every == 0 else None

    def remesh(self, sim: ClothSimulator) -> NDArray[np.int32] | None:
        """Remeshes the cloth of `sim` where it is now.

        Returns the number (V',) that each vertex had before, -1 for new ones; None if nothing was changed.
        What is pinned stays pinned.
        """
        started = time.perf_counter()
        locked = self._corners.copy()
        locked[sim.pins] = PINNED
        state = GarmentState(self.mesh, sim.positions, sim.velocity, sim.held, locked)
        obstacle = self._obstacle_of(sim)
        range_ = sim.contact.settings.range
        metric = sizing_field(
            self.mesh, state.positions, self.settings, state.velocities, obstacle, contact_range=range_
        )
        after, origin, changes = adapt(state, metric, obstacle, self.settings.aspect_min)
        self.calm = changes.total <= CALM * len(self.mesh.faces)
        done = self.changes
        self.changes = Changes(
            done.splits + changes.splits, done.flips + changes.flips, done.collapses + changes.collapses
        )
        if changes.total:
            pins = np.where(origin >= 0, sim.pins[origin], False)
            cloth = build_cloth(after.mesh, self._fabrics, face_owner(after.mesh))
            sim.replace_cloth(cloth, after.positions, after.velocities, after.held)
            sim.pins = pins
            self.mesh = after.mesh
            self._corners = np.where(origin >= 0, self._corners[origin], 0).astype(np.int32)
        self.seconds += time.perf_counter() - started
        return origin if changes.total else None

    def _obstacle_of(self, sim: ClothSimulator) -> Obstacle:
        """The collider of `sim` as it stands."""
        if self._obstacle is None:
            self._obstacle = Obstacle(sim.collider_vertices, sim.contact.collider_faces)
        else:
            self._obstacle.move(sim.collider_vertices)
        return self._obstacle
