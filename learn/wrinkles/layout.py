"""The texels of a square map over the uv layout of a family of garments."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_array

from muslin.garments.errors import InputError
from muslin.garments.template import template

SMALLEST, LARGEST = 16, 1024
REACH = 1.5
"""Texels by which islands are dilated: bilinear interpolation at a point reads texels up to sqrt(2) away."""


@dataclass(frozen=True, eq=False)
class MapLayout:
    """Which texels of a map belong to which panel. The centre of texel (row i, column j) is

        uv = ((j + 1/2) / size, (i + 1/2) / size).

    design   family whose layout it is
    islands  (size, size) int: the panel nearest to the centre of each texel, if within REACH texels; else -1
    """

    design: str
    size: int
    islands: NDArray[np.int64]

    @property
    def mask(self) -> NDArray[np.bool_]:
        """(size, size): texels that the garment reads, the islands dilated by REACH."""
        return self.islands >= 0

    @property
    def count(self) -> int:
        """Number N of texels of the mask."""
        return int(np.count_nonzero(self.mask))

    def number(self) -> NDArray[np.int64]:
        """(size, size): place of each texel among those of the mask, row by row; -1 outside."""
        return np.where(self.mask, np.cumsum(self.mask).reshape(self.islands.shape) - 1, -1)

    def image(self, values: NDArray[np.floating]) -> NDArray[np.float32]:
        """(..., C, size, size) with values (..., N, C) at the texels of the mask and 0 elsewhere."""
        shape = *values.shape[:-2], values.shape[-1], self.size, self.size
        found = np.zeros(shape, dtype=np.float32)
        found[..., self.mask] = np.swapaxes(values, -1, -2)
        return found

    def values(self, image: NDArray[np.floating]) -> NDArray[np.floating]:
        """The inverse of `image`: (..., N, C) of an image (..., C, size, size)."""
        return np.swapaxes(image[..., self.mask], -1, -2)

    def bilinear(self, uv: NDArray[np.float64]) -> csr_array:
        """(P, N): takes values of the mask's texels to points uv (P, 2) by bilinear interpolation.

        The share of a texel outside of the mask, which only points outside of the layout have, goes to the
        other texels of the point. Raises InputError for a point that reads no texel of the mask.
        """
        # Centres of texels lie on the integers; a point at the rim of the square reads the last ones.
        place = np.clip(uv * self.size - 0.5, 0.0, self.size - 1.0)
        low = np.minimum(place.astype(np.int64), self.size - 2)
        part = place - low
        number, rows, columns, weights = self.number(), [], [], []
        for di in (0, 1):
            for dj in (0, 1):
                found = number[low[:, 1] + di, low[:, 0] + dj]
                weight = np.abs(1 - di - part[:, 1]) * np.abs(1 - dj - part[:, 0])
                read = np.flatnonzero((found >= 0) & (weight > 0.0))
                rows.append(read)
                columns.append(found[read])
                weights.append(weight[read])
        entries = np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns))
        matrix = coo_matrix(entries, shape=(len(uv), self.count)).tocsr()
        total = np.asarray(matrix.sum(axis=1)).ravel()
        if (total <= 0.0).any():
            bad = int(np.argmin(total))
            raise InputError(
                f"uv[{bad}] = {uv[bad].tolist()} lies outside of the layout of design {self.design!r}; give "
                "a garment of that family"
            )
        matrix.data /= np.repeat(total, np.diff(matrix.indptr))
        return csr_array(matrix)


@lru_cache(maxsize=8)
def map_layout(design: str, size: int) -> MapLayout:
    """The layout of a design of the catalogue, which all its members share.

    Raises InputError for a size that is not even or not from SMALLEST to LARGEST, and an unknown design.
    """
    if size % 2 or not SMALLEST <= size <= LARGEST:
        raise InputError(f"map size {size}: must be even, from {SMALLEST} to {LARGEST}")
    mesh = template(design, {})
    centres = (np.arange(size) + 0.5) / size
    points = np.stack([*np.meshgrid(centres, centres), np.zeros((size, size))], axis=-1).reshape(-1, 3)
    flat = np.pad(mesh.uv, ((0, 0), (0, 1)))
    squared, nearest, _ = igl.point_mesh_squared_distance(points, flat, mesh.panel_faces.astype(np.int64))
    near = np.sqrt(squared) * size <= REACH
    islands = np.where(near, mesh.face_panel[nearest], -1).reshape(size, size)
    return MapLayout(design, size, islands.astype(np.int64))
