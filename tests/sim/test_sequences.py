"""Motions at rest in every frame, against the same with inertia."""

from __future__ import annotations

import numpy as np
import pytest

from muslin.sim.dataset.verify import verify_sample
from muslin.sim.run import simulate
from muslin.sim.scene import parse_scene

TOLERANCE = 5e-4


def walk(**motion):
    scene = {
        "name": "walk",
        "garment": {"preset": "top", "edge_length": 0.07},
        "body": {},
        "solver": {"settle_tolerance": TOLERANCE, "settle_steps": 100, "dt": 0.0334},
        "motion": {"clip": "walk", "start": 0.2, "end": 0.3, "fps": 10.0} | motion,
    }
    return simulate(parse_scene(scene))


@pytest.fixture(scope="module")
def at_rest():
    return walk(mode="quasi-static")


def test_every_frame_is_at_rest_and_certified(at_rest):
    assert (at_rest.kind, at_rest.num_frames, at_rest.fps) == ("sequence", 2, 10.0)
    assert verify_sample(at_rest.validate()).reason == ""
    found = at_rest.certificate
    assert (found.extra["at_rest"], found.extra["frames_not_at_rest"]) == (True, 0)
    assert found.extra["last_move_m"] < TOLERANCE
    assert found.force_residual is not None
    assert found.extra["settle_steps"] > 2 * 6, "each frame took steps of its own"


def test_bodies_are_those_of_the_motion_and_cloth_is_not_that_with_inertia(at_rest):
    dynamic = walk()
    assert at_rest.body is not None
    assert dynamic.body is not None
    np.testing.assert_array_equal(at_rest.body.poses, dynamic.body.poses)
    np.testing.assert_array_equal(at_rest.body.translations, dynamic.body.translations)
    assert dynamic.certificate.force_residual is None
    apart = np.linalg.norm(at_rest.positions - dynamic.positions, axis=-1)
    assert apart.max() > 0.01
    assert apart.mean() < 0.1, "the same garment on the same body"
