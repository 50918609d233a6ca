from dataclasses import replace

import igl
import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from muslin.learn.wrinkles.fields import FIELDS, GRAVITY, NEAR, gaps, motion_fields
from muslin.sim.body.load import load_body
from muslin.sim.dataset.sample import BodyTrack
from tests.learn.wrinkles.worn import BETA, FPS, skinned, swinging, track, turned

GRAVITY_DOWN, VELOCITY, ACCELERATION, GAP = (slice(k, k + 3) for k in (0, 3, 6, 9))


def fields(moving: BodyTrack) -> np.ndarray:
    _, points, skin = skinned()
    return motion_fields(skin, points, moving, FPS)


def gliding(translations: np.ndarray) -> BodyTrack:
    """In T-pose, where the blended transforms are all the identity."""
    return track(np.zeros((len(translations), 24, 3)), translations)


def everywhere(value: ArrayLike, frames: int) -> np.ndarray:
    """(frames, V, 3)"""
    return np.broadcast_to(value, (frames, skinned()[0].num_vertices, 3))


@pytest.mark.parametrize("frames", [1, 2, 3, 6])
def test_every_place_has_its_numbers_in_every_frame(frames: int) -> None:
    found = fields(swinging(frames))
    assert found.shape == (frames, skinned()[0].num_vertices, FIELDS)
    assert np.isfinite(found).all()


def test_who_stands_still_feels_gravity_alone() -> None:
    found = fields(gliding(np.tile([0.3, 1.0, -2.0], (4, 1))))
    np.testing.assert_allclose(found[..., GRAVITY_DOWN], everywhere([0.0, -1.0, 0.0], 4), atol=1e-12)
    np.testing.assert_allclose(found[..., VELOCITY], 0.0, atol=1e-12)
    np.testing.assert_allclose(found[..., ACCELERATION], 0.0, atol=1e-10)
    np.testing.assert_allclose(found[1:, :, GAP], found[:-1, :, GAP], atol=1e-9)


def test_a_steady_way_has_one_velocity() -> None:
    velocity = np.array([0.6, -0.1, 1.4])
    found = fields(gliding(np.arange(5)[:, None] / FPS * velocity))
    np.testing.assert_allclose(found[..., VELOCITY], everywhere(velocity, 5), atol=1e-9)
    np.testing.assert_allclose(found[..., ACCELERATION], 0.0, atol=1e-9)


def test_who_falls_has_the_acceleration_of_gravity() -> None:
    time = np.arange(6)[:, None] / FPS
    velocity = np.array([2.0, 3.0, 0.0])
    down = np.array([0.0, -1.0, 0.0])
    found = fields(gliding(time * velocity + 0.5 * GRAVITY * time**2 * down))
    # Gravity and acceleration are then equal: an accelerometer would say nothing.
    np.testing.assert_allclose(found[..., ACCELERATION], found[..., GRAVITY_DOWN], atol=1e-8)
    # The mean from the frame before, so that of half a frame earlier; the first frame has that of the second.
    middle = np.array([1, 1, 2, 3, 4, 5]) - 0.5
    expected = velocity + GRAVITY * middle[:, None] / FPS * down
    np.testing.assert_allclose(found[..., VELOCITY], everywhere(expected[:, None], 6), atol=1e-9)


def test_two_frames_have_a_velocity_and_no_acceleration_and_one_has_neither() -> None:
    two = fields(gliding(np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]])))
    np.testing.assert_allclose(two[..., VELOCITY], everywhere([3.0, 0.0, 0.0], 2), atol=1e-9)
    assert (two[..., ACCELERATION] == 0.0).all()
    one = fields(swinging(1))
    assert (one[..., VELOCITY] == 0.0).all()
    assert (one[..., ACCELERATION] == 0.0).all()


def test_later_frames_make_no_difference_to_earlier_ones() -> None:
    moving = swinging(7)
    first = replace(moving, poses=moving.poses[:4], translations=moving.translations[:4])
    np.testing.assert_allclose(fields(moving)[:4], fields(first), atol=1e-9)


