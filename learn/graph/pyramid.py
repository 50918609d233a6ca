"""All operators of one mesh that a graph U-Net needs: Laplacian, Q_d and Q_u of every level."""

from __future__ import annotations

import hashlib
import io
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from muslin.garments.errors import InputError
from muslin.learn.graph.decimate import decimate
from muslin.learn.graph.laplacian import scaled_laplacian
from muslin.learn.graph.pooling import unpool_matrix
from muslin.sim.dataset import durable

FACTOR, LEVELS = 4, 4
"""Vertices of a level over those of the next; and how many levels, the mesh itself included."""
_VERSION = 1
"""Of what is computed: part of the hash by which it is kept."""


@dataclass(frozen=True, eq=False)
class Pyramid:
    """A mesh of L levels.

    laplacians   per level (V_l, V_l), see `scaled_laplacian`
    pools        per level but the last (V_l+1,) int64: Q_d, as places of the kept vertices in level l
    unpools      per level but the last (V_l, V_l+1): Q_u, see `unpool_matrix`
    """

    laplacians: tuple[csr_array, ...]
    pools: tuple[NDArray[np.int64], ...]
    unpools: tuple[csr_array, ...]

    @property
    def counts(self) -> tuple[int, ...]:
        """Vertices of each level."""
        return tuple(laplacian.shape[0] for laplacian in self.laplacians)


def build_pyramid(
    positions: NDArray[np.floating], faces: NDArray[np.integer], levels: int = LEVELS
) -> Pyramid:
    """The pyramid of a mesh: positions (V, 3), metres, by which it is decimated; faces (F, 3).

    Raises InputError for a mesh that is none, or of too few vertices for so many levels.
    """
    if levels < 2:
        raise InputError(f"levels = {levels}; a pyramid has two at least")
    counts = [len(positions) // FACTOR**level for level in range(1, levels)]
    decimated = decimate(positions, faces, counts)
    sizes = [len(kept) for kept in decimated.kept]
    return Pyramid(
        tuple(scaled_laplacian(f, size) for f, size in zip(decimated.faces, sizes, strict=True)),
        tuple(np.searchsorted(fine, coarse) for fine, coarse in pairwise(decimated.kept)),
        tuple(unpool_matrix(positions, decimated, level) for level in range(len(counts))),
    )


class PyramidCache:
    """Pyramids by the hash of their mesh, in memory and, if a folder is given, as files in it."""

    def __init__(self, folder: Path | None = None, levels: int = LEVELS) -> None:
        self.folder, self.levels = folder, levels
        self._known: dict[str, Pyramid] = {}

    def get(self, positions: NDArray[np.floating], faces: NDArray[np.integer]) -> Pyramid:
        """`build_pyramid`, once a mesh."""
        key = self._hash(positions, faces)
        if key not in self._known:
            self._known[key] = self._stored(key) or self._made(key, positions, faces)
        return self._known[key]

    def _hash(self, positions: NDArray[np.floating], faces: NDArray[np.integer]) -> str:
        sha = hashlib.sha256(f"{_VERSION} {FACTOR} {self.levels} {positions.shape}".encode())
        sha.update(np.ascontiguousarray(positions, dtype=np.float64).data)
        sha.update(np.ascontiguousarray(faces, dtype=np.int32).data)
        return sha.hexdigest()[:32]

    def _stored(self, key: str) -> Pyramid | None:
        if self.folder is None or not (file := self.folder / f"{key}.npz").exists():
            return None
        with np.load(file, allow_pickle=False) as arrays:
            return Pyramid(
                tuple(_read(arrays, f"laplacian_{level}") for level in range(self.levels)),
                tuple(arrays[f"pool_{level}"] for level in range(self.levels - 1)),
                tuple(_read(arrays, f"unpool_{level}") for level in range(self.levels - 1)),
            )

    def _made(self, key: str, positions: NDArray[np.floating], faces: NDArray[np.integer]) -> Pyramid:
        made = build_pyramid(positions, faces, self.levels)
        if self.folder is not None:
            arrays: dict[str, Any] = {f"pool_{level}": pool for level, pool in enumerate(made.pools)}
            for name, matrices in (("laplacian", made.laplacians), ("unpool", made.unpools)):
                for level, matrix in enumerate(matrices):
                    arrays |= _written(matrix, f"{name}_{level}")
            durable.make_folder(self.folder)
            stream = io.BytesIO()
            np.savez(stream, **arrays)
            durable.write_file(self.folder / f"{key}.npz", stream.getvalue())
        return made


def _written(matrix: csr_array, name: str) -> dict[str, np.ndarray]:
    parts = {"data": matrix.data, "indices": matrix.indices, "indptr": matrix.indptr}
    return {f"{name}_{part}": array for part, array in parts.items()} | {
        f"{name}_shape": np.array(matrix.shape)
    }


def _read(arrays: np.lib.npyio.NpzFile, name: str) -> csr_array:
    parts = tuple(arrays[f"{name}_{part}"] for part in ("data", "indices", "indptr"))
    return csr_array(parts, shape=tuple(arrays[f"{name}_shape"]))
