"""Sampling of the boundary of every panel, both sides of a seam alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from muslin.garments.mesh import GarmentMesh
from muslin.sim.remesh.curves import Curve, curves
from muslin.sim.remesh.metric import edge_lengths

LENGTH_ERROR = 2e-4
"""Share by which the length of a sampled curve may differ from that of the curve."""

MOST_SHIFT = 3.0
"""Times what makes chords of a circle as long as its arcs, by which samples may move to that end; else the
curve gets one sample more."""


@dataclass(frozen=True, eq=False)
class Rim:
    """The boundary vertices of a new triangulation, panel vertices (R,) first to last, and their rings.

    face, weights     (R,) int64, (R, 3): the face of the source, and where in it each vertex lies
    points            (R, 2) panel space, metres: near the place in the source, so that lengths are kept
    vertex            (R,) int32: sewn vertex of each; both sides of a seam share them
    after             (R,) int32: the next one along the boundary of its panel, the panel to the left
    spacing           (R,) length of the longer of its two boundary edges in the metric of the source
    """

    face: NDArray[np.int64]
    weights: NDArray[np.float64]
    points: NDArray[np.float64]
    vertex: NDArray[np.int32]
    after: NDArray[np.int32]
    spacing: NDArray[np.float64]


def sample_rim(
    mesh: GarmentMesh, metric: NDArray[np.float64], rng: np.random.Generator, jitter: float = 0.0
) -> Rim:
    """Boundary vertices about one unit of the metric (P, 2, 2) apart.

    A curve of length l in the metric, the larger one of its two sides, gets round(l) edges of equal length,
    one at least and as many as it takes to keep its length (`_sampled`). Its corners stay. `jitter`, in
    edges, moves the samples along the curve at random.
    """
    builder = _Builder(mesh)
    for curve in curves(mesh):
        sizes = np.max([edge_lengths(mesh.panel_vertices, side, metric) for side in curve.sides], axis=0)
        along = np.concatenate([[0.0], np.cumsum(sizes)])
        # A closed curve may be all the boundary that a panel has.
        count = max(3 if curve.closed else 1, round(float(along[-1])))
        sampled = None
        while sampled is None:
            place = np.interp(np.linspace(0.0, along[-1], count + 1), along, np.arange(len(along)))
            place = _jittered(place, jitter, rng)
            sampled = _sampled(curve, mesh.panel_vertices, place)
            count += 1
        builder.add(curve, place, sampled)
    return builder.rim(metric)


def _sampled(
    curve: Curve, points: NDArray[np.float64], place: NDArray[np.float64]
) -> list[NDArray[np.float64]] | None:
    """Samples (k + 1, 2) of each side at `place`, moved off the curve so that they keep its length; None if
    they would have to move too far.

    Chords of length h of a curve of radius R are shorter than their arcs by h^2 / 24 R^2. Samples that lie
    h^2 / 24 R outside, away from the centre, make up for it: p_i - (p_(i-1) - 2 p_i + p_(i+1)) c / 24 with
    c = 1 where the curve goes on as it is, and the c that keeps the length where it ends in corners, which
    stay.
    """
    moved = []
    edge = np.minimum(place.astype(np.int64), len(curve.sides[0]) - 1)
    fraction = (place - edge)[:, None]
    for side, length in zip(curve.sides, curve.side_lengths(points), strict=True):
        at = (1.0 - fraction) * points[side[edge, 0]] + fraction * points[side[edge, 1]]
        bend = np.zeros_like(at)
        bend[1:-1] = (2.0 * at[1:-1] - at[:-2] - at[2:]) / 24.0
        share = 0.0
        for _ in range(20):
            error, slope = _length_error(at, bend, share, float(length.sum()))
            if abs(error) <= 0.1 * LENGTH_ERROR or slope <= 0.0:
                break
            share = min(max(share - error / slope, 0.0), MOST_SHIFT)
        if abs(_length_error(at, bend, share, float(length.sum()))[0]) > LENGTH_ERROR:
            return None
        moved.append(at + share * bend)
    return moved


def _length_error(
    at: NDArray[np.float64], bend: NDArray[np.float64], share: float, length: float
) -> tuple[float, float]:
    """(L(at + share bend) - length) / length of the polyline, and its derivative by share."""
    chord, change = np.diff(at + share * bend, axis=0), np.diff(bend, axis=0)
    size = np.linalg.norm(chord, axis=1)
    return float(size.sum()) / length - 1.0, float(((chord * change).sum(axis=1) / size).sum()) / length


def _jittered(place: NDArray[np.float64], jitter: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Samples moved by up to half of `jitter` of the way to their neighbours; the ends stay."""
    moved = place.copy()
    shift = 0.5 * jitter * rng.uniform(-1.0, 1.0, len(place) - 2)
    gaps = np.diff(place)
    moved[1:-1] += shift * np.where(shift > 0.0, gaps[1:], gaps[:-1])
    return moved


