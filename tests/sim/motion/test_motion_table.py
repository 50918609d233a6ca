"""The motion that the keys of `[motion]` ask for."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from muslin.garments.errors import InputError
from muslin.sim.motion.clips import load_motion
from muslin.sim.motion.splicing import blend
from muslin.sim.motion.time_warp import time_warp
from muslin.sim.motion_table import MotionSource, read_motion

WALK = {"among": ["walk", "punch"], "seconds": 2.0, "seed": 4}


def made(**values):
    return read_motion(MotionSource(**values))


def test_a_clip_alone_is_the_clip() -> None:
    motion, clip = made(clip="punch"), load_motion("punch")
    assert np.array_equal(motion.poses, clip.poses)
    assert motion.source == clip.source


def test_clips_are_faded_mirrored_and_warped_in_this_order() -> None:
    motion = made(clip="walk", into=["punch"], fade=0.5, mirror=True, warp={"strength": 0.3, "seed": 2})
    by_hand = time_warp(blend(load_motion("walk"), load_motion("punch"), 0.5).mirror(), 0.3, 2)
    assert np.array_equal(motion.poses, by_hand.poses)
    assert np.array_equal(motion.translations, by_hand.translations)
    assert motion.source == by_hand.source


def test_random_walks_are_drawn_by_their_seed() -> None:
    motion = made(random_walk=WALK)
    assert motion.duration == pytest.approx(2.0, abs=0.05)
    assert np.array_equal(motion.poses, made(random_walk=WALK).poses)
    assert not np.array_equal(motion.poses, made(random_walk=WALK | {"seed": 5}).poses)
    assert abs(motion.pelvis[:, 1] - load_motion("walk").pelvis[0, 1]).max() < 1e-9, "on the spot"


def test_names_where_none_is_given() -> None:
    assert MotionSource(clip="data/walk.npz").usual_name == "walk"
    assert MotionSource(clip="walk", into=["run"], mirror=True).usual_name == "walk_to_run_mirrored"
    assert MotionSource(random_walk=WALK, warp={"strength": 0.1}).usual_name == "random_walk_warped"


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({}, "exactly one of clip and random_walk"),
        ({"clip": "walk", "random_walk": WALK}, "exactly one of clip and random_walk"),
        ({"clip": "walk", "start": 2.0, "end": 1.0}, "must be later than start"),
        ({"random_walk": WALK | {"among": []}}, "at least 1 item"),
    ],
)
def test_tables_that_cannot_be(values: dict, says: str) -> None:
    with pytest.raises(ValidationError, match=says):
        MotionSource(**values)


def test_clips_that_are_not_there_or_too_short() -> None:
    with pytest.raises(InputError, match="moonwalk"):
        made(clip="walk", into=["moonwalk"])
    with pytest.raises(InputError, match="cannot blend"):
        made(clip="walk", into=["kick"], fade=3.0)
