"""A small made-up body in SMPL's form, and the default bodies."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from muslin.sim.body import BODY_NAMES, BodyModel, load_body
from muslin.sim.body.joints import PARENTS


@pytest.fixture
def smpl_arrays() -> dict[str, NDArray[Any]]:
    """What an SMPL file holds, with 60 vertices; values mean nothing but are all different."""
    generator = np.random.default_rng(7)
    weights = generator.random((60, 24)) ** 8
    regressor = generator.random((24, 60)) ** 8
    parents = np.array(PARENTS, dtype=np.int64)
    parents[0] = 4294967295
    return {
        "v_template": generator.normal(size=(60, 3)),
        "shapedirs": 0.02 * generator.normal(size=(60, 3, 10)),
        "posedirs": 0.01 * generator.normal(size=(60, 3, 207)),
        "J_regressor": regressor / regressor.sum(axis=1, keepdims=True),
        "weights": weights / weights.sum(axis=1, keepdims=True),
        "kintree_table": np.stack([parents, np.arange(24)]).astype(np.uint32),
        "f": generator.integers(0, 60, size=(100, 3)).astype(np.uint32),
    }


@pytest.fixture(params=BODY_NAMES)
def default_body(request: pytest.FixtureRequest) -> BodyModel:
    return load_body(request.param)


@pytest.fixture
def walking() -> NDArray[np.float64]:
    """One step: a leg forward, a leg back with bent knee, arms hanging."""
    theta = np.zeros((24, 3))
    theta[[1, 2, 4, 5, 8], 0] = np.radians([-30, 20, 15, 45, 15])
    theta[16], theta[17] = np.radians([10, -5, -70]), np.radians([-10, 5, 70])
    theta[[18, 19], 1] = np.radians([-25, 35])
    return theta
