"""Quality of a garment's triangulation: shape, size, curves kept, distance to the surface it came from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from muslin.eval.metrics.hausdorff import hausdorff
from muslin.eval.metrics.panel_curves import (
    curve_distances,
    curve_length_errors,
    mismatched_seam_vertices,
)
from muslin.eval.metrics.surface_sampling import surface_distance
from muslin.eval.metrics.triangle_quality import (
    angles,
    coefficient_of_variation,
    degenerate_and_inverted,
    distortion,
)
from muslin.garments.boundary_angles import boundary_angles, corners_at
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh

SHARP = np.radians(20.0)
GOOD = np.radians(30.0)


@dataclass(frozen=True)
class SurfaceError:
    """Mean distance of two draped meshes, and the upper bound of their Hausdorff distance, metres."""

    mean: float
    hausdorff: float


@dataclass(frozen=True)
class MeshQuality:
    """Figures of one mesh, in panel space but for `surface`; angles in radians.

    vertices, panel_vertices, faces: counts; a seam vertex is one vertex and several panel vertices
    min_angle: smallest angle, away from corners that the pattern makes sharper than SHARP
    below_sharp, below_good: shares of angles below SHARP (20 degrees) and GOOD (30 degrees), each away from
        corners that the pattern makes sharper than that
    mean_distortion, max_distortion: see `distortion`; 1 is equilateral
    area_variation: coefficient of variation of the areas
    degenerate, inverted, degenerate_uv, inverted_uv: see `degenerate_and_inverted`; in panel space and in uv
    curve_error: largest relative error of the length of a boundary or seam curve; None without a source
    curve_distance: farthest that such a curve lies from the source's, metres; None without a source
    panel_area_error: largest relative error of a panel's area; None without a source
    seam_mismatches: see `mismatched_seam_vertices`; None without a source
    surface: distance to the source; None without positions of both
    """

    vertices: int
    panel_vertices: int
    faces: int
    min_angle: float
    below_sharp: float
    below_good: float
    mean_distortion: float
    max_distortion: float
    area_variation: float
    degenerate: int
    inverted: int
    degenerate_uv: int
    inverted_uv: int
    curve_error: float | None = None
    curve_distance: float | None = None
    panel_area_error: float | None = None
    seam_mismatches: int | None = None
    surface: SurfaceError | None = None


def quality(
    mesh: GarmentMesh,
    source: GarmentMesh | None = None,
    positions: NDArray[np.float64] | None = None,
    source_positions: NDArray[np.float64] | None = None,
) -> MeshQuality:
    """Quality of `mesh`, and what it kept of the `source` that it was made from.

    positions (V, 3), source_positions (V', 3): metres; give both or none. InputError for one alone.
    """
    found = angles(mesh.panel_vertices, mesh.panel_faces)
    sharp = found[~forced_corners(mesh, SHARP, source)]
    good = found[~forced_corners(mesh, GOOD, source)]
    shape = distortion(mesh.panel_vertices, mesh.panel_faces)
    degenerate, inverted = degenerate_and_inverted(mesh.panel_vertices, mesh.panel_faces)
    degenerate_uv, inverted_uv = degenerate_and_inverted(mesh.uv, mesh.panel_faces)
    return MeshQuality(
        vertices=mesh.num_vertices,
        panel_vertices=len(mesh.panel_vertices),
        faces=len(mesh.faces),
        min_angle=float(sharp.min()),
        below_sharp=float((sharp < SHARP).mean()),
        below_good=float((good < GOOD).mean()),
        mean_distortion=float(shape.mean()),
        max_distortion=float(shape.max()),
        area_variation=coefficient_of_variation(np.abs(mesh.face_areas)),
        degenerate=degenerate,
        inverted=inverted,
        degenerate_uv=degenerate_uv,
        inverted_uv=inverted_uv,
        curve_error=None if source is None else float(curve_length_errors(mesh, source).max()),
        curve_distance=None if source is None else float(curve_distances(mesh, source).max()),
        panel_area_error=None if source is None else float(panel_area_errors(mesh, source).max()),
        seam_mismatches=None if source is None else mismatched_seam_vertices(mesh, source),
        surface=_surface_error(mesh, source, positions, source_positions),
    )


def forced_corners(
    mesh: GarmentMesh, threshold: float, source: GarmentMesh | None = None
) -> NDArray[np.bool_]:
    """(F, 3) whether the pattern itself makes the angle of a triangle's corner smaller than `threshold`.

    It does at a boundary vertex v whose panel has an interior angle beta_v < threshold there: the angles of
    the triangles at v add up to beta_v, so none can reach the threshold however the panel is triangulated.
    Nothing else is left out: not the other two corners of such a triangle, and no vertex with beta_v >=
    threshold, where one triangle could fill the corner.

    beta_v is that of `source` where one is given, at its boundary vertex within ON_CORNER of v in the same
    panel, so that a mesh whose own boundary went wrong is not excused.
    """
    given = mesh if source is None else source
    confined = boundary_angles(given, angles(given.panel_vertices, given.panel_faces))
    return corners_at(mesh, given, confined < threshold)


def panel_area_errors(mesh: GarmentMesh, source: GarmentMesh) -> NDArray[np.float64]:
    """|a - A| / A of each panel of `source`; a its area in `mesh`, A in `source`."""
    count = len(source.panel_names)
    area = np.bincount(mesh.face_panel, mesh.face_areas, minlength=count)
    given = np.bincount(source.face_panel, source.face_areas, minlength=count)
    return np.abs(area - given) / given


def _surface_error(
    mesh: GarmentMesh,
    source: GarmentMesh | None,
    positions: NDArray[np.float64] | None,
    source_positions: NDArray[np.float64] | None,
) -> SurfaceError | None:
    if positions is None and source_positions is None:
        return None
    if source is None or positions is None or source_positions is None:
        raise InputError(
            "distance to the source: give source, positions and source_positions, or no positions at all"
        )
    pair = positions, mesh.faces, source_positions, source.faces
    return SurfaceError(surface_distance(*pair).mean, hausdorff(*pair).upper)
