"""Least-squares fits of curvature to the hinge angles around an edge, as a serial Warp kernel.

K of one edge minimises sum (r . K - theta)^2 over the hinges of its two triangles, r of unit length;
where those do not determine it, the triangles around join, GROWTH times at most. One thread goes through all
edges: how far a fit has to reach differs, and it is done once a mesh, on the CPU.
"""

import numpy as np
import warp as wp
from numpy.typing import NDArray
from scipy.sparse import csr_array

wp.set_module_options({"enable_backward": False})

CONDITION = wp.constant(wp.float64(0.003))
"""Smallest over largest eigenvalue of the normal equations of a fit that its hinges determine."""
GROWTH = 3
"""How often a fit may take in the neighbours of its triangles."""
MOST = 2 + 4 * (2**GROWTH - 1)
"""Triangles that a fit has then at most: each brings two more."""


@wp.struct
class HingeRows:
    """What a hinge measures, seen from each of its triangles.

    Rows over (K11, K22, K12) are given over the orthonormal components ((K11 + K22) / sqrt 2,
    (K11 - K22) / sqrt 2, sqrt 2 K12), of which a turn by t leaves the first and turns the others by 2 t.

    row         (F, 3) angle of the hinge opposite a corner as a row of length 1
    length      (F, 3) length of that row, m
    hinge       (F, 3) that hinge, -1 on a free edge
    neighbour   (F, 3) the triangle beyond it, -1 for none
    turn        (F, 3) cos 2t, sin 2t of the turn of the neighbour's panel frame into that of the face
    """

    row: wp.array2d(dtype=wp.vec3d)
    length: wp.array2d(dtype=wp.float64)
    hinge: wp.array2d(dtype=wp.int32)
    neighbour: wp.array2d(dtype=wp.int32)
    turn: wp.array2d(dtype=wp.vec2d)


@wp.func
def turned(r: wp.vec3d, by: wp.vec2d) -> wp.vec3d:
    """A row in a frame turned by t, `by` = cos 2t, sin 2t, as one in the fixed frame."""
    return wp.vec3d(r[0], r[1] * by[0] - r[2] * by[1], r[1] * by[1] + r[2] * by[0])


@wp.func
def contains(faces: wp.array(dtype=wp.int32), count: int, f: int) -> bool:
    """Whether f is among the first `count` faces."""
    found = bool(False)
    for i in range(count):
        found = found or faces[i] == f
    return found


@wp.kernel
def fit_edges(
    rows: HingeRows,
    wanted: wp.array(dtype=wp.vec3d),
    start: wp.array2d(dtype=wp.int32),
    start_turn: wp.array(dtype=wp.vec2d),
    faces: wp.array(dtype=wp.int32),
    turns: wp.array(dtype=wp.vec2d),
    ends: wp.array(dtype=wp.int32),
    hinges: wp.array(dtype=wp.int32),
    weights: wp.array(dtype=wp.float64),
):
    """Weights of hinge angles for wanted . K of every edge, one edge after the other.

    start (N, 2): triangles of the edge, the second -1 on a free one and turned as start_turn (N,) says.
    Those of edge e end at ends[e]; beyond the room for them they are counted only. faces, turns: scratch
    (MOST,).
    """
    used = int(0)
    for e in range(wanted.shape[0]):
        count = int(1)
        faces[0] = start[e, 0]
        turns[0] = wp.vec2d(wp.float64(1.0), wp.float64(0.0))
        if start[e, 1] >= 0:
            count = 2
            faces[1] = start[e, 1]
            turns[1] = start_turn[e]
        first = int(0)
        normal = wp.mat33d()
        inverse = wp.mat33d()
        for growth in range(4):
            # Rows of the triangles that are new to the fit.
            for i in range(first, count):
                for k in range(3):
                    if rows.hinge[faces[i], k] >= 0:
                        r = turned(rows.row[faces[i], k], turns[i])
                        normal += wp.outer(r, r)
            vectors, values = wp.eig3(normal)
            largest = wp.max(values[0], wp.max(values[1], values[2]))
            smallest = wp.min(values[0], wp.min(values[1], values[2]))
            if smallest > CONDITION * largest or growth == 3:
                inverse = wp.mat33d()
                for k in range(3):
                    if values[k] > CONDITION * largest:
                        v = wp.vec3d(vectors[0, k], vectors[1, k], vectors[2, k])
                        inverse += wp.outer(v, v) / values[k]
                break
            # The neighbours of those that joined last join.
            last = first
            first = count
            for i in range(last, first):
                for k in range(3):
                    f = rows.neighbour[faces[i], k]
                    if f >= 0 and not contains(faces, count, f):
                        faces[count] = f
                        here = turns[i]
                        more = rows.turn[faces[i], k]
                        turns[count] = wp.vec2d(
                            here[0] * more[0] - here[1] * more[1], here[1] * more[0] + here[0] * more[1]
                        )
                        count += 1
        target = inverse * wanted[e]
        for i in range(count):
            for k in range(3):
                if rows.hinge[faces[i], k] >= 0:
                    if used < weights.shape[0]:
                        r = turned(rows.row[faces[i], k], turns[i])
                        hinges[used] = rows.hinge[faces[i], k]
                        weights[used] = wp.dot(target, r) / rows.length[faces[i], k]
                    used += 1
        ends[e] = used


