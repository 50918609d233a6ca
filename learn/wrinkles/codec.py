"""Between values at the vertices of a garment and maps."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csc_array, csr_array, diags_array, vstack
from scipy.sparse.linalg import SuperLU, splu

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.learn.wrinkles.layout import MapLayout

BENDING = 1e-3
"""Weight of the map's second differences against the values at the vertices."""


class MapCodec:
    """Maps of one mesh: m (N, C) are the texels of the mask, d (V, C) values at sewn vertices.

    decode   d = W B m: B interpolates bilinearly at the uv of each panel vertex; W takes the mean over the
             panel vertices of a sewn vertex, so that a seam is closed whatever the map says on its two sides
    encode   the smoothest map that decodes to d, on each side of a seam alike:

                 m = argmin |B m - R d|^2 + BENDING |D m|^2,

             R d the value of its sewn vertex at every panel vertex, D second differences within an island
             (rows, columns, and the mixed one of each square of texels, twice). Where there are fewer
             vertices than texels this is a thin plate through them; beyond the rim it goes on straight, so
             islands come out dilated. (Duchon 1977, "Splines minimizing rotation-invariant semi-norms".)
    """

    def __init__(self, layout: MapLayout, mesh: GarmentMesh) -> None:
        """Raises InputError for a mesh of another family."""
        if mesh.name != layout.design:
            raise InputError(f"a garment of design {mesh.name!r} on maps of design {layout.design!r}")
        self.layout, self.mesh = layout, mesh
        self._read = layout.bilinear(mesh.uv)
        sides = np.bincount(mesh.panel_to_vertex)
        entries = 1.0 / sides[mesh.panel_to_vertex], (mesh.panel_to_vertex, np.arange(len(mesh.uv)))
        self._weld = coo_matrix(entries, shape=(mesh.num_vertices, len(mesh.uv))).tocsr()
        self.matrix: csr_array = csr_array(self._weld @ self._read)
        """(V, N) W B."""

    def decode(self, values: NDArray[np.floating]) -> NDArray[np.float64]:
        """(..., V, C) at vertices, from (..., N, C) at texels."""
        return _columns(self.matrix.__matmul__, np.asarray(values, dtype=np.float64))

    def encode(self, values: NDArray[np.floating]) -> NDArray[np.float64]:
        """(..., N, C) at texels, from (..., V, C) at vertices."""
        target = np.asarray(values, dtype=np.float64)[..., self.mesh.panel_to_vertex, :]
        return _columns(lambda flat: self._factors.solve(self._read.T @ flat), target)

    def gaps(self, values: NDArray[np.floating]) -> NDArray[np.float64]:
        """(..., P) how far each panel vertex is, by the map (..., N, C), from where it is sewn to."""
        flat = np.asarray(values, dtype=np.float64)
        apart = _columns(self._read.__matmul__, flat) - self.decode(flat)[..., self.mesh.panel_to_vertex, :]
        return np.linalg.norm(apart, axis=-1)

    @cached_property
    def _factors(self) -> SuperLU:
        bent = second_differences(self.layout)
        normal = self._read.T @ self._read + BENDING * (bent.T @ bent)
        # An island that no vertex reads has no smoothest map; a hair of its own size decides.
        ridge = 1e-9 * diags_array(np.ones(self.layout.count))
        return splu(csc_array(normal + ridge), permc_spec="MMD_AT_PLUS_A")


def second_differences(layout: MapLayout) -> csr_array:
    """(K, N) second differences of the mask's texels, each within one island."""
    number, islands = layout.number(), layout.islands
    parts = []
    for axis in (0, 1):
        own, mine = np.moveaxis(number, axis, 0), np.moveaxis(islands, axis, 0)
        parts.append(_stencil([own[:-2], own[1:-1], own[2:]], [mine[:-2], mine[1:-1], mine[2:]], (1, -2, 1)))
    corners = [(slice(None, -1), slice(None, -1)), (slice(None, -1), slice(1, None)),
               (slice(1, None), slice(None, -1)), (slice(1, None), slice(1, None))]  # fmt: skip
    square = [number[corner] for corner in corners], [islands[corner] for corner in corners]
    parts.append(np.sqrt(2.0) * _stencil(*square, (1, -1, -1, 1)))
    matrix = vstack(parts)
    return csr_array((matrix.data, matrix.indices, matrix.indptr), shape=(matrix.shape[0], layout.count))


def _stencil(
    numbers: list[NDArray[np.int64]], islands: list[NDArray[np.int64]], weights: tuple[int, ...]
) -> csr_array:
    """One row wherever all texels of the stencil are of one island."""
    same = islands[0] >= 0
    for other in islands[1:]:
        same = same & (other == islands[0])
    columns = np.stack([own[same] for own in numbers], axis=1)
    rows = np.repeat(np.arange(len(columns)), len(weights))
    values = np.tile(np.asarray(weights, dtype=np.float64), len(columns))
    size = max(int(own.max()) for own in numbers) + 1
    return csr_array(coo_matrix((values, (rows, columns.ravel())), shape=(len(columns), size)))


def _columns(product, values):  # type: ignore[no-untyped-def]
    """A matrix product with (..., A, C) as one with (A, ...C), back to (..., B, C)."""
    leading, rows = values.shape[:-2], values.shape[-2]
    flat = np.moveaxis(values.reshape(-1, *values.shape[-2:]), 0, 1).reshape(rows, -1)
    found = product(flat)
    back = found.reshape(len(found), -1, values.shape[-1])
    return np.moveaxis(back, 1, 0).reshape(*leading, len(found), values.shape[-1])
