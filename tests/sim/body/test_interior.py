from __future__ import annotations

import igl
import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from muslin.garments.errors import InputError
from muslin.sim.body import load_body
from muslin.sim.body.interior import CREASE_M, interior_points, masked_face_is_interior

Floats = NDArray[np.float64]
Faces = NDArray[np.int64]


def sphere(centre: tuple[float, float, float]) -> tuple[Floats, Faces]:
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=1.0)
    return np.array(mesh.vertices) + centre, np.array(mesh.faces)


def joined(*meshes: tuple[Floats, Faces]) -> tuple[Floats, Faces]:
    starts = np.cumsum([0, *(len(v) for v, _ in meshes)])
    faces = [f + start for (_, f), start in zip(meshes, starts[:-1], strict=True)]
    return np.concatenate([v for v, _ in meshes]), np.concatenate(faces)


def test_inside_of_a_sphere_is_its_radius() -> None:
    vertices, faces = sphere((0.0, 0.0, 0.0))
    points = np.random.default_rng(0).uniform(-1.5, 1.5, size=(4000, 3))
    radius = np.linalg.norm(points, axis=1)
    clear = np.abs(radius - 1.0) > 0.01
    np.testing.assert_array_equal(interior_points(vertices, faces, points)[clear], (radius < 1.0)[clear])


def test_overlapping_parts_are_one_inside() -> None:
    vertices, faces = joined(sphere((-0.5, 0.0, 0.0)), sphere((0.5, 0.0, 0.0)))
    points = np.array([[0.0, 0, 0], [-1.2, 0, 0], [1.2, 0, 0], [1.6, 0, 0], [0, 0.95, 0]])
    assert interior_points(vertices, faces, points).tolist() == [True, True, True, False, False]


def test_agrees_with_exact_winding_numbers_on_a_body() -> None:
    body = load_body("female")
    points = body.v_template[::40] + np.random.default_rng(1).normal(
        scale=0.02, size=body.v_template[::40].shape
    )
    exact = igl.winding_number(body.v_template, body.faces.astype(np.int64), points) > 0.5
    np.testing.assert_array_equal(interior_points(body.v_template, body.faces, points), exact)


def test_faces_of_a_convex_body_face_outside() -> None:
    vertices, faces = sphere((0.0, 0.0, 0.0))
    assert not masked_face_is_interior(vertices, faces, np.arange(len(faces)), 0.01).any()


def test_faces_swallowed_by_another_part_are_interior() -> None:
    left, right = sphere((-0.5, 0.0, 0.0)), sphere((0.5, 0.0, 0.0))
    vertices, faces = joined(left, right)
    centroids = left[0][left[1]].mean(axis=1)
    depth = 1.0 - np.linalg.norm(centroids - [0.5, 0.0, 0.0], axis=1)
    answer = masked_face_is_interior(vertices, faces, np.arange(len(left[1])), 0.005)
    assert answer[depth > 0.1].all()
    assert not answer[depth < -0.2].any()


def test_two_close_sheets_are_interior_only_within_the_gap() -> None:
    """Two boxes 4 mm apart: the facing sides have the other box in front of them, the others have not."""
    box = trimesh.creation.box(extents=[1.0, 1.0, 1.0]).subdivide().subdivide()
    vertices, faces = np.array(box.vertices), np.array(box.faces)
    both = joined((vertices, faces), (vertices + np.array([1.004, 0.0, 0.0]), faces))
    facing = np.flatnonzero((vertices[faces][:, :, 0] > 0.4999).all(axis=1))
    others = np.flatnonzero((vertices[faces][:, :, 0] < 0.4999).any(axis=1))
    assert masked_face_is_interior(*both, facing, 0.005).all()
    assert not masked_face_is_interior(*both, facing, 0.003).any()
    assert not masked_face_is_interior(*both, others, 0.005).any()


def test_faces_at_a_crease_are_interior_within_its_reach() -> None:
    """Spheres that overlap by 3 mm, of triangles far smaller than `CREASE_M`."""
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.1)
    one, faces = np.array(ball.vertices), np.array(ball.faces)
    vertices, both = joined((one, faces), (one + np.array([0.197, 0.0, 0.0]), faces))
    passed = masked_face_is_interior(vertices, both, np.arange(len(faces)), 1e-3)
    corners = one[faces]
    axial, radial = corners[:, :, 0], np.linalg.norm(corners[:, :, 1:], axis=2)
    inside = vertices[: len(one)][np.linalg.norm(one - [0.197, 0.0, 0.0], axis=1) < 0.0996]
    near = cKDTree(inside).query(corners.reshape(-1, 3))[0].reshape(-1, 3).min(axis=1)
    assert passed[near < 0.98 * CREASE_M].all()
    assert not passed[(near > 1.05 * CREASE_M) & ((axial < 0.0) | (radial > 0.03)).all(axis=1)].any()


def test_arm_through_the_trunk_is_found_on_the_body() -> None:
    body = load_body("male")
    theta = np.zeros((24, 3))
    theta[18] = [0.0, 0.0, np.radians(-150)]
    theta[16] = [0.0, 0.0, np.radians(-60)]
    vertices = body.vertices(None, theta)
    hand = np.flatnonzero((body.weights[:, [20, 22]].sum(axis=1) > 0.9)[body.faces].all(axis=1))
    head = np.flatnonzero((body.v_template[:, 1] > body.joint_template[15, 1] + 0.12)[body.faces].all(axis=1))
    assert masked_face_is_interior(vertices, body.faces, hand, 0.003).mean() > 0.3
    assert not masked_face_is_interior(vertices, body.faces, head, 0.003).any()


def test_no_points_and_no_faces() -> None:
    vertices, faces = sphere((0.0, 0.0, 0.0))
    assert interior_points(vertices, faces, np.zeros((0, 3))).shape == (0,)
    assert masked_face_is_interior(vertices, faces, np.zeros(0, dtype=np.int64), 0.01).shape == (0,)


def test_bad_arguments_are_named() -> None:
    vertices, faces = sphere((0.0, 0.0, 0.0))
    with pytest.raises(InputError, match="gap is 0"):
        masked_face_is_interior(vertices, faces, [0], 0.0)
    with pytest.raises(InputError, match=f"the body has {len(faces)} faces"):
        masked_face_is_interior(vertices, faces, [len(faces)], 0.01)
    with pytest.raises(InputError, match="NaN"):
        interior_points(vertices, faces, [[np.nan, 0.0, 0.0]])
