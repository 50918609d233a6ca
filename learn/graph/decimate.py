"""Decimation of a triangle mesh by quadric errors onto a subset of its vertices.

Sources: Garland, Heckbert 1997, "Surface simplification using quadric error metrics"; that every edge goes
onto one of its ends, so that coarse vertices are fine ones, after Ranjan et al. 2018, "Generating 3D faces
using convolutional mesh autoencoders".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.garments.mesh import validate_manifold

wp.set_module_options({"enable_backward": False})

EVENNESS = wp.constant(wp.float64(1.0e-3))
"""Weight of squared edge lengths beside squared distances: flat cloth, where all errors are zero, is thinned
out evenly."""
RIM = wp.constant(wp.float64(10.0))
"""Weight of planes through boundary edges."""
TURN = wp.constant(wp.float64(0.2))
"""Least cosine by which a normal may turn in one collapse."""
FORBIDDEN = wp.constant(wp.float64(1.0e300))


@dataclass(frozen=True, eq=False)
class Decimated:
    """A mesh and what is left of it, level by level; level 0 is the mesh itself.

    kept     per level (V_l,) int32: its vertices, as vertices of level 0, ascending
    faces    per level (F_l, 3) int32, over its own vertices
    onto     per level but the last (V_l,) int32: for each of its vertices the one of the next level that it
             went onto, by one collapse after the other; itself, where it is kept
    """

    kept: tuple[NDArray[np.int32], ...]
    faces: tuple[NDArray[np.int32], ...]
    onto: tuple[NDArray[np.int32], ...]


def decimate(positions: NDArray[np.floating], faces: NDArray[np.integer], counts: Sequence[int]) -> Decimated:
    """Collapse edges, cheapest first, down to so many vertices a level.

    positions (V, 3), metres; faces (F, 3) of an oriented manifold; counts: of vertices, descending, below V.

    A vertex v goes onto its neighbour u of least error

        (Q_v + Q_u)(x_u) + EVENNESS (a_v + a_u) |x_v - x_u|^2,   Q_v(x) = sum_f a_f ((x - x_f) . n_f)^2,

    a_v = sum_f a_f / 3 over its faces, with planes along boundary edges added (weight RIM), where the surface
    stays a manifold of the same kind, boundaries stay boundaries and no face turns over. A level has more
    vertices than asked for where no collapse is left that may be. Raises InputError for meshes that are none.
    """
    x = np.ascontiguousarray(positions, dtype=np.float64)
    f = np.ascontiguousarray(faces, dtype=np.int32)
    if x.ndim != 2 or x.shape[1] != 3 or f.ndim != 2 or f.shape[1] != 3 or not len(f):
        raise InputError(f"positions {x.shape} and faces {f.shape}; they must be (V, 3) and (F, 3), F > 0")
    if not np.isfinite(x).all() or f.min() < 0 or f.max() >= len(x):
        raise InputError("positions must be finite, and faces index them")
    validate_manifold(f, "the mesh")
    if len(np.unique(f)) != len(x):
        raise InputError("a vertex belongs to no face; remove it")
    wanted = np.array(counts, dtype=np.int32)
    if len(wanted) == 0 or (np.diff(wanted) >= 0).any() or wanted[-1] < 1 or wanted[0] >= len(x):
        raise InputError(
            f"counts = {list(counts)}: must descend from below the {len(x)} vertices to 1 at least"
        )
    rank, parent, levels = _collapsed(x, f, wanted)
    kept, flat, onto = [np.arange(len(x), dtype=np.int32)], [f], []
    for level in range(len(wanted)):
        alive = np.flatnonzero(rank > level).astype(np.int32)
        number = np.full(len(x), -1, dtype=np.int32)
        number[alive] = np.arange(len(alive), dtype=np.int32)
        goal = _followed(parent, rank > level)
        onto.append(number[goal[kept[-1]]])
        left = levels[level][levels[level][:, 0] >= 0]
        kept.append(alive)
        flat.append(number[left])
    return Decimated(tuple(kept), tuple(flat), tuple(onto))


def _followed(parent: NDArray[np.int32], alive: NDArray[np.bool_]) -> NDArray[np.int32]:
    """For each vertex the first of its line of parents that is alive."""
    goal = np.where(alive, np.arange(len(parent), dtype=np.int32), parent)
    while not alive[goal].all():
        goal = goal[goal]
    return goal


def _collapsed(
    x: NDArray[np.float64], f: NDArray[np.int32], wanted: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """rank (V,): number of levels below which a vertex is kept, at most; parent (V,); faces (levels, F, 3),
    -1 where they are gone."""
    count, width = len(x), 1 << int(np.ceil(np.log2(len(x))))
    mesh = _Mesh()
    mesh.x = wp.array(x, dtype=wp.vec3d, device="cpu")
    mesh.faces = wp.array(f.copy(), dtype=wp.int32, ndim=2, device="cpu")
    mesh.first, mesh.last = (wp.full(count, -1, dtype=wp.int32, device="cpu") for _ in range(2))
    mesh.after = wp.full(3 * len(f), -1, dtype=wp.int32, device="cpu")
    mesh.quadric = wp.zeros((count, 10), dtype=wp.float64, device="cpu")
    mesh.area = wp.zeros(count, dtype=wp.float64, device="cpu")
    mesh.mark, mesh.rim = (wp.zeros(count, dtype=wp.int32, device="cpu") for _ in range(2))
    parent = wp.array(np.arange(count, dtype=np.int32), device="cpu")
    rank = wp.full(count, len(wanted) + 1, dtype=wp.int32, device="cpu")
    levels = wp.full((len(wanted), len(f), 3), -1, dtype=wp.int32, device="cpu")
    tree = wp.full(2 * width, np.inf, dtype=wp.float64, device="cpu")
    inputs: list[Any] = [mesh, wp.array(wanted, device="cpu"), width, tree, parent, rank, levels]
    wp.launch(_collapse_all, dim=1, inputs=inputs, device="cpu")
    return rank.numpy(), parent.numpy(), levels.numpy()


@wp.struct
class _Mesh:
    """first, last, after: lists of the corners (3 f + k) of each vertex, of which those of faces that are
    gone (faces[f, 0] < 0) are passed over. mark: scratch. rim: 1 on the boundary. area: a_v."""

    x: wp.array(dtype=wp.vec3d)
    faces: wp.array2d(dtype=wp.int32)
    first: wp.array(dtype=wp.int32)
    last: wp.array(dtype=wp.int32)
    after: wp.array(dtype=wp.int32)
    quadric: wp.array2d(dtype=wp.float64)
    area: wp.array(dtype=wp.float64)
    mark: wp.array(dtype=wp.int32)
    rim: wp.array(dtype=wp.int32)


@wp.func
def _add_plane(mesh: _Mesh, v: int, n: wp.vec3d, d: wp.float64, weight: wp.float64):
    """weight (n . x + d)^2 to the quadric of v."""
    mesh.quadric[v, 0] += weight * n[0] * n[0]
    mesh.quadric[v, 1] += weight * n[0] * n[1]
    mesh.quadric[v, 2] += weight * n[0] * n[2]
    mesh.quadric[v, 3] += weight * n[1] * n[1]
    mesh.quadric[v, 4] += weight * n[1] * n[2]
    mesh.quadric[v, 5] += weight * n[2] * n[2]
    mesh.quadric[v, 6] += weight * n[0] * d
    mesh.quadric[v, 7] += weight * n[1] * d
    mesh.quadric[v, 8] += weight * n[2] * d
    mesh.quadric[v, 9] += weight * d * d


@wp.func
def _error(mesh: _Mesh, v: int, x: wp.vec3d) -> wp.float64:
    two = wp.float64(2.0)
    q = mesh.quadric
    square = q[v, 0] * x[0] * x[0] + q[v, 3] * x[1] * x[1] + q[v, 5] * x[2] * x[2]
    mixed = q[v, 1] * x[0] * x[1] + q[v, 2] * x[0] * x[2] + q[v, 4] * x[1] * x[2]
    linear = q[v, 6] * x[0] + q[v, 7] * x[1] + q[v, 8] * x[2]
    return square + two * (mixed + linear) + q[v, 9]


@wp.func
def _normal(mesh: _Mesh, a: int, b: int, c: int) -> wp.vec3d:
    """Not normalised."""
    return wp.cross(mesh.x[b] - mesh.x[a], mesh.x[c] - mesh.x[a])


@wp.func
def _shared(mesh: _Mesh, v: int, u: int) -> int:
    """Number of faces that have both vertices."""
    count = int(0)
    c = mesh.first[v]
    while c >= 0:
        f = c // 3
        k = c % 3
        if mesh.faces[f, 0] >= 0 and (mesh.faces[f, (k + 1) % 3] == u or mesh.faces[f, (k + 2) % 3] == u):
            count += 1
        c = mesh.after[c]
    return count


@wp.func
def _face_count(mesh: _Mesh, v: int) -> int:
    count = int(0)
    c = mesh.first[v]
    while c >= 0:
        if mesh.faces[c // 3, 0] >= 0:
            count += 1
        c = mesh.after[c]
    return count


@wp.func
def _may_go(mesh: _Mesh, v: int, u: int) -> bool:
    """Whether the surface stays what it is when v goes onto its neighbour u."""
    shared = _shared(mesh, v, u)
    if mesh.rim[v] == 1 and shared != 1:
        return False
    # Link condition: no neighbours in common but those across the edge.
    c = mesh.first[u]
    while c >= 0:
        f = c // 3
        if mesh.faces[f, 0] >= 0:
            mesh.mark[mesh.faces[f, 0]] = 1
            mesh.mark[mesh.faces[f, 1]] = 1
            mesh.mark[mesh.faces[f, 2]] = 1
        c = mesh.after[c]
    common = int(0)
    mesh.mark[u] = 0
    mesh.mark[v] = 0
    fits = bool(True)
    c = mesh.first[v]
    while c >= 0:
        f = c // 3
        k = c % 3
        if mesh.faces[f, 0] >= 0:
            i = mesh.faces[f, (k + 1) % 3]
            j = mesh.faces[f, (k + 2) % 3]
            common += mesh.mark[i] + mesh.mark[j]
            mesh.mark[i] = 0
            mesh.mark[j] = 0
            if i == u or j == u:
                # The third vertex loses this face, and needs another one.
                if _face_count(mesh, i + j - u) < 2:
                    fits = False
            else:
                before = _normal(mesh, v, i, j)
                after = _normal(mesh, u, i, j)
                if wp.dot(before, after) <= TURN * wp.length(before) * wp.length(after):
                    fits = False
        c = mesh.after[c]
    c = mesh.first[u]
    while c >= 0:
        f = c // 3
        if mesh.faces[f, 0] >= 0:
            mesh.mark[mesh.faces[f, 0]] = 0
            mesh.mark[mesh.faces[f, 1]] = 0
            mesh.mark[mesh.faces[f, 2]] = 0
        c = mesh.after[c]
    # Two faces around a point would lie on each other, as of a tetrahedron.
    left = _face_count(mesh, v) + _face_count(mesh, u) - 2 * shared
    return fits and common == shared and left >= 3 - 2 * mesh.rim[u]


@wp.func
def _goal(mesh: _Mesh, v: int) -> int:
    """The neighbour onto which v goes at least error; -1 if it may go nowhere."""
    best = FORBIDDEN
    goal = int(-1)
    c = mesh.first[v]
    while c >= 0:
        f = c // 3
        if mesh.faces[f, 0] >= 0:
            # In a closed fan the first of the other corners of each face are all neighbours.
            for k in range(1, 2 + mesh.rim[v]):
                u = mesh.faces[f, (c % 3 + k) % 3]
                cost = _cost(mesh, v, u)
                better = cost < best or (cost == best and u < goal)
                if better and _may_go(mesh, v, u):
                    best = cost
                    goal = u
        c = mesh.after[c]
    return goal


@wp.func
def _cost(mesh: _Mesh, v: int, u: int) -> wp.float64:
    length = wp.length_sq(mesh.x[v] - mesh.x[u])
    error = _error(mesh, v, mesh.x[u]) + _error(mesh, u, mesh.x[u])
    return wp.max(error, wp.float64(0.0)) + EVENNESS * (mesh.area[v] + mesh.area[u]) * length


@wp.func
def _set_leaf(
    mesh: _Mesh, v: int, width: int, tree: wp.array(dtype=wp.float64), goal: wp.array(dtype=wp.int32)
):
    """The cost of v in a tree in which every node has the least of its two children."""
    u = _goal(mesh, v)
    goal[v] = u
    node = width + v
    tree[node] = FORBIDDEN
    if u >= 0:
        tree[node] = _cost(mesh, v, u)
    while node > 1:
        node = node // 2
        tree[node] = wp.min(tree[2 * node], tree[2 * node + 1])


@wp.func
def _prepare(mesh: _Mesh):
    for f in range(mesh.faces.shape[0]):
        for k in range(3):
            v = mesh.faces[f, k]
            c = 3 * f + k
            if mesh.first[v] < 0:
                mesh.first[v] = c
            else:
                mesh.after[mesh.last[v]] = c
            mesh.last[v] = c
    for f in range(mesh.faces.shape[0]):
        normal = _normal(mesh, mesh.faces[f, 0], mesh.faces[f, 1], mesh.faces[f, 2])
        area = wp.float64(0.5) * wp.length(normal)
        n = wp.normalize(normal)
        for k in range(3):
            v = mesh.faces[f, k]
            u = mesh.faces[f, (k + 1) % 3]
            _add_plane(mesh, v, n, -wp.dot(n, mesh.x[v]), area)
            mesh.area[v] += area / wp.float64(3.0)
            if _shared(mesh, v, u) == 1:
                mesh.rim[v] = 1
                mesh.rim[u] = 1
                edge = mesh.x[u] - mesh.x[v]
                across = wp.normalize(wp.cross(edge, n))
                weight = RIM * wp.length_sq(edge)
                _add_plane(mesh, v, across, -wp.dot(across, mesh.x[v]), weight)
                _add_plane(mesh, u, across, -wp.dot(across, mesh.x[v]), weight)


@wp.func
def _collapse(mesh: _Mesh, v: int, u: int):
    c = mesh.first[v]
    while c >= 0:
        f = c // 3
        k = c % 3
        if mesh.faces[f, 0] >= 0:
            if mesh.faces[f, (k + 1) % 3] == u or mesh.faces[f, (k + 2) % 3] == u:
                mesh.faces[f, 0] = -1
            else:
                mesh.faces[f, k] = u
        c = mesh.after[c]
    # One list of the corners that are left.
    mesh.after[mesh.last[u]] = mesh.first[v]
    c = mesh.first[u]
    mesh.first[u] = -1
    while c >= 0:
        if mesh.faces[c // 3, 0] >= 0:
            if mesh.first[u] < 0:
                mesh.first[u] = c
            else:
                mesh.after[mesh.last[u]] = c
            mesh.last[u] = c
        c = mesh.after[c]
    mesh.after[mesh.last[u]] = -1
    mesh.area[u] += mesh.area[v]
    for k in range(10):
        mesh.quadric[u, k] += mesh.quadric[v, k]


@wp.kernel
def _collapse_all(
    mesh: _Mesh,
    wanted: wp.array(dtype=wp.int32),
    width: int,
    tree: wp.array(dtype=wp.float64),
    goal: wp.array(dtype=wp.int32),
    rank: wp.array(dtype=wp.int32),
    levels: wp.array3d(dtype=wp.int32),
):
    _prepare(mesh)
    count = mesh.x.shape[0]
    for v in range(count):
        _set_leaf(mesh, v, width, tree, goal)
    for level in range(wanted.shape[0]):
        while count > wanted[level] and tree[1] < FORBIDDEN:
            node = int(1)
            while node < width:
                node = 2 * node + wp.where(tree[2 * node] <= tree[2 * node + 1], 0, 1)
            v = node - width
            u = goal[v]
            if not _may_go(mesh, v, u):
                # Of old: something two edges away has changed since.
                _set_leaf(mesh, v, width, tree, goal)
                continue
            _collapse(mesh, v, u)
            rank[v] = level
            count -= 1
            while node >= 1:
                if node >= width:
                    tree[node] = FORBIDDEN
                else:
                    tree[node] = wp.min(tree[2 * node], tree[2 * node + 1])
                node = node // 2
            _set_leaf(mesh, u, width, tree, goal)
            c = mesh.first[u]
            while c >= 0:
                f = c // 3
                if mesh.faces[f, 0] >= 0:
                    for k in range(1, 2 + mesh.rim[u]):
                        _set_leaf(mesh, mesh.faces[f, (c % 3 + k) % 3], width, tree, goal)
                c = mesh.after[c]
        for f in range(mesh.faces.shape[0]):
            if mesh.faces[f, 0] >= 0:
                for k in range(3):
                    levels[level, f, k] = mesh.faces[f, k]
