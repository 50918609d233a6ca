"""Which vertices are held, and where they are led."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.sim.world.rigid import RigidMotion
from muslin.sim.world.tables import PinTable

ON_SIDE = 1.0e-6
"""Metres from the extent of a panel within which a vertex lies on its side."""


@dataclass(frozen=True, eq=False)
class _Held:
    vertices: NDArray[np.int64]
    motion: RigidMotion
    release: float


class Pins:
    """Pins on cloths of `meshes`, which lie one after the other in `start` (V, 3), metres, at time 0.

    A vertex that several pins name follows the last of those that still hold it.
    """

    def __init__(
        self, tables: Sequence[PinTable], meshes: Sequence[GarmentMesh], start: NDArray[np.float64]
    ) -> None:
        self._start = start
        self._held: list[_Held] = []
        offsets = np.cumsum([0, *(mesh.num_vertices for mesh in meshes)])
        for k, table in enumerate(tables):
            if table.layer >= len(meshes):
                raise InputError(
                    f"pins.{k}.layer = {table.layer}: the scene has {len(meshes)} garments, copies included; "
                    f"give 0 to {len(meshes) - 1}"
                )
            vertices = offsets[table.layer] + _region(k, table, meshes[table.layer])
            centre = start[vertices].mean(axis=0) if table.centre is None else np.array(table.centre)
            release = np.inf if table.release is None else table.release
            self._held.append(_Held(vertices, RigidMotion.of(table, centre), release))

    def at(self, time: float) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
        """Which vertices are held on the way to `time` s, (V,), and where they are then, (V, 3) metres."""
        held = np.zeros(len(self._start), bool)
        targets = self._start.copy()
        for pin in self._held:
            # Frames are counted by multiplication: a release on a frame must not depend on the last bit.
            if time <= pin.release + 1e-9:
                held[pin.vertices] = True
                targets[pin.vertices] = pin.motion.at(self._start[pin.vertices], time)
        return held, targets

    def renumber(self, origin: NDArray[np.int32]) -> None:
        """The cloth has other vertices (V',) now: those with these numbers before, -1 for new ones."""
        place = np.full(len(self._start), -1)
        old = np.flatnonzero(origin >= 0)
        place[origin[old]] = old
        self._held = [replace(pin, vertices=place[pin.vertices]) for pin in self._held]
        self._start = np.where((origin >= 0)[:, None], self._start[origin], 0.0)


def _region(k: int, table: PinTable, mesh: GarmentMesh) -> NDArray[np.int64]:
    """Vertices of a mesh that a pin names."""
    flat = mesh.panel_vertices
    low, high = flat.min(axis=0), flat.max(axis=0)
    if table.side is not None:
        axis = 0 if table.side in ("left", "right") else 1
        extreme = low if table.side in ("left", "bottom") else high
        inside = np.abs(flat[:, axis] - extreme[axis]) <= ON_SIDE
    else:
        assert table.box is not None
        corners = np.array(table.box)
        inside = ((flat >= corners[0]) & (flat <= corners[1])).all(axis=1)
    if not inside.any():
        raise InputError(
            f"pins.{k}.box = {[list(c) for c in table.box or ()]}: no vertex lies in it; the panel reaches "
            f"from {low.round(4).tolist()} to {high.round(4).tolist()} m: make it larger"
        )
    return np.unique(mesh.panel_to_vertex[inside]).astype(np.int64)