def test_what_turns_is_drawn_to_the_axis() -> None:
    rate, axis = 3.0, np.array([0.0, 1.0, 0.0])
    poses = np.zeros((6, 24, 3))
    poses[:, 0] = np.arange(6)[:, None] / FPS * rate * axis
    found = fields(track(poses))
    _, points, skin = skinned()
    arm = skin.posed(points, BETA, poses[:1])[0] - skin.model.rest_joints(BETA)[0]
    arm[:, 1] = 0.0
    # Differences over one frame lag by half of it, and chords are shorter than arcs by this.
    half = Rotation.from_rotvec(-0.5 * rate / FPS * axis)
    sinc = 2.0 * FPS / rate * np.sin(0.5 * rate / FPS)
    np.testing.assert_allclose(
        found[3, :, VELOCITY], sinc * half.apply(np.cross(rate * axis, arm)), atol=1e-9
    )
    lag = Rotation.from_rotvec(-rate / FPS * axis)
    inward = -(rate**2) * sinc**2 / GRAVITY * lag.apply(arm)
    np.testing.assert_allclose(found[3, :, ACCELERATION], inward, atol=1e-9)


@pytest.mark.parametrize("angle", [0.7, -2.5])
def test_it_makes_no_difference_where_the_body_stands_and_which_way_it_faces(angle: float) -> None:
    moving = swinging(5)
    there = turned(moving, angle, np.array([3.0, 0.5, -8.0]))
    np.testing.assert_allclose(fields(there), fields(moving), atol=1e-7)


def test_forces_are_told_as_the_unposed_garment_sees_them() -> None:
    """On its belly what was ahead of the body is below it."""
    poses = np.zeros((1, 24, 3))
    poses[0, 0, 0] = 0.5 * np.pi
    found = fields(track(poses))
    np.testing.assert_allclose(found[0, :, GRAVITY_DOWN], everywhere([0.0, 0.0, 1.0], 1)[0], atol=1e-12)
    upright = fields(track(np.zeros((1, 24, 3))))
    np.testing.assert_allclose(found[..., GAP], upright[..., GAP], atol=1e-7)


@pytest.fixture(scope="module")
def skin_points() -> tuple[BodyTrack, np.ndarray, np.ndarray]:
    """A pose, centres of faces of the body (Q, 3) in it and their outward normals."""
    moving = swinging(1, 3)
    body = load_body("female")
    vertices = body.vertices(BETA, moving.poses[0], moving.translations[0])
    corners = vertices[body.faces[::40]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    centres = corners.mean(axis=1)
    # Not where parts of the body touch or fold, nor within it.
    faces = body.faces.astype(np.int64)
    outer, inner = (igl.fast_winding_number(vertices, faces, centres + h * normals) for h in (0.002, -0.002))
    free = (np.abs(outer) < 0.1) & (np.abs(inner - 1.0) < 0.1)
    assert free.mean() > 0.9
    return moving, centres[free], normals[free]


@pytest.mark.parametrize("height", [0.001, -0.001])
def test_gaps_are_along_the_normal_of_the_body_and_outwards_outside(height: float, skin_points) -> None:
    moving, centres, normals = skin_points
    found = gaps(skinned()[2], (centres + height * normals)[None], moving)[0]
    expected = height / NEAR * normals
    apart = np.linalg.norm(found - expected, axis=1)
    # In hollows another face may be nearer.
    assert (apart < 1e-6).mean() > 0.97
    assert np.linalg.norm(found, axis=1).max() < abs(height) / NEAR + 1e-9


def test_gaps_are_cut_where_the_body_is_far(skin_points) -> None:
    moving, centres, _ = skin_points
    aside = np.array([-3.0, 0.5, 2.0])
    far = gaps(skinned()[2], (centres[:50] + aside)[None], moving)[0]
    np.testing.assert_allclose(np.linalg.norm(far, axis=1), 2.0, atol=1e-9)
    assert (far @ aside > 0.0).all()
    body = load_body("female")
    vertices = body.vertices(BETA, moving.poses[0], moving.translations[0])
    # Straight above its head, up to 10 cm, its own length; from there on the same.
    top = vertices[vertices[:, 1].argmax()]
    above = top + np.array([0.0, 1.0, 0.0]) * np.array([0.03, 0.09, 0.11, 0.5])[:, None]
    length = np.linalg.norm(gaps(skinned()[2], above[None], moving)[0], axis=1)
    np.testing.assert_allclose(length, [0.6, 1.8, 2.0, 2.0], atol=1e-6)
