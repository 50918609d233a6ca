"""The field's definitions of penetration: where each is right, and where they part."""

import numpy as np
import pytest
import trimesh

from muslin.eval.metrics.penetration_definitions import (
    distances_by_face_centre,
    distances_by_vertex_normal,
    penetration_definitions,
    share_by_sample_angle,
)
from muslin.garments.errors import InputError
from tests.eval.metrics.shapes import lifted, sheet, sphere

BOX = trimesh.creation.box(extents=(2, 2, 2))
BOX_V, BOX_F = np.array(BOX.vertices), np.array(BOX.faces)


def test_signed_lengths_on_a_sphere():
    v, f = sphere(4, 1.0)
    for radius in (0.98, 1.0005, 1.02):
        points, _ = sphere(2, radius)
        normal = distances_by_vertex_normal(points, v, f)
        assert normal == pytest.approx(np.full(len(points), radius - 1), abs=2e-3)
        centre = distances_by_face_centre(points, v, f)
        assert centre == pytest.approx(np.full(len(points), radius - 1 - 1e-3), abs=2e-3)


@pytest.mark.parametrize(
    ("height", "expected"),
    [
        # A sheet over the middle of a box's top, 1.6 m wide. The box's corners are farther from it than its
        # faces, and their normals lean outwards: seen from a corner, all of it is behind. Near the sheet's
        # edges some vertices have a centre of the box's sides for the nearest, and are behind that.
        (0.01, {"signed_distance": 0.0, "nearest_vertex": 1.0, "face_centre": 10 / 81, "sample_angle": 0.0}),
        # Half a millimetre above: HOOD's margin takes it in.
        (0.0005, {"signed_distance": 0.0, "nearest_vertex": 1.0, "face_centre": 1.0, "sample_angle": 0.0}),
        # Two millimetres inside: only counts of intersections see nothing.
        (-0.002, {"signed_distance": 1.0, "nearest_vertex": 1.0, "face_centre": 1.0, "sample_angle": 1.0}),
    ],
)
def test_definitions_differ_by_everything(height, expected):
    uv, f = sheet(1.6, 1.6, 8, 8)
    found = penetration_definitions(lifted(uv - 0.8, 1.0 + height), f, BOX_V, BOX_F, samples=5000).to_dict()
    assert (found.pop("body_edges"), found.pop("self_edges")) == (0, 0)
    assert found == pytest.approx(expected)


def test_counts_of_edges_see_a_crossing_whatever_its_depth():
    # A sheet on edge, cut by the top of the box between its rows of vertices: 8 vertical edges and the
    # diagonals between them cross, while the share inside is a half.
    uv, f = sheet(1.4, 1.0, 7, 3, "right")
    v = np.column_stack([uv[:, 0] - 0.7, np.full(len(uv), 0.05), uv[:, 1] + 0.5])
    found = penetration_definitions(v, f, BOX_V, BOX_F, samples=20_000)
    assert found.body_edges == 8 + 7
    assert found.signed_distance == 0.5
    assert found.self_edges == 0


def test_counts_of_own_edges():
    uv, f = sheet(1.0, 1.0, 4, 4, "right")
    # A spike of one triangle through the sheet: its two long edges cross, no edge of the sheet does.
    spike = np.array([[0.4, 0.35, -1.0], [0.41, 0.36, 1.0], [0.42, 0.34, 1.0]])
    v = np.concatenate([lifted(uv), spike])
    faces = np.concatenate([f, [[len(uv), len(uv) + 1, len(uv) + 2]]])
    far, far_faces = BOX_V + 10.0, BOX_F
    assert penetration_definitions(v, faces, far, far_faces, samples=10).self_edges == 2
    # A vertical sheet through it: both sheets' edges count.
    up = np.column_stack([uv[:, 0], np.full(len(uv), 0.37), uv[:, 1] - 0.41])
    v, both = np.concatenate([lifted(uv), up]), np.concatenate([f, f + len(uv)])
    found = penetration_definitions(v, both, far, far_faces, samples=10)
    assert found.self_edges == (5 + 4) + (5 + 4)


def test_sample_angle_is_nearer_to_the_truth_with_more_samples():
    v, f = sphere(3, 1.0)
    shell, _ = sphere(3, 1.01)
    shares = [share_by_sample_angle(shell, f, v, f, samples) for samples in (200, 2000, 20_000)]
    assert shares[0] > shares[1] > shares[2]
    assert shares[2] < 0.01
    inner, _ = sphere(3, 0.98)
    assert share_by_sample_angle(inner, f, v, f, 20_000) == 1.0


def test_bad_input_is_named():
    uv, f = sheet(1.0, 1.0, 2, 2)
    with pytest.raises(InputError, match="samples = 0"):
        penetration_definitions(lifted(uv), f, BOX_V, BOX_F, samples=0)
    with pytest.raises(InputError, match="of area 0"):
        share_by_sample_angle(np.zeros((3, 3)), np.array([[0, 1, 2]]), BOX_V, BOX_F, 10)
    with pytest.raises(InputError, match="body: NaN"):
        penetration_definitions(lifted(uv), f, BOX_V * np.nan, BOX_F)
