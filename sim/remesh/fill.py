"""Triangulation of panels whose boundaries are sampled: vertices are added and moved until it is regular."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.garments.half_edges import opposite
from muslin.sim.remesh import passes, relax
from muslin.sim.remesh.metric import eigenvalues
from muslin.sim.remesh.panel_mesh import FREE, PanelMesh, empty_mesh, faces_of
from muslin.sim.remesh.rings import Rings

LONGEST, SHORTEST = 1.4, 0.7
"""Edges longer than the one are split, shorter than the other collapsed: sqrt 2 apart either way from 1, so
that halves of the one are not at once too short."""

COARSENING = 1.5
"""Splitting begins with the longest edges and goes on to ones so much shorter each time, so that vertices
spread evenly before there are many of them."""

BALANCES, SWEEPS, FINAL_SWEEPS = 3, 2, 12
MENDS, MEND_SWEEPS = 4, 10
"""How often the metric is asked for again while bad triangles are mended, and sweeps in between."""

Metric = Callable[[NDArray[np.float64], NDArray[np.int32]], NDArray[np.float64]]
"""Metric (N, 2, 2) at points (N, 2) of panels (N,)."""


@dataclass(frozen=True, eq=False)
class Filling:
    """Triangulated panels: points (P, 2), metres, those of the rim first; faces (F, 3), and panel (F,)."""

    points: NDArray[np.float64]
    faces: NDArray[np.int32]
    panel: NDArray[np.int32]


def fill(
    rim: NDArray[np.float64],
    panel: NDArray[np.int32],
    boundary: Rings,
    wanted: NDArray[np.int64],
    metric: Metric,
    enough: float,
    rng: np.random.Generator,
) -> Filling:
    """Triangles within the boundary (R, 2), of panels (R,), that the rings make of it; it stays as it is.

    wanted: interior vertices of each panel; they are reached exactly, where edges as long as LONGEST allow.
    metric: asked again whenever vertices have moved.
    enough: quality (`relax.quality`) below which triangles are mended one by one.
    Raises InputError if a boundary crosses itself.
    """
    mesh = _rim_only(rim, metric(rim, panel), int(wanted.sum()))
    _clip(mesh, boundary)
    table = _Table(mesh, _int32(wanted), metric, len(rim), rng)
    longest = float(np.ptp(rim, axis=0).max() * np.sqrt(eigenvalues(mesh.metric.numpy()[: len(rim)]).max()))
    while True:
        made = table.split(longest)
        if made:
            table.relax(SWEEPS)
        elif longest <= LONGEST:
            break
        longest = max(longest / COARSENING, LONGEST)
    for _ in range(BALANCES):
        table.collapse()
        table.split(0.5 * (1.0 + LONGEST))
        table.relax(SWEEPS)
    table.relax(FINAL_SWEEPS)
    table.mend(enough)
    return _compacted(mesh, len(rim))


class _Table:
    """The mesh of a filling under way, and what its passes need."""

    def __init__(
        self, mesh: PanelMesh, room: wp.array, metric: Metric, rim: int, rng: np.random.Generator
    ) -> None:
        self.mesh, self.room, self.metric, self.rim, self.rng = mesh, room, metric, rim, rng

    def split(self, longest: float) -> int:
        made = _int32([0])
        inputs = [self.mesh, self._order(), wp.float64(longest), self.room, made]
        wp.launch(passes.split_longest, 1, inputs=inputs, device="cpu")
        return int(made.numpy()[0])

    def collapse(self) -> int:
        made = _int32([0])
        inputs = [self.mesh, self._order(), wp.float64(SHORTEST), wp.float64(LONGEST), self.room, made]
        wp.launch(passes.collapse_shortest, 1, inputs=inputs, device="cpu")
        return int(made.numpy()[0])

    def relax(self, sweeps: int) -> None:
        wp.launch(passes.flip_to_delaunay, 1, inputs=[self.mesh, 100], device="cpu")
        wp.launch(relax.relax, 1, inputs=[self.mesh, sweeps], device="cpu")
        self._measure()

    def mend(self, enough: float) -> None:
        for _ in range(MENDS):
            bad = _int32([0])
            wp.launch(relax.mend, 1, inputs=[self.mesh, MEND_SWEEPS, wp.float64(enough), bad], device="cpu")
            if bad.numpy()[0] == 0:
                break
            self._measure()

    def _order(self) -> wp.array:
        """Half-edges in an order drawn at random: which vertices come where depends on the seed alone."""
        return _int32(self.rng.permutation(3 * int(self.mesh.size.numpy()[1])))

    def _measure(self) -> None:
        """Asks for the metric of interior vertices where they are now."""
        leaving = self.mesh.leaving.numpy()
        vertex = np.flatnonzero(leaving >= 0)
        vertex = vertex[vertex >= self.rim]
        points = self.mesh.point.numpy()[vertex]
        panel = self.mesh.panel.numpy()[leaving[vertex] // 3]
        self.mesh.metric.numpy()[vertex] = self.metric(points, panel)


def _rim_only(rim: NDArray[np.float64], metric: NDArray[np.float64], interior: int) -> PanelMesh:
    mesh = empty_mesh(len(rim) + interior)
    mesh.point.numpy()[: len(rim)] = rim
    mesh.metric.numpy()[: len(rim)] = metric
    mesh.on_rim.numpy()[: len(rim)] = 1
    mesh.size.numpy()[0] = len(rim)
    return mesh


def _clip(mesh: PanelMesh, rings: Rings) -> None:
    left = _int32(np.zeros(len(rings.first)))
    arrays = [rings.panel, rings.first, rings.length, rings.before, rings.after, rings.vertex]
    no_face = np.full(len(rings.vertex), int(FREE))
    inputs = [mesh, *(_int32(array) for array in arrays), _int32(no_face), left]
    wp.launch(passes.clip_ears, 1, inputs=inputs, device="cpu")
    stuck = np.flatnonzero(left.numpy())
    if len(stuck):
        raise InputError(
            f"panel {rings.panel[stuck[0]]}: its boundary crosses itself where it is sampled; "
            "choose a smaller area"
        )
    _close_bridges(mesh)


def _close_bridges(mesh: PanelMesh) -> None:
    """Makes the two sides of bridges to holes twins: to `clip_ears` either is boundary."""
    corner, twin, leaving = mesh.corner.numpy(), mesh.twin.numpy(), mesh.leaving.numpy()
    rim = np.flatnonzero(twin[: 3 * int(mesh.size.numpy()[1])] == int(FREE))
    tail, head = corner[rim], corner[np.where(rim % 3 == 2, rim - 2, rim + 1)]
    there = opposite(tail, head, len(leaving))
    bridge = there >= 0
    twin[rim[bridge]] = rim[there[bridge]]
    leaving[tail[~bridge]] = rim[~bridge]


def _compacted(mesh: PanelMesh, rim: int) -> Filling:
    faces, panel = faces_of(mesh)
    used = np.unique(np.concatenate([np.arange(rim), faces.ravel()]))
    number = np.zeros(len(mesh.point), dtype=np.int32)
    number[used] = np.arange(len(used))
    return Filling(mesh.point.numpy()[used], number[faces], panel)


def _int32(values: NDArray[np.generic] | list[int]) -> wp.array:
    return wp.array(np.asarray(values, dtype=np.int32), dtype=wp.int32, device="cpu")