def fit(
    row: NDArray[np.float64],
    hinge: NDArray[np.int64],
    neighbour: NDArray[np.int64],
    turn: NDArray[np.float64],
    wanted: NDArray[np.float64],
    start: NDArray[np.int64],
    start_turn: NDArray[np.float64],
    num_hinges: int,
) -> csr_array:
    """(N, H) weights of hinge angles for `wanted` (N, 3) . K of N edges.

    row, wanted: over (K11, K22, K12); turn, start_turn: angles, rad; the rest as in `HingeRows` and
    `fit_edges`. A hinge counts once for each triangle of the fit that has it.
    """
    rows = HingeRows()
    components = _orthonormal(row)
    length = np.linalg.norm(components, axis=-1)
    components /= np.where(length > 0.0, length, 1.0)[..., None]
    rows.row = wp.array(components, dtype=wp.vec3d, device="cpu")
    rows.length = wp.array(length, dtype=wp.float64, device="cpu")
    rows.hinge = wp.array(hinge, dtype=wp.int32, device="cpu")
    rows.neighbour = wp.array(neighbour, dtype=wp.int32, device="cpu")
    rows.turn = wp.array(_doubled(turn), dtype=wp.vec2d, device="cpu")
    count = len(wanted)
    given = ((_orthonormal(wanted), wp.vec3d), (start, wp.int32), (_doubled(start_turn), wp.vec2d))
    edges = [wp.array(array, dtype=dtype, device="cpu") for array, dtype in given]
    scratch = [wp.zeros(MOST, dtype=dtype, device="cpu") for dtype in (wp.int32, wp.vec2d)]
    ends = wp.zeros(count, dtype=wp.int32, device="cpu")
    room = 8 * count
    while True:
        hinges = wp.zeros(room, dtype=wp.int32, device="cpu")
        weights = wp.zeros(room, dtype=wp.float64, device="cpu")
        inputs = [rows, *edges, *scratch, ends, hinges, weights]
        wp.launch(fit_edges, 1, inputs=inputs, device="cpu")
        used = int(ends.numpy()[-1]) if count else 0
        if used <= room:
            break
        room = used
    offsets = np.concatenate([[0], ends.numpy()])
    matrix = csr_array((weights.numpy()[:used], hinges.numpy()[:used], offsets), shape=(count, num_hinges))
    matrix.sum_duplicates()
    return matrix


def _orthonormal(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows over (K11, K22, K12) as rows over the components of `HingeRows`."""
    half = np.sqrt(0.5)
    one, two, both = rows[..., 0], rows[..., 1], rows[..., 2]
    return np.stack([half * (one + two), half * (one - two), half * both], axis=-1)


def _doubled(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """cos 2t, sin 2t of angles t."""
    return np.stack([np.cos(2.0 * angle), np.sin(2.0 * angle)], axis=-1)
