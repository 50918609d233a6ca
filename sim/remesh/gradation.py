"""How fast sizes may grow from place to place: good triangles need neighbours of about their own size."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.sim.remesh.metric import quadratic_form, tensor_maximum
from muslin.sim.remesh.seam_metric import agree_on_seams

Array = NDArray[np.float64]

TOLERANCE = 0.05
"""By how much, of itself, a metric may fall short of what its neighbours ask for."""

ROUNDS = 2
"""How many seams fineness may cross."""


def limit_gradation(mesh: GarmentMesh, metric: Array, growth: float = 1.5) -> Array:
    """(P, 2, 2) metric, nowhere below `metric`, in which edges of size 1 grow by about `growth` an edge.

    What vertex i asks for spreads along an edge u to j, its ellipse growing with the way in its own metric:

        M_j >= M_i / (1 + ln(growth) sqrt(u^T M_i u))^2.

    Vertices that fall short take the tensor maximum, until none does by more than `TOLERANCE`. Then both
    sides of the seams agree (`agree_on_seams`), and what they found out spreads in the next panel; twice.
    `metric` has to be positive definite; sizes may come out a little below its smallest, so `clamp` again.
    InputError unless growth > 1.

    Source: Alauzet 2010, Size gradation control of anisotropic meshes (growth in the metric's own space).
    """
    if not growth > 1.0:
        raise InputError(f"growth = {growth:g}: must be more than 1; 1.2 to 2 makes good triangles")
    start, end = _directed_edges(mesh)
    u = mesh.panel_vertices[end] - mesh.panel_vertices[start]
    limited = metric
    for _ in range(ROUNDS):
        limited = agree_on_seams(mesh, limited)
        changed = np.ones(len(limited), dtype=bool)
        while changed.any():
            spreading = np.flatnonzero(changed[start])
            source = limited[start[spreading]]
            way = np.sqrt(quadratic_form(source, u[spreading]))
            asked = source / ((1.0 + np.log(growth) * way) ** 2)[:, None, None]
            short = _falls_short(limited[end[spreading]], asked)
            changed = _raise(limited, end[spreading[short]], asked[short])
    return limited


def _falls_short(metric: Array, asked: Array) -> NDArray[np.bool_]:
    """Whether (1 + TOLERANCE) metric - asked has a negative eigenvalue, of tensors (N, 2, 2)."""
    rest = (1.0 + TOLERANCE) * metric - asked
    xx, xy, yy = rest[:, 0, 0], rest[:, 0, 1], rest[:, 1, 1]
    return (xx * yy < xy * xy) | (xx + yy < 0.0)


def _raise(metric: Array, vertex: NDArray[np.int64], asked: Array) -> NDArray[np.bool_]:
    """Raise metric[vertex] to the maximum with `asked`, in place; which vertices that were.

    One request a vertex at a time: as many turns as the busiest vertex has requests.
    """
    order = np.argsort(vertex, kind="stable")
    vertex, asked = vertex[order], asked[order]
    turn = np.arange(len(vertex)) - np.searchsorted(vertex, vertex)
    for k in range(int(turn.max(initial=-1)) + 1):
        now = turn == k
        metric[vertex[now]] = tensor_maximum(metric[vertex[now]], asked[now])
    changed = np.zeros(len(metric), dtype=bool)
    changed[vertex] = True
    return changed


def _directed_edges(mesh: GarmentMesh) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Start and end of all edges of the panels, in both directions, each once."""
    count = len(mesh.panel_vertices)
    faces = mesh.panel_faces.astype(np.int64)
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    lower, upper = np.divmod(np.unique(np.minimum(start, end) * count + np.maximum(start, end)), count)
    return np.concatenate([lower, upper]), np.concatenate([upper, lower])
