from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from muslin.garments.correspondence import correspondence
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template
from muslin.learn.wrinkles.skin import GarmentSkin, garment_skin
from muslin.sim.body.joints import JOINT
from muslin.sim.body.load import load_body
from muslin.sim.body.skinning import SMALLEST_DETERMINANT, bind, pose
from tests.learn.drape.test_smoothing import strip
from tests.learn.wrinkles.worn import BETA, skinned, swinging

LEGS = {
    side: [JOINT[f"{side}_{name}"] for name in ("hip", "knee", "ankle", "foot")] for side in ("left", "right")
}


def bent(joint: str, angle: float, axis: int = 0) -> np.ndarray:
    """(1, 24, 3) T-pose but for one joint."""
    theta = np.zeros((1, 24, 3))
    theta[0, JOINT[joint], axis] = angle
    return theta


@pytest.mark.parametrize(("length", "resolution"), [(0.64, 403), (0.64, 1400), (1.2, 1400)])
def test_weights_are_a_partition_of_unity(length: float, resolution: int) -> None:
    _, _, skin = skinned(length, resolution)
    assert skin.weights.min() >= 0.0
    np.testing.assert_allclose(skin.weights.sum(axis=1), 1.0, atol=1e-12)


def sheared() -> tuple[GarmentMesh, np.ndarray]:
    """A strip of very blunt triangles, one vertex at the body's soles and the others on top of its head."""
    mesh = strip(11, 7)
    flat = 0.2 * mesh.panel_vertices
    flat[:, 0] += 3.0 * flat[:, 1]
    body = load_body("female").v_template
    points = np.tile(body[body[:, 1].argmax()], (mesh.num_vertices, 1))
    points[38] = body[body[:, 1].argmin()]
    return replace(mesh, panel_vertices=flat), points


@pytest.mark.parametrize("of", [sheared, lambda: skinned(1.2, 403)[:2]], ids=["sheared", "dress"])
def test_smooth_skin_data_lies_between_the_extremes_of_the_nearest_points(of) -> None:
    """The maximum principle of an M-matrix; negative cotangents of the blunt triangles would break it."""
    mesh, points = of()
    body = load_body("female")
    skin, near = garment_skin(mesh, points, body), bind(points, body)
    for smooth, values in (
        (skin.weights, near.weights),
        (skin.shape, near.interpolate(body.shapedirs)),
        (skin.pose, near.interpolate(body.posedirs)),
    ):
        assert (smooth >= values.min(axis=0) - 1e-9).all()
        assert (smooth <= values.max(axis=0) + 1e-9).all()


@pytest.mark.parametrize("seed", range(4))
def test_unposing_undoes_posing(seed: int) -> None:
    _, points, skin = skinned()
    moving = swinging(7, seed)
    args = moving.beta, moving.poses, moving.translations
    posed = skin.posed(points, *args)
    assert np.linalg.norm(posed - points, axis=2).max() > 0.1
    np.testing.assert_allclose(skin.unposed(posed, *args), np.broadcast_to(points, posed.shape), atol=1e-12)
    # Points of their own in each frame.
    np.testing.assert_allclose(skin.posed(skin.unposed(posed, *args), *args), posed, atol=1e-12)


def test_nothing_moves_in_the_rest_pose_of_the_mean_body() -> None:
    _, points, skin = skinned()
    rest = skin.posed(points, np.zeros(3), np.zeros((2, 24, 3)), np.zeros((2, 3)))
    np.testing.assert_allclose(rest, np.broadcast_to(points, rest.shape), atol=1e-12)


def test_a_turn_of_the_root_moves_the_garment_as_one_piece() -> None:
    _, points, skin = skinned()
    moving = swinging(1, 1)
    before = skin.posed(points, BETA, moving.poses)[0]
    turn, shift = Rotation.from_rotvec([0.4, 1.9, -0.3]), np.array([0.3, -0.2, 1.5])
    theta = moving.poses.copy()
    theta[0, 0] = (turn * Rotation.from_rotvec(theta[0, 0])).as_rotvec()
    after = skin.posed(points, BETA, theta, shift[None])[0]
    pelvis = skin.model.rest_joints(BETA)[0]
    np.testing.assert_allclose(after, turn.apply(before - pelvis) + pelvis + shift, atol=1e-12)


