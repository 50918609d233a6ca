"""Nearest points of a collider, against libigl's."""

from __future__ import annotations

import igl
import numpy as np
import trimesh

from muslin.sim.remesh.obstacle import CLOSEST, Obstacle


def test_the_nearest_points_are_libigl_s_also_after_it_moved() -> None:
    shape = trimesh.creation.torus(0.3, 0.1)
    vertices, faces = np.array(shape.vertices), np.array(shape.faces)
    points = np.random.default_rng(0).uniform(-0.45, 0.45, (500, 3))
    obstacle = Obstacle(vertices, faces)
    for shift in (np.zeros(3), np.array([0.05, -0.02, 0.1])):
        obstacle.move(vertices + shift)
        away, distance = obstacle.nearest(points, 0.15)
        squared, _, nearest = igl.point_mesh_squared_distance(points, vertices + shift, faces)
        exact = np.sqrt(squared)
        near = exact < 0.15
        assert 0.2 < near.mean() < 0.9
        assert np.array_equal(np.isfinite(distance), near)
        np.testing.assert_allclose(distance[near], exact[near], atol=1e-6)
        expected = (points - nearest)[near] / exact[near][:, None]
        sharp = exact[near] > 1e-2
        np.testing.assert_allclose(away[near][sharp], expected[sharp], atol=1e-3)
        np.testing.assert_array_equal(away[~near], 0.0)


def test_a_point_on_the_surface_is_a_little_off_along_the_normal() -> None:
    obstacle = Obstacle(np.eye(3), np.array([(0, 1, 2)]))
    away, distance = obstacle.nearest(np.array([(0.5, 0.25, 0.25)]), 0.1)
    assert distance[0] == CLOSEST
    np.testing.assert_allclose(away[0], np.full(3, 3.0**-0.5), rtol=1e-12)


def test_where_there_is_no_collider_nothing_is_near() -> None:
    obstacle = Obstacle(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    assert np.isinf(obstacle.nearest(np.zeros((4, 3)), 1.0)[1]).all()
    full = Obstacle(np.eye(3), np.array([(0, 1, 2)]))
    assert full.nearest(np.zeros((0, 3)), 1.0)[1].shape == (0,)
