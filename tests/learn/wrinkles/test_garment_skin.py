"""The skin of a garment, and what cloth is told of its motion through it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from muslin.garments.correspondence import correspondence
from muslin.garments.errors import InputError
from muslin.garments.template import template
from muslin.learn.wrinkles.fields import FIELDS, GRAVITY, gaps, motion_fields
from muslin.learn.wrinkles.skin import GarmentSkin, garment_skin
from muslin.sim.body.joints import JOINT
from muslin.sim.body.load import load_body
from muslin.sim.body.skinning import bind
from muslin.sim.dataset.sample import BodyTrack

BODY = load_body("female")
MESH = template("tee", {"garment_length": 1.2}, 403)
FPS = 30.0
DOWN = np.array([0.0, -1.0, 0.0])


def around_the_body() -> np.ndarray:
    """(V, 3) the long tee in T-pose: tubes about trunk and arms, by the shape of its panels."""
    panel = MESH.panel_to_vertex
    found = np.zeros((MESH.num_vertices, 3))
    for number in range(MESH.face_panel.max() + 1):
        own = np.unique(MESH.panel_faces[MESH.face_panel == number])
        x, y = (MESH.panel_vertices[own] - MESH.panel_vertices[own].mean(0)).T
        spread = 2.0 * (y - y.min()) / np.ptp(y) - 1.0
        across = np.clip(2.0 * (x - x.min()) / np.ptp(x) - 1.0, -1.0, 1.0)
        if number < 2:
            side = 1.0 - 2.0 * number
            found[panel[own]] = np.stack(
                [0.22 * across, -0.2 + 0.5 * spread, side * 0.2 * np.sqrt(1.0 - 0.99 * across**2)], axis=1
            )
        else:
            side = 2.0 * (number - 2) - 1.0
            turn = np.pi * across
            middle = np.array([side * 0.4, 0.22, -0.03])
            ring = np.stack([side * 0.1 * spread, 0.1 * np.cos(turn), 0.1 * np.sin(turn)], axis=1)
            found[panel[own]] = middle + ring
    return found


POINTS = around_the_body()


@pytest.fixture(scope="module")
def skin() -> GarmentSkin:
    return garment_skin(MESH, POINTS, BODY)


def poses(count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(scale=0.3, size=(count, 24, 3))


def track(
    theta: np.ndarray, translations: np.ndarray | None = None, beta: tuple[float, ...] = (0.0,)
) -> BodyTrack:
    moved = np.zeros((len(theta), 3)) if translations is None else translations
    return BodyTrack("female", BODY.digest, np.array(beta), theta, moved)


def test_weights_are_a_partition_of_unity(skin: GarmentSkin) -> None:
    assert skin.weights.min() >= 0.0
    np.testing.assert_allclose(skin.weights.sum(axis=1), 1.0)


def test_the_mean_body_in_t_pose_leaves_all_where_it_is(skin: GarmentSkin) -> None:
    np.testing.assert_allclose(skin.posed(POINTS, [0.0], np.zeros((1, 24, 3)))[0], POINTS, atol=1e-12)


def test_unposing_is_the_inverse(skin: GarmentSkin) -> None:
    theta, beta = poses(4), [1.2, -0.7]
    x = POINTS + np.random.default_rng(1).normal(scale=0.02, size=(4, *POINTS.shape))
    moved = np.random.default_rng(2).normal(size=(4, 3))
    y = skin.posed(x, beta, theta, moved)
    np.testing.assert_allclose(skin.unposed(y, beta, theta, moved), x, atol=1e-10)


def test_a_body_that_turns_as_a_whole_turns_its_garment(skin: GarmentSkin) -> None:
    theta = np.zeros((1, 24, 3))
    theta[0, 0] = [0.3, 1.1, -0.4]
    shift = np.array([[0.5, 1.0, -2.0]])
    pelvis = BODY.rest_joints()[0]
    expected = Rotation.from_rotvec(theta[0, 0]).apply(POINTS - pelvis) + pelvis + shift
    np.testing.assert_allclose(skin.posed(POINTS, [0.0], theta, shift)[0], expected, atol=1e-12)


def test_what_cannot_be_unposed_is_refused(skin: GarmentSkin) -> None:
    theta = np.zeros((1, 24, 3))
    theta[0, JOINT["left_hip"]] = [np.pi, 0.0, 0.0]
    with pytest.raises(InputError, match="cannot be unposed"):
        skin.unposed(POINTS[None], [0.0], theta)


def test_loose_cloth_changes_from_leg_to_leg_over_a_width(skin: GarmentSkin) -> None:
    """Nearest points jump between the legs from one vertex to the next; the skin does not."""
    edges = np.concatenate([MESH.faces[:, [0, 1]], MESH.faces[:, [1, 2]], MESH.faces[:, [2, 0]]])
    low = (POINTS[edges, 1] < -0.4).all(1)
    legs = [JOINT["left_hip"], JOINT["left_knee"]]

    def steepest(weights: np.ndarray) -> float:
        left = weights[:, legs].sum(1)
        return float(np.abs(left[edges[low, 0]] - left[edges[low, 1]]).max())

    assert low.sum() > 50
    assert steepest(bind(POINTS, BODY).weights) > 0.8
    assert steepest(skin.weights) < 0.4


def test_another_triangulation_follows_alike(skin: GarmentSkin) -> None:
    other = template("tee", {"garment_length": 1.2}, 1400)
    place = correspondence(MESH, other)
    theta = poses(1, 3)
    carried = skin.carried(place)
    np.testing.assert_allclose(carried.weights.sum(axis=1), 1.0)
    mine, theirs = skin.posed(POINTS, [0.5], theta), carried.posed(place.carry(POINTS), [0.5], theta)
    # At shared vertices of the pattern exactly; in between products of interpolations differ a little.
    assert np.linalg.norm(place.carry(mine[0]) - theirs[0], axis=1).mean() < 2e-3


def test_who_stands_still_is_told_of_gravity_alone(skin: GarmentSkin) -> None:
    told = motion_fields(skin, POINTS, track(np.zeros((3, 24, 3))), FPS).reshape(3, -1, 4, 3)
    np.testing.assert_allclose(told[:, :, 0], np.broadcast_to(DOWN, told[:, :, 0].shape), atol=1e-12)
    assert np.abs(told[:, :, 1:3]).max() < 1e-9
    assert told.shape[2] * 3 == FIELDS


def test_velocity_and_acceleration_of_a_fall(skin: GarmentSkin) -> None:
    """Falling bodies feel g; differences of a parabola are exact."""
    times = np.arange(5) / FPS
    fall = np.stack([2.0 * times, -0.5 * GRAVITY * times**2, 0.0 * times], axis=1)
    told = motion_fields(skin, POINTS, track(np.zeros((5, 24, 3)), fall), FPS).reshape(5, -1, 4, 3)
    np.testing.assert_allclose(told[:, :, 1, 0], 2.0, atol=1e-9)
    np.testing.assert_allclose(told[:, :, 2], np.broadcast_to(DOWN, told[:, :, 2].shape), atol=1e-7)


def test_fields_do_not_know_where_the_body_is_nor_which_way_it_faces(skin: GarmentSkin) -> None:
    theta, moved = np.cumsum(0.2 * poses(4), axis=0), np.cumsum(0.01 * poses(4, 5)[:, 0], axis=0)
    turn = Rotation.from_rotvec([0.0, 2.0, 0.0])
    turned = theta.copy()
    turned[:, 0] = (turn * Rotation.from_rotvec(theta[:, 0])).as_rotvec()
    # The root turns about the pelvis, not about the origin.
    pelvis = BODY.rest_joints()[0]
    there = turn.apply(moved + pelvis) - pelvis + [1.0, 0.0, -3.0]
    here = motion_fields(skin, POINTS, track(theta, moved), FPS)
    np.testing.assert_allclose(motion_fields(skin, POINTS, track(turned, there), FPS), here, atol=1e-6)


def test_gaps_point_away_from_the_body_and_are_cut(skin: GarmentSkin) -> None:
    still = track(np.zeros((1, 24, 3)))
    vertices = BODY.vertices(np.zeros(1), np.zeros((24, 3)))
    faces = BODY.faces[::50]
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    near = corners.mean(1) + 0.001 * normals
    found = gaps(skin, near[None], still)[0]
    right = np.isclose(found, 0.001 / 0.05 * normals, atol=1e-6).all(1)
    assert right.mean() > 0.97  # all but lips and the like, where the body is nearer to itself
    far = gaps(skin, near[None] + [0.0, 0.0, 3.0], still)[0]
    np.testing.assert_allclose(np.linalg.norm(far, axis=1), 2.0)


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_few_frames_do(skin: GarmentSkin, frames: int) -> None:
    told = motion_fields(skin, POINTS, track(poses(frames)), FPS)
    assert told.shape == (frames, MESH.num_vertices, FIELDS)
    assert np.isfinite(told).all()
