"""The committed bodies: closed, plausible, and true to what they were baked from."""

from __future__ import annotations

import igl
import numpy as np
import pytest
from numpy.typing import NDArray

from muslin.sim.body import BODY_NAMES, BodyModel
from muslin.sim.body.joints import JOINT
from muslin.sim.body.load import ASSETS


def volume(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> float:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6.0)


def test_files_stay_small() -> None:
    assert all((ASSETS / f"{name}.npz").stat().st_size < 2.5e6 for name in BODY_NAMES)


def test_surface_is_closed_manifold_in_one_piece_and_faces_outward(default_body: BodyModel) -> None:
    faces = default_body.faces
    assert (default_body.num_vertices, len(faces)) == (12272, 24540)
    directed = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    assert len(np.unique(directed, axis=0)) == len(directed)
    opposite = {tuple(edge) for edge in directed.tolist()}
    assert all((b, a) in opposite for a, b in opposite)
    assert igl.euler_characteristic(faces) == 2
    assert volume(default_body.v_template, faces) > 0.05


def test_stands_in_t_pose(default_body: BodyModel) -> None:
    joints = default_body.joint_template
    np.testing.assert_allclose(joints[JOINT["pelvis"]], 0.0, atol=1e-6)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        arm = joints[[JOINT[f"{side}_{part}"] for part in ("shoulder", "elbow", "wrist", "hand")]]
        # arms straight along +-x
        np.testing.assert_allclose(np.ptp(arm[:, 1:], axis=0), 0.0, atol=1e-4)
        assert (np.diff(sign * arm[:, 0]) > 0.08).all()
    # the head is up, the toes point to +z
    assert joints[JOINT["head"], 1] > 0.5
    assert joints[JOINT["left_foot"], 2] > joints[JOINT["left_ankle"], 2] + 0.08
    np.testing.assert_allclose(joints[JOINT["left_hip"]] * [-1, 1, 1], joints[JOINT["right_hip"]], atol=1e-4)


def test_weights_are_an_exact_sparse_partition_of_unity(default_body: BodyModel) -> None:
    weights = default_body.weights
    assert (weights >= 0.0).all()
    assert ((weights > 0.0).sum(axis=1) <= 6).all()
    np.testing.assert_array_equal(weights.sum(axis=1), 1.0)


def test_joints_lie_inside_the_body(default_body: BodyModel) -> None:
    inside = igl.winding_number(
        default_body.v_template, default_body.faces.astype(np.int64), default_body.joint_template
    )
    assert (inside > 0.5).all()


def test_volume_and_stature_grow_with_the_first_beta(default_body: BodyModel) -> None:
    steps = np.linspace(-3.0, 3.0, 7)
    bodies = default_body.vertices(steps[:, None], None)
    assert (np.diff([volume(body, default_body.faces) for body in bodies]) > 0.0).all()
    assert (np.diff(np.ptp(bodies[..., 1], axis=1)) > 0.02).all()


@pytest.mark.parametrize("component", range(4))
def test_components_are_signed_by_volume(default_body: BodyModel, component: int) -> None:
    beta = np.zeros((2, 10))
    beta[:, component] = [-1.0, 1.0]
    low, high = default_body.vertices(beta)
    assert volume(high, default_body.faces) > volume(low, default_body.faces)


def test_statures_spread_like_adults(default_body: BodyModel) -> None:
    betas = np.random.default_rng(0).normal(size=(200, 10))
    heights = np.ptp(default_body.rest_vertices(betas)[..., 1], axis=1)
    mean, spread = {"female": (1.60, 0.08), "male": (1.785, 0.086), "neutral": (1.69, 0.12)}[
        default_body.name
    ]
    assert heights.mean() == pytest.approx(mean, abs=0.02)
    assert heights.std() == pytest.approx(spread, rel=0.15)


@pytest.mark.parametrize(
    ("joint", "degrees", "lost"),
    [("left_hip", (-90, 0, 0), 0.015), ("left_knee", (120, 0, 0), 0.005), ("left_elbow", (0, -120, 0), 0.005),
     ("left_shoulder", (0, 0, -75), 0.008), ("left_elbow", (80, 0, 0), 0.002)],
)  # fmt: skip
def test_bending_keeps_volume(
    default_body: BodyModel, joint: str, degrees: tuple[float, ...], lost: float
) -> None:
    theta = np.zeros((24, 3))
    theta[JOINT[joint]] = np.radians(degrees)
    rest = volume(default_body.v_template, default_body.faces)
    assert abs(volume(default_body.vertices(None, theta), default_body.faces) / rest - 1.0) < lost


def test_regressor_in_the_file_gives_the_joints_of_the_mean_body(default_body: BodyModel) -> None:
    with np.load(ASSETS / f"{default_body.name}.npz", allow_pickle=False) as arrays:
        regressor = arrays["J_regressor"].astype(np.float64)
    assert (regressor >= 0.0).all()
    np.testing.assert_allclose(regressor.sum(axis=1), 1.0, atol=1e-6)
    error = np.linalg.norm(regressor @ default_body.v_template - default_body.joint_template, axis=1)
    assert error.max() < 0.003
