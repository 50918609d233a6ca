"""The committed clips: on the floor, without leaps, arms clear, small, with their source."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from muslin.sim.body import load_body
from muslin.sim.motion import Motion, fit_to_body, load_motion, motion_names
from muslin.sim.motion.clips import ASSETS
from muslin.sim.motion.grounding import lift_above_floor, lowest_heights
from muslin.sim.motion.rotations import heading

BODY = load_body("neutral")
FASTEST = 35.0  # rad/s; the hips of a backflip captured at 16 fps reach 30, a spinning kick 22


@cache
def sparse(name: str) -> Motion:
    """Some frames of a clip, spread evenly: skinning all of them would take minutes."""
    motion = load_motion(name)
    return motion.resample((24 - 1) / motion.duration) if motion.num_frames > 24 else motion


@pytest.mark.parametrize("name", motion_names())
def test_clip_starts_at_the_origin_without_leaps_and_names_its_source(name: str) -> None:
    motion = load_motion(name)
    assert motion.fps in (30.0, 60.0)
    assert motion.max_joint_speed() < FASTEST
    np.testing.assert_allclose(motion.pelvis[0, [0, 2]], 0.0, atol=1e-3)
    assert abs(float(heading(motion.quaternions[0, 0]))) < 2e-3
    assert "CMU" in motion.source or "DeepMimic" in motion.source


@pytest.mark.parametrize("name", motion_names())
def test_clip_does_not_sink_into_the_floor(name: str) -> None:
    motion = load_motion(name)
    frames = np.linspace(0, motion.num_frames - 1, 12).astype(int)
    chosen = Motion(name, motion.poses[frames], motion.translations[frames], motion.fps, "")
    # The quantum of stored angles moves a toe by a tenth of a millimetre.
    assert lowest_heights(chosen, BODY).min() > -2e-4


@pytest.mark.parametrize("name", ["walk", "dance_a", "run"])
def test_dancers_and_walkers_touch_the_floor(name: str) -> None:
    assert np.median(lowest_heights(sparse(name), BODY)) < 0.02


def test_sequences_for_the_scenes_are_long_enough() -> None:
    assert load_motion("walk").resample(30.0).num_frames >= 120
    assert load_motion("dance_a").resample(30.0).num_frames >= 120
    assert load_motion("cmu_01_03").duration > 2.0


def test_clips_are_small() -> None:
    assert sum(path.stat().st_size for path in ASSETS.glob("*.npz")) < 3_000_000


@pytest.mark.parametrize("body_name", ["female", "male"])
def test_fitting_puts_another_body_on_the_floor(body_name: str) -> None:
    body, motion = load_body(body_name), sparse("walk")
    fitted = fit_to_body(motion, body, [1.5])
    lows = lowest_heights(fitted, body, [1.5])
    assert lows.min() > -1e-9
    assert np.median(lows) < 0.03
    np.testing.assert_array_equal(fitted.poses, motion.poses)
    np.testing.assert_allclose(fitted.pelvis[:, [0, 2]], motion.pelvis[:, [0, 2]], atol=1e-12)
    assert body_name in fitted.source


def test_lift_covers_the_need_and_is_soft() -> None:
    rng = np.random.default_rng(1)
    lows = rng.normal(scale=0.02, size=400) + 0.02
    lows[200] = -0.1
    lift = lift_above_floor(lows, 60.0)
    assert np.all(lift + lows >= -1e-12)
    assert np.abs(np.diff(lift)).max() < 0.1 / 5
    assert not lift_above_floor(np.full(50, 0.1), 60.0).any()
