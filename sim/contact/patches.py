"""Cloth and collider cut into patches and groups, the units in which contacts are looked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from muslin.sim.cloth import ClothModel

Integers = NDArray[np.signedinteger[Any]]

PATCH_SIZE = 48
"""Vertices that a patch has at most: so many move nearly as one."""

GROUP_SIZE = 6
"""Vertices that a group, a part of a patch, has at most."""


@dataclass(frozen=True)
class Rows:
    """Rows in the order of the sets they belong to; those of set k are offsets[k] to offsets[k + 1]."""

    rows: NDArray[np.int32]
    offsets: NDArray[np.int32]


@dataclass(frozen=True)
class Patches:
    """Cloth and collider in P patches, the first `num_cloth` of the cloth, and these in G groups.

    Groups `groups` [k] to [k + 1] are those of patch k. Every vertex (V + N, 1), edge (E, 2) and face (F, 3)
    is in one group, that of its first vertex; `touched` (T, 1) are the vertices of a set's primitives.
    """

    num_cloth: int
    groups: NDArray[np.int32]
    vertices: Rows
    edges: Rows
    faces: Rows
    touched_by_patch: Rows
    touched_by_group: Rows

    @property
    def count(self) -> int:
        return len(self.groups) - 1


def cut_cloth(points: NDArray[np.float64], cloth: ClothModel) -> Patches:
    """Patches of a cloth at `points` (V, 3)."""
    return _cut(points, cloth.edges, cloth.faces)


def cut_collider(points: NDArray[np.float64], faces: NDArray[np.int32]) -> Patches | None:
    """Patches of a collider at `points` (N, 3); None if it has no faces."""
    return _cut(points, igl.edges(faces.astype(np.int64)), faces) if len(faces) else None


def joined(cloth: Patches, collider: Patches | None, num_vertices: int) -> Patches:
    """Patches of a cloth of so many vertices, then those of a collider, whose vertices follow."""
    if collider is None:
        return cloth

    def both(name: str) -> Rows:
        return _after(getattr(cloth, name), getattr(collider, name), num_vertices)

    return Patches(
        num_cloth=cloth.num_cloth,
        groups=np.concatenate([cloth.groups, collider.groups[1:] + cloth.groups[-1]]),
        vertices=both("vertices"),
        edges=both("edges"),
        faces=both("faces"),
        touched_by_patch=both("touched_by_patch"),
        touched_by_group=both("touched_by_group"),
    )


def _cut(
    points: NDArray[np.float64], edges: NDArray[np.signedinteger[Any]], faces: NDArray[np.int32]
) -> Patches:
    patch = _bisect(points, _pieces(len(points), faces), PATCH_SIZE)
    group = _bisect(points, patch, GROUP_SIZE)
    num_patches, num_groups = int(patch.max()) + 1, int(group.max()) + 1
    patch_of_group = np.zeros(num_groups, np.int64)
    patch_of_group[group] = patch
    return Patches(
        num_cloth=num_patches,
        groups=np.searchsorted(patch_of_group, np.arange(num_patches + 1)).astype(np.int32),
        vertices=_in_order(np.arange(len(points))[:, None], group, num_groups),
        edges=_in_order(edges, group[edges[:, 0]], num_groups),
        faces=_in_order(faces, group[faces[:, 0]], num_groups),
        touched_by_patch=_touched(patch, edges, faces),
        touched_by_group=_touched(group, edges, faces),
    )


def _after(first: Rows, second: Rows, num_vertices: int) -> Rows:
    """Rows of sets, then of sets over vertices that are numbered after so many."""
    rows = np.concatenate([first.rows, second.rows + np.int32(num_vertices)])
    return Rows(rows, np.concatenate([first.offsets, second.offsets[1:] + first.offsets[-1]]))


def _touched(
    sets: NDArray[np.int64], edges: NDArray[np.signedinteger[Any]], faces: NDArray[np.int32]
) -> Rows:
    """The vertices of each set, and those of its edges and faces."""
    count = len(sets)
    reached = [sets[rows[:, 0]] * count + ends for rows in (edges, faces) for ends in rows.T]
    # As numbers, which sort many times faster than rows.
    both = np.unique(np.concatenate([sets * count + np.arange(count), *reached]))
    return _in_order((both % count)[:, None], both // count, int(sets.max()) + 1)


def _in_order(rows: Integers, sets: NDArray[np.int64], count: int) -> Rows:
    order = np.argsort(sets, kind="stable")
    offsets = np.searchsorted(sets[order], np.arange(count + 1))
    return Rows(rows[order].astype(np.int32), offsets.astype(np.int32))


def _pieces(num_vertices: int, faces: NDArray[np.int32]) -> NDArray[np.int64]:
    """Connected piece of each vertex, so that layers of cloth share no patch.

    Those smaller than a patch count as one.
    """
    first, second = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]]).T
    graph = coo_array((np.ones(len(first)), (first, second)), shape=(num_vertices, num_vertices))
    _, piece = connected_components(graph, directed=False)
    small = np.bincount(piece)[piece] < PATCH_SIZE
    return np.unique(np.where(small, -1, piece), return_inverse=True)[1]


def _bisect(points: NDArray[np.float64], sets: NDArray[np.int64], size: int) -> NDArray[np.int64]:
    """Sets (n,) of no more than `size` points: halves of those given, across their longest extent.

    Parts of a set follow each other, in the order of the sets.
    """
    while True:
        sizes = np.bincount(sets)
        if sizes.max() <= size:
            return sets
        order = np.argsort(sets, kind="stable")
        starts = np.cumsum(sizes) - sizes
        extents = np.maximum.reduceat(points[order], starts) - np.minimum.reduceat(points[order], starts)
        along = points[np.arange(len(points)), np.argmax(extents, axis=1)[sets]]
        order = np.lexsort((along, sets))
        rank = np.empty(len(points), np.int64)
        rank[order] = np.arange(len(points))
        upper = (sizes[sets] > size) & (rank - starts[sets] >= sizes[sets] // 2)
        sets = np.unique(2 * sets + upper, return_inverse=True)[1]
