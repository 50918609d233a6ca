"""Points spread over a surface by area, and their exact distances to another surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from muslin.eval.metrics.closest import Surface
from muslin.eval.metrics.vertex import triangle_areas
from muslin.garments.errors import InputError

# The plastic number's powers: the two-dimensional additive recurrence of lowest known discrepancy
# (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences").
PLASTIC = 1.32471795724474602596
SAMPLES = 20_000
MAX_SAMPLES = 4_000_000
SHIFTS = 8


@dataclass(frozen=True)
class SurfaceDistance:
    """Mean and root mean square, metres, of d(a, B) over A, of d(b, A) over B, and their symmetric forms.

    mean = (mean_ab + mean_ba) / 2,   rms = sqrt((rms_ab^2 + rms_ba^2) / 2)

    mean_error, rms_error    standard errors of `mean` and `rms`, metres
    largest_ab, largest_ba   largest distance of a sample of A, and of B: at most h(A, B), h(B, A)
    samples                  points on each side
    """

    mean_ab: float
    mean_ba: float
    rms_ab: float
    rms_ba: float
    mean_error: float
    rms_error: float
    largest_ab: float
    largest_ba: float
    samples: int

    @property
    def mean(self) -> float:
        return 0.5 * (self.mean_ab + self.mean_ba)

    @property
    def rms(self) -> float:
        return float(np.sqrt(0.5 * (self.rms_ab**2 + self.rms_ba**2)))

    @property
    def largest(self) -> float:
        """The Hausdorff distance that area samples see, as of Metro and MeshLab: never more than the true."""
        return max(self.largest_ab, self.largest_ba)


def sample_surface(
    vertices: np.ndarray, faces: np.ndarray, count: int, seed: int | Sequence[int] = 0
) -> np.ndarray:
    """`count` points spread evenly over a surface, each standing for the same area; (count, 3), metres.

    Triangles are chosen by systematic sampling along the cumulative area (so a triangle of area A gets
    count A / total points, rounded up or down), places within them by a low-discrepancy sequence folded onto
    the triangle. `seed` shifts both. No point is placed on purpose on edges or vertices: such extra points
    bias every mean.
    """
    return _spread(vertices, faces, triangle_areas(vertices, faces), count, seed)


def point_to_surface(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """d(p, B) = min_{b in B} |p - b|, exact, to the triangles and not only to their corners; (N,), metres.

    points (N, 3), vertices (V, 3), metres; faces (F, 3).
    """
    return Surface(vertices, faces).closest(points)[0]


def surface_distance(
    vertices_a: np.ndarray,
    faces_a: np.ndarray,
    vertices_b: np.ndarray,
    faces_b: np.ndarray,
    samples: int = SAMPLES,
    seed: int = 0,
    relative: float | None = None,
    max_samples: int = MAX_SAMPLES,
) -> SurfaceDistance:
    """Mean and rms distance of two surfaces, with their standard errors.

    mean_ab = 1/|A| integral over A of d(a, B) dA, by `samples` points evenly spread over A; exact distances
    to the triangles of B. The same from B to A.

    vertices (V, 3), metres; faces (F, 3). The two meshes need not share topology.

    With `relative`, points are added until the standard error of the mean is at most `relative` times it, or
    there are `max_samples` a side; `mean_error` says which. Errors come from `SHIFTS` independent random
    shifts of the points: their spread over sqrt(SHIFTS), as of randomized quasi-Monte Carlo (L'Ecuyer and
    Lemieux 2002, "Recent advances in randomized quasi-Monte Carlo methods").
    """
    a, b = Surface(vertices_a, faces_a, "first mesh"), Surface(vertices_b, faces_b, "second mesh")
    return mean_distance(a, b, samples, seed, relative, max_samples)


def mean_distance(
    a: Surface,
    b: Surface,
    samples: int = SAMPLES,
    seed: int = 0,
    relative: float | None = None,
    max_samples: int = MAX_SAMPLES,
) -> SurfaceDistance:
    """`surface_distance` of surfaces that have their trees."""
    if samples < SHIFTS or max_samples < SHIFTS or not (relative is None or relative > 0):
        raise InputError(
            f"surface distance: samples = {samples}, max_samples = {max_samples}, relative = {relative}; "
            f"give {SHIFTS} samples or more, and a positive tolerance or none"
        )
    sides = _Side(a, b, (seed, 0)), _Side(b, a, (seed, 1))
    count = -(-samples // SHIFTS)
    while True:
        for side in sides:
            side.add(count)
        found = _summary(*sides)
        room = (max_samples - found.samples) // SHIFTS
        if relative is None or found.mean_error <= relative * found.mean or room < 1:
            return found
        wanted = (found.mean_error / (relative * found.mean)) ** 2 - 1.0
        count = min(room, int(found.samples / SHIFTS * np.clip(wanted, 0.5, 4.0)) + 1)


class _Side:
    """Sums of distances from A to B over the points of every shift."""

    def __init__(self, source: Surface, target: Surface, seed: tuple[int, ...]) -> None:
        self.source, self.target, self.seed = source, target, seed
        self.sums, self.squares = np.zeros(SHIFTS), np.zeros(SHIFTS)
        self.largest, self.rounds, self.count = 0.0, 0, 0

    def add(self, count: int) -> None:
        """`count` points more of every shift, asked for in one order over the surface: near ones one after
        another are faster."""
        mesh = self.source
        points = [
            _spread(mesh.vertices, mesh.faces, mesh.areas, count, [*self.seed, self.rounds, shift])
            for shift in range(SHIFTS)
        ]
        distance = self.target.closest(np.stack(points, axis=1).reshape(-1, 3))[0].reshape(count, SHIFTS)
        self.sums += distance.sum(axis=0)
        self.squares += np.square(distance).sum(axis=0)
        self.largest = max(self.largest, float(distance.max()))
        self.rounds, self.count = self.rounds + 1, self.count + count


def _summary(ab: _Side, ba: _Side) -> SurfaceDistance:
    means = 0.5 * (ab.sums + ba.sums) / ab.count
    rms = np.sqrt(0.5 * (ab.squares + ba.squares) / ab.count)
    return SurfaceDistance(
        mean_ab=float(ab.sums.mean() / ab.count),
        mean_ba=float(ba.sums.mean() / ab.count),
        rms_ab=float(np.sqrt(ab.squares.mean() / ab.count)),
        rms_ba=float(np.sqrt(ba.squares.mean() / ab.count)),
        mean_error=float(means.std(ddof=1) / np.sqrt(SHIFTS)),
        rms_error=float(rms.std(ddof=1) / np.sqrt(SHIFTS)),
        largest_ab=ab.largest,
        largest_ba=ba.largest,
        samples=SHIFTS * ab.count,
    )


def _spread(
    vertices: np.ndarray, faces: np.ndarray, areas: np.ndarray, count: int, seed: int | Sequence[int]
) -> np.ndarray:
    total = areas.sum()
    if not (count > 0 and np.isfinite(total) and total > 0):
        raise InputError(
            f"cannot place {count} samples on a surface of area {total} m^2; both must be positive"
        )
    shift = np.random.default_rng(seed).random(3)
    cumulative = np.cumsum(areas)
    targets = (np.arange(count) + shift[0]) / count * total
    chosen = np.searchsorted(cumulative, targets, side="right").clip(max=len(faces) - 1)
    index = np.arange(1, count + 1)
    u = (shift[1] + index / PLASTIC) % 1.0
    v = (shift[2] + index / PLASTIC**2) % 1.0
    folded = u + v > 1.0
    u, v = np.where(folded, 1.0 - u, u), np.where(folded, 1.0 - v, v)
    a, b, c = (vertices[faces[chosen, k]] for k in range(3))
    return a + u[:, None] * (b - a) + v[:, None] * (c - a)
