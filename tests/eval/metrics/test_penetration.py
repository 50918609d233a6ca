"""Signed distance and penetration of a sphere and of overlapping cubes, in closed form."""

import numpy as np
import pytest
import trimesh

from muslin.eval.metrics.penetration import (
    PSEUDONORMAL,
    WINDING_NUMBER,
    distances_to_body,
    is_closed,
    nearest_distances,
    penetration,
    pseudonormal_distances,
    signed_distances,
)
from muslin.eval.metrics.surface_sampling import point_to_surface
from muslin.garments.errors import InputError

BOX = trimesh.creation.box(extents=(2, 2, 2))
BOX_V, BOX_F = np.array(BOX.vertices), np.array(BOX.faces)


def box_distance(p: np.ndarray) -> np.ndarray:
    q = np.abs(p) - 1
    return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)


def test_box_in_closed_form():
    points = np.random.default_rng(0).uniform(-2, 2, size=(500, 3))
    assert signed_distances(points, BOX_V, BOX_F) == pytest.approx(box_distance(points))


def test_sphere_converges_quadratically():
    points = np.random.default_rng(1).uniform(-1.5, 1.5, size=(200, 3))
    errors = []
    for subdivisions in (2, 3, 4):
        mesh = trimesh.creation.icosphere(subdivisions)
        s = signed_distances(points, np.array(mesh.vertices), np.array(mesh.faces))
        errors.append(np.abs(s - (np.linalg.norm(points, axis=1) - 1)).max())
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.35)
    assert errors[1] / errors[2] == pytest.approx(4, rel=0.35)


def test_inside_two_overlapping_boxes_is_inside():
    v = np.concatenate([BOX_V, BOX_V + np.array([1, 0, 0])])
    f = np.concatenate([BOX_F, BOX_F + len(BOX_V)])
    points = np.array([[0.5, 0, 0], [-0.5, 0, 0], [2.5, 0, 0]])
    assert (signed_distances(points, v, f) < 0).tolist() == [True, True, False]


def test_ratio_and_depths():
    found = penetration(np.array([[0.5, -0.1], [-0.3, 0.2]]))
    assert (found.ratio, found.depth_mean, found.depth_max) == pytest.approx((0.5, 0.2, 0.3))
    clear = penetration(np.ones(3))
    assert (clear.ratio, clear.depth_mean, clear.depth_max) == (0, 0, 0)


def test_closedness():
    assert is_closed(BOX_F)
    assert not is_closed(BOX_F[:-1])
    flipped = BOX_F.copy()
    flipped[0] = flipped[0, ::-1]
    assert not is_closed(flipped)
    with pytest.raises(InputError, match="not closed"):
        signed_distances(np.zeros((1, 3)), BOX_V, BOX_F[:-1])


def test_sign_by_pseudonormal_agrees_on_a_simple_surface():
    mesh = trimesh.creation.icosphere(3)
    v, f = np.array(mesh.vertices), np.array(mesh.faces)
    points = np.random.default_rng(2).uniform(-1.2, 1.2, size=(500, 3))
    assert pseudonormal_distances(points, v, f) == pytest.approx(signed_distances(points, v, f))


def test_open_body_falls_back_and_says_so():
    points = np.array([[0, 0, -0.9], [0, 0, -1.1], [0.5, 0, -0.8]])
    top = BOX_V[BOX_F].mean(axis=1)[:, 2] > 0.9
    found = distances_to_body(points, BOX_V, BOX_F[~top])
    assert found.method == PSEUDONORMAL
    assert found.values == pytest.approx(box_distance(points))
    assert distances_to_body(points, BOX_V, BOX_F).method == WINDING_NUMBER


def test_leaving_far_faces_out_changes_no_distance():
    mesh = trimesh.creation.icosphere(3)
    v, f = np.array(mesh.vertices), np.array(mesh.faces)
    rng = np.random.default_rng(3)
    for spread in (0.01, 0.3, 3.0):
        points = rng.normal(size=3) + spread * rng.normal(size=(50, 3))
        assert nearest_distances(points, v, f).tolist() == point_to_surface(points, v, f).tolist()
    assert len(nearest_distances(np.zeros((0, 3)), v, f)) == 0
