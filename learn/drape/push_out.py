"""Penetration removed after prediction, by the least and smoothest displacement out of the body."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Generic

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.linalg import solve
from scipy.sparse.linalg import splu
from torch import Tensor

from muslin.garments.mesh import GarmentMesh
from muslin.learn.drape.body_surface import BodySurface
from muslin.learn.drape.smoothing import sewn_operators, smoothing_matrix
from muslin.learn.drape.world import Draper, Prepared, World

CLEARANCE = 0.001
"""Metres from the body at which vertices that were inside are put."""
LENGTH = 0.015
"""Metres over which what is beside them comes along."""
MOST_ROUNDS = 20


Nearest = Callable[
    [NDArray[np.float64]], tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
]
"""Distances (P,), nearest points (P, 3) and normals there (P, 3), see `BodySurface.nearest`."""


class PushOut:
    """For one mesh: with A of `smoothing_matrix`, the displacement d of least d^T A d in which every vertex i
    that was inside goes to its place outside,

        d = A^-1 P^T (P A^-1 P^T)^-1 t,   t_i = c_i + CLEARANCE n_i - x_i,

    P picking those vertices, c_i the nearest point of the body to x_i and n_i its normal there. Vertices
    which that brings into the body join them, and so on until there is none.
    """

    def __init__(self, mesh: GarmentMesh) -> None:
        self._factors = splu(smoothing_matrix(*sewn_operators(mesh), LENGTH))

    def __call__(self, x: NDArray[np.floating], nearest_of: Nearest) -> NDArray[np.float64]:
        """Positions (V, 3) from positions x, metres; nearest_of: the body's, of points (P, 3)."""
        start = np.asarray(x, dtype=np.float64)
        moved, target = start, np.full_like(start, np.nan)
        for _ in range(MOST_ROUNDS):
            distances, nearest, normals = nearest_of(moved)
            inside = np.flatnonzero(distances < 0.0)
            if not len(inside):
                break
            target[inside] = nearest[inside] + CLEARANCE * normals[inside]
            picked = np.flatnonzero(np.isfinite(target[:, 0]))
            columns = np.zeros((len(start), len(picked)))
            columns[picked, np.arange(len(picked))] = 1.0
            reached = self._factors.solve(columns)
            forces = solve(reached[picked], target[picked] - start[picked], assume_a="pos")
            moved = start + reached @ forces
        return moved


class PushedOut(Generic[Prepared]):
    """What another drapes, taken out of the body by `PushOut`."""

    def __init__(self, draper: Draper[Prepared]) -> None:
        self.draper, self.body = draper, BodySurface(draper.world)

    @property
    def world(self) -> World:
        return self.draper.world

    def prepare(self, mesh: GarmentMesh) -> tuple[Prepared, PushOut]:
        return self.draper.prepare(mesh), PushOut(mesh)

    def drapes(
        self, garments: Sequence[tuple[Prepared, PushOut]], betas: Sequence[Any], fabrics: Sequence[str]
    ) -> list[Tensor]:
        said = self.draper.drapes([garment for garment, _ in garments], betas, fabrics)
        moved = [
            push(drape.numpy(), partial(self.body.nearest, beta=beta))
            for (_, push), drape, beta in zip(garments, said, betas, strict=True)
        ]
        return [torch.from_numpy(drape.astype(np.float32)) for drape in moved]
