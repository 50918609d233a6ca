from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from muslin.sim.body.rotation import rotation_matrices


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, 0.3, np.pi - 1e-9, np.pi, 5.0, 40.0])
def test_equals_scipys_rotation(angle: float) -> None:
    axes = np.random.default_rng(0).normal(size=(50, 3))
    vectors = angle * axes / np.linalg.norm(axes, axis=1, keepdims=True)
    np.testing.assert_allclose(
        rotation_matrices(vectors), Rotation.from_rotvec(vectors).as_matrix(), atol=1e-13
    )


def test_keeps_leading_dimensions_and_is_orthogonal() -> None:
    matrices = rotation_matrices(np.random.default_rng(1).normal(size=(4, 5, 3)))
    assert matrices.shape == (4, 5, 3, 3)
    np.testing.assert_allclose(
        matrices @ np.swapaxes(matrices, -1, -2), np.tile(np.eye(3), (4, 5, 1, 1)), atol=1e-14
    )
    np.testing.assert_allclose(np.linalg.det(matrices), 1.0)


def test_small_angles_have_the_derivative_of_the_cross_product() -> None:
    step = np.array([1e-9, -2e-9, 3e-9])
    point = np.array([0.3, 0.5, -0.7])
    np.testing.assert_allclose(
        rotation_matrices(step) @ point - point, np.cross(step, point), rtol=1e-6, atol=1e-16
    )
