"""The Hausdorff distance of two surfaces, with certified bounds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from muslin.eval.metrics.closest import Surface, point_triangle_distance
from muslin.eval.metrics.patch_bound import longest_edge, patch_bound
from muslin.garments.errors import InputError

RELATIVE_TOLERANCE = 1e-3
ABSOLUTE_TOLERANCE = 1e-6  # metres
MAX_TRIANGLES = 1_000_000
BATCH = 4096
FINEST = 1e-9  # of the largest coordinate: no tolerance is smaller


@dataclass(frozen=True)
class HausdorffBounds:
    """lower <= H <= upper, metres. `lower` is the distance of a point that was really found.

    upper - lower is at most the tolerance asked for, unless the limit on triangles was hit first; the bounds
    hold either way, to the rounding of float64.
    """

    lower: float
    upper: float


def hausdorff(
    vertices_a: np.ndarray,
    faces_a: np.ndarray,
    vertices_b: np.ndarray,
    faces_b: np.ndarray,
    relative: float = RELATIVE_TOLERANCE,
    absolute: float = ABSOLUTE_TOLERANCE,
    max_triangles: int = MAX_TRIANGLES,
) -> HausdorffBounds:
    """H(A, B) = max(h(A, B), h(B, A)), h(A, B) = max_{a in A} min_{b in B} |a - b|, over all surface points.

    vertices (V, 3), metres; faces (F, 3). The interval is no wider than max(absolute, relative x lower), nor
    asked to be less than 1e-9 of the largest coordinate, unless more than `max_triangles` pieces of a side
    would have to be looked at. Raises InputError for meshes without faces or with bad ones, NaN and infinity.

    Distances at vertices alone miss maxima inside triangles: of the quad z = (0, 0.2, 0, 0.2) split along
    opposite diagonals they see 0 where H is 0.2 / sqrt(1 + 2 0.2^2) = 0.19245.
    """
    a, b = Surface(vertices_a, faces_a, "first mesh"), Surface(vertices_b, faces_b, "second mesh")
    return two_sided(a, b, relative, absolute, max_triangles=max_triangles)


def one_sided_hausdorff(
    vertices_a: np.ndarray,
    faces_a: np.ndarray,
    vertices_b: np.ndarray,
    faces_b: np.ndarray,
    relative: float = RELATIVE_TOLERANCE,
    absolute: float = ABSOLUTE_TOLERANCE,
    known_lower: float = 0.0,
    max_triangles: int = MAX_TRIANGLES,
) -> HausdorffBounds:
    """Bounds of h(A, B) = max_{a in A} min_{b in B} |a - b|; arguments as of `hausdorff`.

    `known_lower` is a distance below which nothing is of interest (the other side's, in a two-sided search);
    the bounds then hold for max(h(A, B), known_lower).
    """
    a, b = Surface(vertices_a, faces_a, "first mesh"), Surface(vertices_b, faces_b, "second mesh")
    return one_sided(a, b, relative, absolute, known_lower, max_triangles)


def two_sided(
    a: Surface,
    b: Surface,
    relative: float = RELATIVE_TOLERANCE,
    absolute: float = ABSOLUTE_TOLERANCE,
    known_lower: float = 0.0,
    max_triangles: int = MAX_TRIANGLES,
) -> HausdorffBounds:
    """`hausdorff` of surfaces that have their trees; the bounds hold for max(H(A, B), known_lower)."""
    ab = one_sided(a, b, relative, absolute, known_lower, max_triangles)
    ba = one_sided(b, a, relative, absolute, ab.lower, max_triangles)
    return HausdorffBounds(ba.lower, max(ab.upper, ba.upper))


def one_sided(
    a: Surface,
    b: Surface,
    relative: float,
    absolute: float,
    known_lower: float = 0.0,
    max_triangles: int = MAX_TRIANGLES,
) -> HausdorffBounds:
    """`one_sided_hausdorff` of surfaces that have their trees, by branch and bound over the triangles of A.

    Every point that is looked at raises the lower bound. Of a triangle t with corners p_j, centroid c and
    longest edge l, whose points p_j and c have their nearest points in the faces T_i of B,

        upper(t) = min(  max_j d(p_j, B) + l / sqrt(3),    d(c, B) + max_j |p_j - c|,
                         min_i max_j d(p_j, T_i),          patch(t)  )

    The first two hold because d(., B) is 1-Lipschitz, and no point of t is farther than l / sqrt(3) from all
    its corners; the third because the distance to one (convex) triangle is a convex function, so its largest
    value over t is at a corner; the last is `patch_bound`, which is exact where B is flat and sees several
    faces at once. They are tried in this order until one is below the best lower bound and the tolerance, so
    that t can be dropped. Of what is left, the triangles with the largest upper bounds are split in four.

    Source: branch and bound as by Tang, Lee and Kim 2009 ("Interactive Hausdorff distance computation for
    general polygonal models"), with midpoint subdivision.
    """
    if not (0.0 <= relative < np.inf and 0.0 <= absolute < np.inf and 0.0 <= known_lower < np.inf):
        raise InputError(
            f"Hausdorff distance: relative = {relative}, absolute = {absolute}, known_lower = {known_lower}; "
            "all must be finite and not negative"
        )
    search = _Search(b, relative, max(absolute, FINEST * float(np.abs(b.vertices).max())), known_lower)
    used, faces = np.unique(a.faces, return_inverse=True)
    distance, nearest = search.ask(a.vertices[used])[:2]
    faces = faces.reshape(-1, 3)
    whole = _Pieces(a.corners, distance[faces], nearest[faces], np.full(len(faces), np.inf))
    for start in range(0, len(faces), BATCH):
        search.bound(whole.at(slice(start, start + BATCH)))
    pieces, dropped, examined = whole, known_lower, len(faces)
    while True:
        keep = pieces.upper > search.enough
        dropped = max(dropped, float(pieces.upper[~keep].max(initial=0.0)))
        pieces = pieces.at(keep)
        now = min(len(pieces.upper), BATCH // 4)
        if now == 0 or examined + 4 * now > max_triangles:
            return HausdorffBounds(
                search.lower, max(search.lower, dropped, float(pieces.upper.max(initial=0.0)))
            )
        order = np.argpartition(-pieces.upper, now - 1)
        parts = _quarters(pieces.at(order[:now]), search)
        search.bound(parts)
        examined += 4 * now
        pieces = _joined([parts, pieces.at(order[now:])])


@dataclass(frozen=True)
class _Pieces:
    """Triangles: corners (N, 3, 3); of each corner, distance (N, 3) and nearest face (N, 3); upper (N,)."""

    corners: np.ndarray
    distance: np.ndarray
    nearest: np.ndarray
    upper: np.ndarray

    def at(self, where: np.ndarray | slice) -> _Pieces:
        """Those of an index; views of a slice."""
        return _Pieces(self.corners[where], self.distance[where], self.nearest[where], self.upper[where])


@dataclass
class _Search:
    """The surface B, the tolerances, and the largest distance to it that was found."""

    target: Surface
    relative: float
    absolute: float
    lower: float

    @property
    def enough(self) -> float:
        """Triangles whose upper bound is not above it are of no interest."""
        return self.lower + max(self.absolute, self.relative * self.lower)

    def ask(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        found = self.target.closest(points)
        self.lower = max(self.lower, float(found[0].max(initial=0.0)))
        return found

    def bound(self, pieces: _Pieces) -> None:
        """Lower the upper bounds, in place, of pieces that cannot be dropped yet."""
        corners, upper, faces = pieces.corners, pieces.upper, self.target.corners
        np.minimum(upper, pieces.distance.max(axis=1) + longest_edge(corners) / np.sqrt(3.0), out=upper)
        left = self._left(upper, np.arange(len(upper)))
        for j in range(3):
            _lower(upper, left, _convex_bound(corners[left], faces[pieces.nearest[left, j]]))
            left = self._left(upper, left)
        centre = corners[left].mean(axis=1)
        distance, nearest, feet = self.ask(centre)
        _lower(upper, left, distance + np.linalg.norm(corners[left] - centre[:, None], axis=2).max(axis=1))
        _lower(upper, left, _convex_bound(corners[left], faces[nearest]))
        still = upper[left] > self.enough
        left = left[still]
        patch = patch_bound(corners[left], nearest[still], feet[still], self.target, self.enough)
        _lower(upper, left, patch)

    def _left(self, upper: np.ndarray, where: np.ndarray) -> np.ndarray:
        return where[upper[where] > self.enough]


def _lower(upper: np.ndarray, where: np.ndarray, bounds: np.ndarray) -> None:
    upper[where] = np.minimum(upper[where], bounds)


def _convex_bound(corners: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """max_j d(p_j, T); (N,)."""
    return point_triangle_distance(corners, triangles[:, None]).max(axis=1)


def _quarters(pieces: _Pieces, search: _Search) -> _Pieces:
    """Each triangle in four by its edge midpoints; only the midpoints are new queries."""
    middles = 0.5 * (pieces.corners + np.roll(pieces.corners, -1, axis=1))
    distance, nearest, _ = search.ask(middles.reshape(-1, 3))
    parts = []
    for old, middle in (
        (pieces.corners, middles),
        (pieces.distance, distance.reshape(-1, 3)),
        (pieces.nearest, nearest.reshape(-1, 3)),
    ):
        both = np.concatenate([old, middle], axis=1)
        parts.append(both[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]].reshape(-1, *old.shape[1:]))
    return _Pieces(parts[0], parts[1], parts[2], np.repeat(pieces.upper, 4))


def _joined(parts: list[_Pieces]) -> _Pieces:
    names = ("corners", "distance", "nearest", "upper")
    return _Pieces(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))