class _Builder:
    """Gathers the samples of all curves into panel vertices and rings."""

    def __init__(self, mesh: GarmentMesh) -> None:
        self.mesh = mesh
        self.corner: dict[int, int] = {}  # new panel vertex of each old one at an end of a curve
        self.corner_vertex: dict[int, int] = {}  # new sewn vertex of each old one there
        self.face: list[NDArray[np.int64]] = []
        self.weights: list[NDArray[np.float64]] = []
        self.points: list[NDArray[np.float64]] = []
        self.vertex: list[NDArray[np.int64]] = []
        self.rings: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = []
        self.count = self.sewn = 0

    def add(self, curve: Curve, place: NDArray[np.float64], sampled: list[NDArray[np.float64]]) -> None:
        """Adds the samples of one curve on each of its sides."""
        edge = np.minimum(place.astype(np.int64), len(curve.sides[0]) - 1)
        fraction = place - edge
        ends = [self._sewn_corner(int(v)) for v in (curve.vertices[0], curve.vertices[-1])]
        inner = np.arange(self.sewn, self.sewn + len(place) - 2)
        self.sewn += len(inner)
        for side, faces, forward, points in zip(
            curve.sides, curve.faces, curve.forward, sampled, strict=True
        ):
            first = self._corner(int(side[0, 0]), ends[0], int(faces[0]))
            last = self._corner(int(side[-1, 1]), ends[1], int(faces[-1]))
            new = np.arange(self.count, self.count + len(inner))
            self._append(faces[edge[1:-1]], side[edge[1:-1]], fraction[1:-1], points[1:-1], inner)
            ring = np.concatenate([[first], new, [last]])
            ring = ring if forward else ring[::-1]
            self.rings.append((ring[:-1], ring[1:]))

    def rim(self, metric: NDArray[np.float64]) -> Rim:
        """What was added."""
        face, weights = np.concatenate(self.face), np.concatenate(self.weights)
        after = np.full(self.count, -1)
        for tail, head in self.rings:
            after[tail] = head
        points = np.concatenate(self.points)
        local = np.einsum("ri,rijk->rjk", weights, metric[self.mesh.panel_faces[face]])
        edges = np.stack([np.arange(self.count), after], axis=1)
        size = edge_lengths(points, edges, local)
        spacing = size.copy()
        np.maximum.at(spacing, after, size)
        return Rim(
            face,
            weights,
            points,
            np.concatenate(self.vertex).astype(np.int32),
            after.astype(np.int32),
            spacing,
        )

    def _sewn_corner(self, vertex: int) -> int:
        if vertex not in self.corner_vertex:
            self.corner_vertex[vertex] = self.sewn
            self.sewn += 1
        return self.corner_vertex[vertex]

    def _corner(self, panel_vertex: int, sewn: int, face: int) -> int:
        if panel_vertex not in self.corner:
            self.corner[panel_vertex] = self.count
            whole = np.array([[panel_vertex, panel_vertex]])
            point = self.mesh.panel_vertices[[panel_vertex]]
            self._append(np.array([face]), whole, np.zeros(1), point, np.array([sewn]))
        return self.corner[panel_vertex]

    def _append(
        self,
        faces: NDArray[np.int64],
        ends: NDArray[np.int32],
        fraction: NDArray[np.float64],
        points: NDArray[np.float64],
        sewn: NDArray[np.int64],
    ) -> None:
        corners = self.mesh.panel_faces[faces]
        weights = np.where(corners == ends[:, :1], 1.0 - fraction[:, None], 0.0)
        weights += np.where((corners == ends[:, 1:]) & (ends[:, :1] != ends[:, 1:]), fraction[:, None], 0.0)
        self.face.append(faces)
        self.weights.append(weights)
        self.points.append(points)
        self.vertex.append(sewn)
        self.count += len(faces)
