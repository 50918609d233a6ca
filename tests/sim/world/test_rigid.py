"""Rigid motion against its closed form."""

from __future__ import annotations

import numpy as np
import pytest

from muslin.sim.world.rigid import RigidMotion
from muslin.sim.world.tables import MovingTable

POINTS = np.random.default_rng(0).normal(size=(7, 3))
CENTRE = np.array([0.2, -0.1, 0.4])


def motion(**values: object) -> RigidMotion:
    return RigidMotion.of(MovingTable.model_validate(values), CENTRE)


def test_a_quarter_turn_about_the_centre() -> None:
    turned = motion(spin=(0.0, np.pi / 2.0, 0.0)).at(POINTS, 1.0) - CENTRE
    x, y, z = (POINTS - CENTRE).T
    np.testing.assert_allclose(turned, np.stack([z, y, -x], axis=1), atol=1e-12)


def test_the_centre_travels_and_distances_stay() -> None:
    moving = motion(velocity=(0.3, -0.2, 0.1), spin=(1.0, 2.0, -0.5), start=0.5, stop=2.0)
    there = moving.at(np.concatenate([POINTS, CENTRE[None]]), 1.5)
    np.testing.assert_allclose(there[-1], CENTRE + np.array([0.3, -0.2, 0.1]), atol=1e-12)
    np.testing.assert_allclose(
        np.linalg.norm(there[:-1] - there[-1], axis=1), np.linalg.norm(POINTS - CENTRE, axis=1)
    )


@pytest.mark.parametrize(("time", "same_as"), [(0.0, 0.0), (0.5, 0.0), (2.0, 3.0), (3.0, 50.0)])
def test_nothing_moves_before_start_and_after_stop(time: float, same_as: float) -> None:
    moving = motion(velocity=(1.0, 0.0, 0.0), spin=(0.0, 1.0, 0.0), start=0.5, stop=2.0)
    np.testing.assert_array_equal(moving.at(POINTS, time), moving.at(POINTS, same_as))