def test_without_smoothing_it_is_the_skinning_of_the_body() -> None:
    _, points, _ = skinned()
    body = load_body("female")
    near = bind(points, body)
    skin = GarmentSkin(body, near.weights, near.interpolate(body.shapedirs), near.interpolate(body.posedirs))
    moving = swinging(3)
    shaped = points + near.interpolate(body.rest_vertices(BETA) - body.rest_vertices())
    for theta, at, posed in zip(
        moving.poses,
        moving.translations,
        skin.posed(points, BETA, moving.poses, moving.translations),
        strict=True,
    ):
        np.testing.assert_allclose(posed, pose(shaped, near, BETA, theta, at), atol=1e-12)


def test_another_triangulation_follows_the_body_as_the_template_does() -> None:
    mesh, points, skin = skinned(0.64, 1400)
    other = template("tee", mesh.parameters, 403)
    place = correspondence(mesh, other)
    carried = skin.carried(place)
    np.testing.assert_allclose(carried.weights.sum(axis=1), 1.0, atol=1e-12)
    moving = swinging(4)
    args = moving.beta, moving.poses, moving.translations
    posed = carried.posed(place.carry(points), *args)
    of_template = np.stack([place.carry(frame) for frame in skin.posed(points, *args)])
    # Within a triangle of 3 cm the transforms are not constant: that is all by which the two differ.
    assert np.linalg.norm(posed - of_template, axis=2).max() < 0.003
    assert np.linalg.norm(of_template - place.carry(points), axis=2).max() > 0.1
    # At vertices that both have nothing differs at all.
    shared = place.weights.max(axis=1) > 1.0 - 1e-9
    assert shared.sum() >= 4
    np.testing.assert_allclose(posed[:, shared], of_template[:, shared], atol=1e-8)


@pytest.mark.parametrize("joint", ["left_shoulder", "right_elbow", "left_hip"])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_half_a_turn_of_a_joint_cannot_be_taken_back(joint: str, axis: int) -> None:
    _, points, skin = skinned()
    linear, _, _ = skin.motion(BETA, bent(joint, np.pi, axis))
    assert np.linalg.det(linear).min() < SMALLEST_DETERMINANT
    theta = np.concatenate([np.zeros((1, 24, 3)), bent(joint, np.pi, axis)])
    with pytest.raises(InputError, match=r"vertex \d+ of frame 1 cannot be unposed"):
        skin.unposed(points[None].repeat(2, 0), BETA, theta)


@pytest.mark.parametrize("joint", ["left_shoulder", "right_elbow", "left_hip"])
def test_what_a_body_can_bend_can_be_taken_back(joint: str) -> None:
    _, points, skin = skinned()
    theta = bent(joint, np.radians(145.0), 1)
    back = skin.unposed(skin.posed(points, BETA, theta), BETA, theta)[0]
    np.testing.assert_allclose(back, points, atol=1e-10)


def steps(mesh: GarmentMesh, weights: np.ndarray, side: str) -> float:
    """The most by which the share of a leg changes along an edge."""
    share = weights[:, LEGS[side]].sum(axis=1)
    return float(np.abs(np.diff(share[mesh.edges], axis=1)).max())


@pytest.mark.parametrize("side", LEGS)
def test_a_skirt_changes_from_leg_to_leg_smoothly(side: str) -> None:
    coarse, fine = skinned(1.2, 403), skinned(1.2, 1400)
    nearest = bind(fine[1], load_body("female")).weights
    assert steps(fine[0], nearest, side) > 0.99
    assert steps(fine[0], fine[2].weights, side) < 0.15
    # A slope, not a step: half as much along edges half as long.
    ratio = steps(fine[0], fine[2].weights, side) / steps(coarse[0], coarse[2].weights, side)
    assert ratio == pytest.approx(np.sqrt(403 / 1400), rel=0.25)
    # Yet all of it follows one or the other where that is near: the sides of the hem.
    share = fine[2].weights[:, LEGS[side]].sum(axis=1)
    assert share.max() > 0.8


def test_sleeves_follow_their_own_arm() -> None:
    _, points, skin = skinned(0.64, 1400)
    arms = {side: [JOINT[f"{side}_shoulder"], JOINT[f"{side}_elbow"]] for side in LEGS}
    for side, other, sign in (("left", "right", 1.0), ("right", "left", -1.0)):
        cuff = sign * points[:, 0] > (sign * points[:, 0]).max() - 0.02
        # The rest is the torso's: cloth 7 cm off the arm is smoothed over 13 cm, and the sleeve has 11 cm.
        assert skin.weights[cuff][:, arms[side]].sum(axis=1).min() > 0.8
        assert skin.weights[cuff][:, arms[other]].max() < 0.005
