"""Cloth goes along with the collider near it, and flies where nothing is near."""

import igl
import numpy as np
import pytest
import trimesh
import warp as wp
from numpy.typing import NDArray

from muslin.sim.contact.carry import NEAR, Carry

Array = NDArray[np.float64]


def start(points: Array, flight: Array, body: trimesh.Trimesh, told: Array) -> tuple[Array, Array]:
    """`base` and `p` of cloth `points` (V, 3) that would fly by `flight` (V, 3)."""
    x = wp.array(np.concatenate([points, body.vertices]), dtype=wp.vec3d)
    motion = wp.array(np.concatenate([np.zeros_like(points), told]), dtype=wp.vec3d)
    base, p = wp.zeros_like(x), wp.zeros_like(x)
    carry = Carry(np.asarray(body.vertices), np.asarray(body.faces, np.int32), "cpu")
    carry.moves(x, motion, wp.array(points + flight, dtype=wp.vec3d), base, p)
    np.testing.assert_array_equal(p.numpy()[len(points) :], told)
    return base.numpy()[: len(points)], p.numpy()[: len(points)]


@pytest.fixture
def ball() -> trimesh.Trimesh:
    return trimesh.creation.icosphere(3, 0.2)


def shell(ball: trimesh.Trimesh, heights: Array, seed: int) -> Array:
    """Points at given heights above random places of a sphere's triangles."""
    draw = np.random.default_rng(seed)
    face = draw.integers(len(ball.faces), size=len(heights))
    inside = draw.dirichlet([2.0, 2.0, 2.0], size=len(heights))
    return np.einsum("ij,ijk->ik", inside, ball.triangles[face]) + heights[:, None] * ball.face_normals[face]


def test_near_a_turning_sphere_cloth_turns_with_it(ball):
    turn = trimesh.transformations.rotation_matrix(0.2, [1.0, 2.0, 0.5])[:3, :3]
    told = ball.vertices @ turn.T - ball.vertices
    points = shell(ball, np.full(200, 1e-6), seed=0)
    base, p = start(points, np.zeros_like(points), ball, told)
    np.testing.assert_allclose(points + base, points @ turn.T, atol=1e-6)
    np.testing.assert_allclose(p, base, atol=1e-6)


def test_no_vertex_moves_by_more_than_half_its_distance_relative_to_the_collider(ball):
    draw = np.random.default_rng(3)
    told = np.tile([0.004, -0.006, 0.008], (len(ball.vertices), 1)) + 0.03 * ball.vertices
    points = shell(ball, draw.uniform(1e-5, 0.05, size=500), seed=4)
    flight = 0.01 * draw.normal(size=points.shape)
    base, p = start(points, flight, ball, told)
    squared, face, closest = igl.point_mesh_squared_distance(
        points, ball.vertices, ball.faces.astype(np.int64)
    )
    relative = np.linalg.norm(p - base, axis=1)
    assert (relative <= 0.5 * np.sqrt(squared) * (1.0 + 1e-4) + 1e-7).all()
    free = np.linalg.norm(flight - base, axis=1) < 0.45 * np.sqrt(squared)
    assert 10 < free.sum() < 490
    np.testing.assert_allclose(p[free], flight[free], atol=1e-15)
    weights = trimesh.triangles.points_to_barycentric(ball.triangles[face], closest)
    motion = np.einsum("ij,ijk->ik", weights, told[ball.faces[face]])
    np.testing.assert_allclose(base, motion, atol=1e-5)


def test_far_from_the_collider_cloth_flies_freely(ball):
    points = shell(ball, np.full(50, NEAR + 0.01), seed=1)
    flight = np.random.default_rng(2).normal(size=points.shape)
    base, p = start(points, flight, ball, np.ones_like(ball.vertices))
    np.testing.assert_array_equal(base, p)
    np.testing.assert_allclose(p, flight, atol=1e-15)
