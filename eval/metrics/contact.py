"""Contact of a cloth with a body and with itself in one frame: what is inside, how deep, what crosses."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from muslin.eval.metrics.contact_input import check_triangles
from muslin.eval.metrics.contours import contour_length
from muslin.eval.metrics.inside_area import CrossedTriangles, crossed_triangles, inside_areas, winding_at
from muslin.eval.metrics.penetration import (
    PSEUDONORMAL,
    WINDING_NUMBER,
    is_closed,
    nearest_distances,
    pseudonormal_distances,
)
from muslin.eval.metrics.triangle_pairs import (
    TrianglePairs,
    intersecting_triangles,
    self_intersecting_triangles,
)
from muslin.eval.metrics.triangle_samples import TriangleSamples, triangle_samples
from muslin.eval.metrics.vertex import triangle_areas
from muslin.eval.metrics.winding import cloth_winding_numbers, winding_numbers

SPACING = 1e-2  # metres
CROSSED_SPLIT = 4
DOUBTFUL_SPLIT = 16
"""Parts that an edge of a triangle is cut into for samples: where the body crosses it, and where its exact
area inside is not known."""

NUDGE = 1e-6
"""Share of the spacing by which a sample is moved off the cloth to see on which side of the skin it is."""


@dataclass(frozen=True)
class BodyContact:
    """A cloth against a body in one frame; inside is where the body's winding number is 1 or more.

    vertices        number of cloth vertices
    inside          number of them inside
    depth_sum       sum of the depths of the vertices inside, metres
    depth_max       largest of them, metres; 0 if none is inside
    area            area of the cloth, m^2
    area_inside     area of the part inside, m^2: exact, but for `area_sampled`
    area_sampled    area of the triangles whose part inside was sampled, m^2; the area inside is off by no
                    more than that, and about a hundredth of it where the body's surface crosses them once
    volume          integral of the depth over the part inside, m^3: what lies between it and the skin, to
                    first order in depth times curvature
    surface_depth   largest depth of a vertex or sample of the surface, metres: at most 2 / 3 of the spacing
                    of the samples less than the largest of the whole surface
    pairs           number of pairs of a cloth and a body triangle that intersect, exact
    coplanar        number of them in one plane
    contour         length of the curve in which cloth and body cross, metres
    method          WINDING_NUMBER; or PSEUDONORMAL of a body that is not closed, see `pseudonormal_distances`
    depths          (V,) depth of each vertex, metres; 0 outside
    """

    vertices: int
    inside: int
    depth_sum: float
    depth_max: float
    area: float
    area_inside: float
    area_sampled: float
    volume: float
    surface_depth: float
    pairs: int
    coplanar: int
    contour: float
    method: str
    depths: NDArray[np.float64] = field(repr=False, compare=False)


@dataclass(frozen=True)
class SelfContact:
    """A cloth against itself in one frame.

    pairs      number of pairs of triangles without a common vertex that intersect, exact
    coplanar   number of them in one plane
    contour    length of the curve in which they cross, metres
    """

    pairs: int
    coplanar: int
    contour: float


def self_contact(cloth: np.ndarray, faces: np.ndarray) -> SelfContact:
    """Where a cloth (V, 3), metres, faces (F, 3), intersects itself; see `self_intersecting_triangles`."""
    cloth, faces = check_triangles("cloth", cloth, faces)
    pairs = self_intersecting_triangles(cloth, faces)
    return SelfContact(
        len(pairs), int(pairs.coplanar.sum()), contour_length(pairs, cloth, faces, cloth, faces)
    )


def body_contact(
    cloth: np.ndarray,
    faces: np.ndarray,
    body: np.ndarray,
    body_faces: np.ndarray,
    masked: np.ndarray | None = None,
    spacing: float = SPACING,
) -> BodyContact:
    """Contact of a cloth (V, 3), faces (F, 3), with a body (M, 3), body_faces (N, 3); metres.

    A vertex is inside where the body's winding number is at least 1, its depth the exact distance to the
    surface. A body that overlaps itself (armpit, crotch) winds around the overlap twice: that is inside, and
    the depth there is the distance to the nearest sheet, also to one inside the body, so rather too small.

    The area inside is exact (`inside_areas`): triangles that the body does not cross are inside or outside as
    a whole, of the others the part inside is bounded by the curves of intersection. Its volume

        V = integral over the part inside of depth(x) dA

    is by samples at the centroids of equal parts of triangles, none with a side longer than `spacing`.

    masked    indices of body faces whose pairs do not count, nor their contour (between parts of the body
              that overlap, where cloth has no place to be); they bound the body all the same

    Raises InputError for no faces, indices out of range, and coordinates that are not finite.
    """
    cloth, faces = check_triangles("cloth", cloth, faces)
    body, body_faces = check_triangles("body", body, body_faces)
    pairs = intersecting_triangles(cloth, faces, body, body_faces)
    if is_closed(body_faces):
        parts = _inside_closed(cloth, faces, body, body_faces, pairs, spacing)
    else:
        parts = _inside_open(cloth, faces, body, body_faces, pairs, spacing)
    counted = pairs
    if masked is not None:
        kept = ~np.isin(pairs.faces[:, 1], masked)
        counted = TrianglePairs(pairs.faces[kept], pairs.coplanar[kept])
    depths = parts.depths
    return BodyContact(
        vertices=len(cloth),
        inside=int((depths > 0.0).sum()),
        depth_sum=float(depths.sum()),
        depth_max=float(depths.max()),
        area=float(triangle_areas(cloth, faces).sum()),
        area_inside=parts.area,
        area_sampled=parts.sampled,
        volume=float(parts.sample_depths @ parts.sample_areas),
        surface_depth=float(max(depths.max(), parts.sample_depths.max(initial=0.0))),
        pairs=len(counted),
        coplanar=int(counted.coplanar.sum()),
        contour=contour_length(counted, cloth, faces, body, body_faces),
        method=parts.method,
        depths=depths,
    )


@dataclass(frozen=True)
class _Inside:
    """depths (V,); area inside and how much of the cloth was sampled for it; samples (S,) of the part
    inside."""

    depths: NDArray[np.float64]
    area: float
    sampled: float
    sample_depths: NDArray[np.float64]
    sample_areas: NDArray[np.float64]
    method: str


def _inside_closed(
    cloth: np.ndarray,
    faces: np.ndarray,
    body: np.ndarray,
    body_faces: np.ndarray,
    pairs: TrianglePairs,
    spacing: float,
) -> _Inside:
    winding = cloth_winding_numbers(cloth, faces, body, body_faces, pairs)
    crossed = crossed_triangles(cloth, faces, body, body_faces, pairs, winding)
    areas, exact = inside_areas(crossed)
    whole = np.ones(len(faces), dtype=bool)
    whole[crossed.faces] = False
    whole &= winding[faces[:, 0]] > 0
    samples = [triangle_samples(cloth, faces, np.flatnonzero(whole), spacing)]
    all_areas = triangle_areas(cloth, faces)
    area, sampled = float(all_areas[whole].sum() + areas[exact].sum()), 0.0
    samples.append(
        _inside_crossed(triangle_samples(cloth, faces, crossed.faces[exact], spacing, CROSSED_SPLIT), crossed)
    )
    doubtful = crossed.faces[~exact]
    if len(doubtful):
        tried = triangle_samples(cloth, faces, doubtful, spacing, DOUBTFUL_SPLIT)
        samples.append(_inside_doubtful(tried, cloth, faces, body, body_faces, NUDGE * spacing))
        area += float(samples[-1].areas.sum())
        sampled = float(all_areas[doubtful].sum())
    vertices = np.flatnonzero(winding > 0)
    points = np.concatenate([cloth[vertices], *(part.points for part in samples)])
    distances = nearest_distances(points, body, body_faces)
    depths = np.zeros(len(cloth))
    depths[vertices] = distances[: len(vertices)]
    return _Inside(
        depths=depths,
        area=area,
        sampled=sampled,
        sample_depths=distances[len(vertices) :],
        sample_areas=np.concatenate([part.areas for part in samples]),
        method=WINDING_NUMBER,
    )


def _inside_crossed(samples: TriangleSamples, crossed: CrossedTriangles) -> TriangleSamples:
    """Those of the samples of crossed triangles that lie inside."""
    row = np.searchsorted(crossed.faces, samples.faces)
    points = np.einsum("sk,skx->sx", samples.weights, crossed.corners[row])
    return samples.where(winding_at(crossed, row, points) > 0)


def _inside_doubtful(
    samples: TriangleSamples,
    cloth: np.ndarray,
    faces: np.ndarray,
    body: np.ndarray,
    body_faces: np.ndarray,
    nudge: float,
) -> TriangleSamples:
    """Those of the samples with the body on both sides of the cloth, `nudge` metres from it: so a cloth that
    lies on the skin is outside."""
    a, b, c = (cloth[faces[samples.faces, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal *= nudge / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    both = np.concatenate([samples.points + normal, samples.points - normal])
    above, below = winding_numbers(both, body, body_faces).reshape(2, -1) > 0
    return samples.where(above & below)


def _inside_open(
    cloth: np.ndarray,
    faces: np.ndarray,
    body: np.ndarray,
    body_faces: np.ndarray,
    pairs: TrianglePairs,
    spacing: float,
) -> _Inside:
    depths = np.maximum(-pseudonormal_distances(cloth, body, body_faces), 0.0)
    doubtful = (depths[faces] > 0.0).any(axis=1)
    doubtful[pairs.faces[:, 0]] = True
    samples = triangle_samples(cloth, faces, np.flatnonzero(doubtful), spacing, CROSSED_SPLIT)
    distances = pseudonormal_distances(samples.points, body, body_faces)
    inside = distances < 0.0
    return _Inside(
        depths=depths,
        area=float(samples.areas[inside].sum()),
        sampled=float(triangle_areas(cloth, faces)[doubtful].sum()),
        sample_depths=-distances[inside],
        sample_areas=samples.areas[inside],
        method=PSEUDONORMAL,
    )
