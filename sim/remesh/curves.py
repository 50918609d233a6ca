"""The curves of a garment: hems and seams between the corners of its panels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from muslin.garments.half_edges import half_edges, on_boundary
from muslin.garments.mesh import GarmentMesh

SHARP = np.radians(30.0)  # turn of a panel's boundary that makes a corner
KINK, KINK_RATIO = np.radians(10.0), 3.0  # or one so much sharper than the turns beside it


@dataclass(frozen=True, eq=False)
class Curve:
    """A chain of boundary edges of panels between two corners, once as a hem, twice as a seam.

    vertices   (n + 1,) sewn vertices along it; the first is the last of a closed curve, which has no corner
    sides      one of a hem, two of a seam: the panel half-edges (n, 2), as panel vertices in the direction of
               `vertices`
    faces      of each side: the (n,) faces of its half-edges
    forward    of each side: whether its panel lies to the left of the curve
    """

    vertices: NDArray[np.int32]
    sides: tuple[NDArray[np.int32], ...]
    faces: tuple[NDArray[np.int64], ...]
    forward: tuple[bool, ...]

    @property
    def closed(self) -> bool:
        """Whether the curve comes back to where it starts."""
        return bool(self.vertices[0] == self.vertices[-1])

    def side_lengths(self, points: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        """Lengths (n,) of the edges of each side; points (P, 2): panel space, metres."""
        return [np.linalg.norm(points[side[:, 1]] - points[side[:, 0]], axis=1) for side in self.sides]


def panel_boundary(mesh: GarmentMesh) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Edges (B, 2) of panel vertices that one triangle has, its panel to their left, and (B,) that face."""
    single = on_boundary(mesh.panel_faces)
    return half_edges(mesh.panel_faces)[single], single % len(mesh.faces)


def curves(mesh: GarmentMesh) -> list[Curve]:
    """All curves of a valid mesh, those with corners first.

    A corner is a sewn vertex at which other than two boundary edges meet (the ends of seams, the tips of
    darts), or at which a panel's boundary turns by SHARP, or by KINK and KINK_RATIO times as much as at both
    neighbours, so that samples of a smooth curve are none.
    """
    half, face = panel_boundary(mesh)
    sewn = mesh.panel_to_vertex[half].astype(np.int64)
    key = np.sort(sewn, axis=1) @ np.array([mesh.num_vertices, 1])
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.r_[True, np.diff(key[order]) != 0])
    sides = np.split(order, starts[1:])
    at: dict[int, list[int]] = {}
    for edge, members in enumerate(sides):
        for vertex in sewn[members[0]].tolist():
            at.setdefault(vertex, []).append(edge)
    corner = _corners(mesh, half)
    corner |= {vertex for vertex, edges in at.items() if len(edges) != 2}
    used = np.zeros(len(sides), dtype=bool)
    found = []
    for vertex in [*sorted(corner), *sorted(set(at) - corner)]:
        for edge in at[vertex]:
            if not used[edge]:
                chain = _follow(edge, vertex, sides, sewn, at, corner)
                used[[e for e, _ in chain]] = True
                found.append(_curve(chain, sides, half, face, sewn))
    return found


def _corners(mesh: GarmentMesh, half: NDArray[np.int32]) -> set[int]:
    """Sewn vertices at which the boundary of a panel has a corner."""
    following = np.full(len(mesh.panel_vertices), -1)
    following[half[:, 0]] = half[:, 1]
    direction = mesh.panel_vertices[half[:, 1]] - mesh.panel_vertices[half[:, 0]]
    heading = np.zeros(len(mesh.panel_vertices))
    heading[half[:, 0]] = np.arctan2(direction[:, 1], direction[:, 0])
    turn = np.zeros(len(mesh.panel_vertices))
    a, b = half.T
    turn[b] = np.abs((heading[b] - heading[a] + np.pi) % (2.0 * np.pi) - np.pi)
    beside = np.zeros(len(mesh.panel_vertices))
    np.maximum.at(beside, b, turn[a])
    np.maximum.at(beside, a, turn[b])
    sharp = (turn > SHARP) | ((turn > KINK) & (turn > KINK_RATIO * beside))
    return set(mesh.panel_to_vertex[sharp].tolist())


def _follow(
    edge: int,
    vertex: int,
    sides: list[NDArray[np.int64]],
    sewn: NDArray[np.int64],
    at: dict[int, list[int]],
    corner: set[int],
) -> list[tuple[int, int]]:
    """(edge, vertex at which it is entered) from a vertex on to the next corner, or around."""
    chain = [(edge, vertex)]
    first = vertex
    while True:
        a, b = sewn[sides[edge][0]].tolist()
        vertex = b if vertex == a else a
        if vertex in corner or vertex == first:
            return chain
        one, other = at[vertex]
        edge = other if one == edge else one
        chain.append((edge, vertex))


def _curve(
    chain: list[tuple[int, int]],
    sides: list[NDArray[np.int64]],
    half: NDArray[np.int32],
    face: NDArray[np.int64],
    sewn: NDArray[np.int64],
) -> Curve:
    """The curve of a chain. Its first side is the one that runs along it in the first edge, if any."""
    count = len(sides[chain[0][0]])
    members = np.array([sides[edge] for edge, _ in chain])
    entered = np.array([vertex for _, vertex in chain])
    forward = sewn[members, 0] == entered[:, None]
    if count == 2:
        # Of the two sides of a seam one runs along the curve and one against it.
        members = np.where(forward[:, :1], members, members[:, ::-1])
    elif not forward[0, 0]:
        forward = ~forward
        ends = half[members[:, 0]][:, ::-1]
        last = sewn[members[-1, 0], 0]
        return Curve(np.append(entered, last).astype(np.int32), (ends,), (face[members[:, 0]],), (False,))
    tables = (half[members[:, 0]], *(half[members[:, k]][:, ::-1] for k in range(1, count)))
    last = sewn[members[-1, 0], 1]
    return Curve(
        np.append(entered, last).astype(np.int32),
        tables,
        tuple(face[members[:, k]] for k in range(count)),
        (True, False)[:count],
    )
