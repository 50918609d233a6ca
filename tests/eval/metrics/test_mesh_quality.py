"""What `quality` says of meshes whose figures are known."""

from dataclasses import replace

import numpy as np
import pytest

from muslin.eval.metrics.mesh_quality import GOOD, SHARP, SurfaceError, forced_corners, quality
from muslin.garments.designs.tee import TEE
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template


def panel(vertices: np.ndarray, faces: np.ndarray) -> GarmentMesh:
    """One panel, nothing sewn."""
    vertices, faces = np.array(vertices, dtype=float), np.array(faces, dtype=np.int32)
    low, size = vertices.min(axis=0), np.ptp(vertices, axis=0).max()
    return GarmentMesh(
        faces=faces,
        panel_faces=faces,
        panel_vertices=vertices,
        panel_to_vertex=np.arange(len(vertices), dtype=np.int32),
        face_panel=np.zeros(len(faces), dtype=np.int32),
        panel_names=("panel",),
        uv=(vertices - low) / size,
        name="panel",
        parameters={},
    )


def isosceles(apex: float) -> GarmentMesh:
    """One triangle with two sides of 1 m and this angle between them, degrees."""
    a = np.radians(apex)
    return panel([[0, 0], [1, 0], [np.cos(a), np.sin(a)]], [[0, 1, 2]])


def grid(n: int, size: float = 1.0) -> GarmentMesh:
    """A square of n x n cells in two right triangles each."""
    x, y = np.meshgrid(np.linspace(0, size, n + 1), np.linspace(0, size, n + 1), indexing="ij")
    i = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = np.concatenate([np.c_[i, i + n + 1, i + n + 2], np.c_[i, i + n + 2, i + 1]])
    return panel(np.stack([x.ravel(), y.ravel()], axis=1), faces)


def flat(mesh: GarmentMesh, height: float = 0.0) -> np.ndarray:
    return np.column_stack([mesh.panel_vertices, np.full(len(mesh.panel_vertices), height)])


def test_a_square_of_right_triangles():
    found = quality(grid(4))
    assert (found.vertices, found.panel_vertices, found.faces) == (25, 25, 32)
    assert found.min_angle == pytest.approx(np.pi / 4)
    assert (found.below_sharp, found.below_good) == (0.0, 0.0)
    assert found.mean_distortion == pytest.approx(np.sqrt(3.0)) == found.max_distortion
    assert found.area_variation == pytest.approx(0.0, abs=1e-12)
    assert (found.degenerate, found.inverted, found.degenerate_uv, found.inverted_uv) == (0, 0, 0, 0)
    assert (found.curve_error, found.curve_distance, found.panel_area_error) == (None, None, None)
    assert (found.seam_mismatches, found.surface) == (None, None)


def test_what_is_broken_is_counted_where_it_is():
    mesh = grid(4)
    vertices, uv = mesh.panel_vertices.copy(), mesh.uv.copy()
    vertices[6] = vertices[12]  # the ends of a diagonal, which two triangles share
    found = quality(replace(mesh, panel_vertices=vertices, uv=uv))
    assert (found.degenerate, found.inverted, found.degenerate_uv, found.inverted_uv) == (2, 0, 0, 0)
    uv[0] = [0.3, 0.3]  # past the diagonal's other end: both triangles of the corner turn over
    found = quality(replace(mesh, uv=uv))
    assert (found.degenerate, found.inverted, found.degenerate_uv, found.inverted_uv) == (0, 0, 0, 2)
    mirrored = quality(replace(mesh, uv=mesh.uv[:, ::-1]))
    assert (mirrored.inverted, mirrored.inverted_uv) == (0, 32)


def test_a_corner_that_the_pattern_makes_sharp_is_left_out():
    needle = quality(isosceles(15.0))
    assert needle.min_angle == pytest.approx(np.radians(82.5))
    assert (needle.below_sharp, needle.below_good) == (0.0, 0.0)
    # At 25 degrees the pattern forces an angle below 30, not one below 20.
    wedge = quality(isosceles(25.0))
    assert wedge.min_angle == pytest.approx(np.radians(25.0))
    assert (wedge.below_sharp, wedge.below_good) == (0.0, 0.0)
    assert quality(isosceles(35.0)).min_angle == pytest.approx(np.radians(35.0))


def test_a_corner_that_could_be_filled_by_one_triangle_is_not_excused():
    a = np.radians(25.0)
    split = panel(
        [[0, 0], [1, 0], [np.cos(a), np.sin(a)], [np.cos(2 * a), np.sin(2 * a)]], [[0, 1, 2], [0, 2, 3]]
    )
    assert not forced_corners(split, GOOD).any()
    assert quality(split).below_good == pytest.approx(2 / 6)


def test_a_sharp_corner_excuses_nothing_beside_it():
    mesh = isosceles(15.0)
    np.testing.assert_array_equal(forced_corners(mesh, SHARP), [[True, False, False]])
    # The base cut off close by: the corner is excused in the small triangle alone.
    thin = panel([[0, 0], [1, 0], [0.9659, 0.2588], [0.6, 0.0]], [[0, 3, 2], [3, 1, 2]])
    assert forced_corners(thin, SHARP).sum() == 1
    assert quality(thin).below_good == pytest.approx(1 / 5)


def test_a_boundary_that_a_mesh_made_sharp_is_not_excused():
    source = grid(4)
    vertices = source.panel_vertices.copy()
    vertices[0] = [-1.0, -1.0]
    mesh = replace(source, panel_vertices=vertices)
    assert forced_corners(mesh, GOOD).any()
    assert not forced_corners(mesh, GOOD, source).any()
    assert quality(mesh, source).min_angle < GOOD


def test_lengths_against_the_source():
    found = quality(grid(5, 1.02), grid(4))
    assert found.curve_error == pytest.approx(0.02)
    assert found.curve_distance == pytest.approx(0.02 * np.sqrt(2.0))  # the corner away from the origin
    assert found.panel_area_error == pytest.approx(1.02**2 - 1.0)
    assert found.seam_mismatches == 0


def test_distance_to_the_source():
    source, mesh = grid(4), grid(6)
    found = quality(mesh, source, flat(mesh, 0.01), flat(source)).surface
    assert isinstance(found, SurfaceError)
    assert found.mean == pytest.approx(0.01)
    assert 0.01 <= found.hausdorff <= 0.0102
    with pytest.raises(InputError, match="source_positions"):
        quality(mesh, source, flat(mesh))
    with pytest.raises(InputError, match="give source"):
        quality(mesh, None, flat(mesh), flat(source))


def test_a_garment_against_a_slow_count():
    mesh = template("tee", TEE.preset("top"), 403)
    found = quality(mesh, mesh)
    every, areas = [], []
    for corners in mesh.panel_vertices[mesh.panel_faces]:
        u, v = corners[1] - corners[0], corners[2] - corners[0]
        areas.append(0.5 * (u[0] * v[1] - u[1] * v[0]))
        for k in range(3):
            s, t = corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]
            every.append(np.arccos(s @ t / np.sqrt((s @ s) * (t @ t))))
    assert found.min_angle == pytest.approx(min(every))
    assert found.below_good == pytest.approx(sum(a < np.radians(30.0) for a in every) / len(every))
    assert found.area_variation == pytest.approx(np.std(areas) / np.mean(areas))
    assert found.curve_error == 0.0
