"""Points spread over a surface by area, and their exact distances to another surface."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np

from muslin.eval.metrics.vertex import triangle_areas
from muslin.garments.errors import InputError

# The plastic number's powers: the two-dimensional additive recurrence of lowest known discrepancy
# (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences").
PLASTIC = 1.32471795724474602596


@dataclass(frozen=True)
class SurfaceDistance:
    """Mean and root mean square, metres, of d(a, B) over A, of d(b, A) over B, and their symmetric forms.

    mean = (mean_ab + mean_ba) / 2,   rms = sqrt((rms_ab^2 + rms_ba^2) / 2)
    """

    mean_ab: float
    mean_ba: float
    rms_ab: float
    rms_ba: float

    @property
    def mean(self) -> float:
        return 0.5 * (self.mean_ab + self.mean_ba)

    @property
    def rms(self) -> float:
        return float(np.sqrt(0.5 * (self.rms_ab**2 + self.rms_ba**2)))


def sample_surface(vertices: np.ndarray, faces: np.ndarray, count: int, seed: int = 0) -> np.ndarray:
    """`count` points spread evenly over a surface, each standing for the same area; (count, 3), metres.

    Triangles are chosen by systematic sampling along the cumulative area (so a triangle of area A gets
    count A / total points, rounded up or down), places within them by a low-discrepancy sequence folded onto
    the triangle. `seed` shifts both. No point is placed on purpose on edges or vertices: such extra points
    bias every mean.
    """
    areas = triangle_areas(vertices, faces)
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


def point_to_surface(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """d(p, B) = min_{b in B} |p - b|, exact, to the triangles and not only to their corners; (N,), metres."""
    squared, _, _ = igl.point_mesh_squared_distance(
        np.ascontiguousarray(points, dtype=np.float64),
        np.ascontiguousarray(vertices, dtype=np.float64),
        np.ascontiguousarray(faces, dtype=np.int64),
    )
    return np.sqrt(np.maximum(squared, 0.0))


def surface_distance(
    vertices_a: np.ndarray,
    faces_a: np.ndarray,
    vertices_b: np.ndarray,
    faces_b: np.ndarray,
    samples: int = 20_000,
    seed: int = 0,
) -> SurfaceDistance:
    """Mean and rms distance of two surfaces.

    mean_ab = 1/|A| integral over A of d(a, B) dA, by `samples` points evenly spread over A; exact distances
    to the triangles of B. The same from B to A.

    vertices (V, 3), metres; faces (F, 3). The two meshes need not share topology.
    """
    ab = point_to_surface(sample_surface(vertices_a, faces_a, samples, seed), vertices_b, faces_b)
    ba = point_to_surface(sample_surface(vertices_b, faces_b, samples, seed), vertices_a, faces_a)
    return SurfaceDistance(
        mean_ab=float(ab.mean()),
        mean_ba=float(ba.mean()),
        rms_ab=float(np.sqrt(np.mean(ab**2))),
        rms_ba=float(np.sqrt(np.mean(ba**2))),
    )
