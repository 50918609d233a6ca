"""Loop, blend, time-warp, lead-in and random walk: continuity, limits, seeds, provenance."""

from __future__ import annotations

import numpy as np
import pytest

from muslin.garments.errors import InputError
from muslin.sim.motion import Motion, PoseSpace, blend, lead_in, load_motion, loop, random_walk, time_warp
from muslin.sim.motion.random_walk import seen_coordinates
from muslin.sim.motion.rotations import (
    about_y,
    angular_speed,
    axis_angle_from_quaternion,
    conjugate,
    heading,
    multiply,
    quaternion_from_axis_angle,
    rotate,
)


def sway(frames: int = 60, fps: float = 30.0, seed: int = 0) -> Motion:
    time = np.arange(frames) / fps
    rng = np.random.default_rng(seed)
    poses = rng.normal(scale=0.4, size=(24, 3)) * np.sin(
        2.0 * time[:, None, None] + rng.uniform(0, 6, (24, 3))
    )
    poses[:, 0] *= [0.2, 1.0, 0.2]
    translations = np.stack([np.sin(time), 0.9 + 0.05 * np.cos(3 * time), 1.2 * time], axis=1)
    return Motion(f"sway{seed}", poses, translations, fps, f"formula {seed}", (0.0, -0.1, 0.02))


def cycle(turn: float, frames: int = 41) -> Motion:
    """An exact cycle that turns and travels: its last frame is its first, moved in the plane."""
    phase = np.linspace(0.0, 1.0, frames)
    poses = np.sin(2 * np.pi * phase)[:, None, None] * np.random.default_rng(3).normal(
        scale=0.3, size=(24, 3)
    )
    poses[:, 0] = turn * phase[:, None] * np.array([0.0, 1.0, 0.0])
    # Travel on the circle that the turn describes, so that the motion is one steady screw per cycle.
    angle = turn * phase
    translations = np.stack(
        [np.cos(angle) - 1.0, 0.9 + 0.03 * np.sin(2 * np.pi * phase), -np.sin(angle)], axis=1
    )
    return Motion("cycle", poses, translations, 30.0, "a cycle")


def steps(motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    return angular_speed(motion.quaternions, motion.fps), np.diff(motion.pelvis, axis=0) * motion.fps


@pytest.mark.parametrize("turn", [0.6, -2.0])
def test_looping_an_exact_cycle_continues_the_screw(turn: float) -> None:
    motion = cycle(turn)
    looped = loop(motion, 3)
    assert looped.num_frames == 3 * 40 + 1
    np.testing.assert_allclose(looped.poses[:41, 1:], motion.poses[:, 1:], atol=1e-12)
    screw = about_y(turn)
    about = looped.pelvis - np.array([-1.0, 0.0, 0.0])
    np.testing.assert_allclose(rotate(screw, about[:-40]), about[40:], atol=1e-12)
    gained = multiply(conjugate(multiply(screw, looped.quaternions[:-40, 0])), looped.quaternions[40:, 0])
    np.testing.assert_allclose(axis_angle_from_quaternion(gained), 0.0, atol=1e-12)


def test_loop_of_an_open_motion_has_no_leap_at_the_seam() -> None:
    motion = sway()
    looped = loop(motion, 3, seam=0.5)
    spin, speed = steps(looped)
    gap = multiply(conjugate(motion.quaternions[-1, 1:]), motion.quaternions[0, 1:])
    largest = np.linalg.norm(axis_angle_from_quaternion(gap), axis=-1)
    # Half the gap is closed over 0.5 s on each side; a smoothstep is at most 1.5 times as fast as a line.
    bound = steps(motion)[0][:, 1:].max(axis=0) + 1.5 * 0.5 * largest / 0.5
    assert np.all(spin[:, 1:] <= 1.05 * bound)
    assert np.abs(speed).max() <= np.abs(steps(motion)[1]).max() * 1.5 + 0.2


def test_loop_of_the_pose_returns_to_the_start_each_turn() -> None:
    looped = loop(sway(), 4)
    np.testing.assert_allclose(looped.poses[59, 1:], looped.poses[0, 1:], atol=1e-12)
    np.testing.assert_allclose(looped.poses[118, 1:], looped.poses[0, 1:], atol=1e-12)
    assert "looped 4 times" in looped.source


def test_loop_once_keeps_length_and_bad_counts_are_refused() -> None:
    assert loop(sway(), 1).num_frames == 60
    with pytest.raises(InputError, match="at least 1"):
        loop(sway(), 0)
    with pytest.raises(InputError, match="too few"):
        loop(sway(frames=2), 2)


def test_blend_starts_as_the_first_ends_as_the_second_and_is_continuous() -> None:
    first, second = sway(seed=1), sway(frames=50, seed=2)
    joined = blend(first, second, 0.5)
    assert joined.num_frames == 60 + 50 - 16
    np.testing.assert_array_equal(joined.poses[:44], first.poses[:44])
    np.testing.assert_allclose(joined.poses[-30:, 1:], second.poses[-30:, 1:], atol=1e-12)
    np.testing.assert_allclose(joined.pelvis[44], first.pelvis[44], atol=1e-12)
    spin, _ = steps(joined)
    apart = multiply(conjugate(first.quaternions[44:, 1:]), second.quaternions[:16, 1:])
    largest = np.linalg.norm(axis_angle_from_quaternion(apart), axis=-1).max(axis=0)
    usual = np.maximum(steps(first)[0].max(axis=0), steps(second)[0].max(axis=0))[1:]
    assert np.all(spin[:, 1:] <= 1.1 * (usual + 1.5 * largest / 0.5))
    assert "formula 1" in joined.source
    assert "formula 2" in joined.source


def test_blending_a_motion_into_its_own_continuation_is_seamless() -> None:
    motion = sway(frames=90)
    joined = blend(motion.clip(0.0, 2.0), motion.clip(1.5, motion.duration), 0.5)
    np.testing.assert_allclose(joined.poses, motion.poses, atol=1e-12)
    np.testing.assert_allclose(joined.translations, motion.translations, atol=1e-12)


def test_blend_longer_than_a_motion_is_refused() -> None:
    with pytest.raises(InputError, match="blend"):
        blend(sway(), sway(frames=10), 1.0)


def test_time_warp_keeps_the_path_and_bounds_the_speed() -> None:
    motion = sway(frames=300)
    warped = time_warp(motion, 0.4, seed=7)
    # Height along the path is a function of place along z: time is stretched, the path is not.
    np.testing.assert_allclose(
        warped.translations[:, 1],
        np.interp(warped.translations[:, 2], motion.translations[:, 2], motion.translations[:, 1]),
        atol=1e-9,
    )
    speed = np.diff(warped.translations[:, 2]) * warped.fps / 1.2
    assert speed.min() >= 1.0 / 1.4 - 1e-9
    assert speed.max() <= 1.4 + 1e-9
    assert speed.std() > 0.05
    np.testing.assert_array_equal(warped.poses, time_warp(motion, 0.4, seed=7).poses)
    assert not np.array_equal(warped.poses[:50], time_warp(motion, 0.4, seed=8).poses[:50])
    assert "seed 7" in warped.source


def test_time_warp_of_no_strength_is_the_identity() -> None:
    motion = sway()
    np.testing.assert_allclose(time_warp(motion, 0.0, seed=1).poses, motion.poses, atol=1e-12)
    with pytest.raises(InputError, match="strength"):
        time_warp(motion, 2.0, seed=1)


def test_lead_in_goes_from_t_pose_to_the_first_frame() -> None:
    motion = sway().moved(0.8, (1.0, 0.0, 2.0))
    lead = lead_in(motion, 1.0, 60.0, standing=0.95)
    assert (lead.num_frames, lead.fps) == (61, 60.0)
    assert not lead.poses[0, 1:].any()
    assert lead.poses[0, 0] == pytest.approx([0.0, float(heading(motion.quaternions[0, 0])), 0.0])
    np.testing.assert_array_equal(lead.poses[-1], motion.poses[0])
    np.testing.assert_array_equal(lead.translations[-1], motion.translations[0])
    np.testing.assert_allclose(
        lead.translations[0], [motion.translations[0, 0], 0.95, motion.translations[0, 2]]
    )
    # Smoothstep: at rest at both ends, half way at half time.
    spin = angular_speed(lead.quaternions, 60.0)
    assert spin[[0, -1]].max() < 0.1 * spin.max()
    half = multiply(conjugate(lead.quaternions[30]), lead.quaternions[60])
    np.testing.assert_allclose(
        half, multiply(conjugate(lead.quaternions[0]), lead.quaternions[30]), atol=1e-12
    )


def test_lead_in_of_no_time_is_refused() -> None:
    with pytest.raises(InputError, match="lead_in"):
        lead_in(sway(), 0.0, 30.0)


@pytest.fixture(scope="module")
def space() -> PoseSpace:
    return PoseSpace.of([load_motion("walk"), load_motion("dance_a")], variance=0.95)


def test_pose_space_explains_the_variance_it_promises(space: PoseSpace) -> None:
    seen = np.concatenate([seen_coordinates(load_motion(name).poses) for name in ("walk", "dance_a")])
    centred = seen - seen.mean(axis=0)
    kept = centred @ space.components.T @ space.components
    assert np.sum((centred - kept) ** 2) <= 0.05 * np.sum(centred**2)
    np.testing.assert_allclose(space.components @ space.components.T, np.eye(len(space.scales)), atol=1e-12)
    np.testing.assert_allclose((centred @ space.components.T).std(axis=0, ddof=1), space.scales, rtol=1e-9)


def test_random_walk_stays_in_the_joint_limits_and_repeats_with_its_seed(space: PoseSpace) -> None:
    walk = random_walk(space, 20.0, 30.0, seed=4, spread=1.5)
    assert walk.num_frames == 601
    coordinates = walk.poses[:, 1:].reshape(-1, 69)
    assert np.all(coordinates >= space.low)
    assert np.all(coordinates <= space.high)
    assert not walk.poses[:, 0].any()
    np.testing.assert_array_equal(walk.poses, random_walk(space, 20.0, 30.0, seed=4, spread=1.5).poses)
    assert not np.array_equal(walk.poses, random_walk(space, 20.0, 30.0, seed=5, spread=1.5).poses)
    assert "random walk" in walk.source
    assert "DeepMimic" in walk.source


def test_random_walk_is_smooth(space: PoseSpace) -> None:
    """Second differences of a C2 curve fall by four when the frame rate doubles."""
    bends = [
        np.abs(np.diff(random_walk(space, 6.0, fps, seed=1).poses, n=2, axis=0)).max() for fps in (30.0, 60.0)
    ]
    assert bends[0] / bends[1] == pytest.approx(4.0, rel=0.1)


def test_random_walk_of_no_spread_stands_at_the_mean(space: PoseSpace) -> None:
    still = random_walk(space, 1.0, 30.0, seed=1, spread=0.0)
    np.testing.assert_allclose(still.poses[:, 1:].reshape(-1, 69), np.tile(space.mean, (31, 1)), atol=1e-12)
    with pytest.raises(InputError, match="memory"):
        random_walk(space, 1.0, 30.0, seed=1, memory=1.0)


def test_provenance_of_a_chain_of_changes_names_every_step() -> None:
    source = loop(time_warp(sway().mirror(), 0.2, seed=3), 2).resample(20.0).clip(0.0, 1.0).source
    for step in ("formula 0", "mirrored", "time-warped", "looped", "resampled", "clipped"):
        assert step in source


def test_quaternion_signs_do_not_matter_to_loop() -> None:
    motion = sway()
    flipped = Motion(
        "f",
        axis_angle_from_quaternion(-quaternion_from_axis_angle(motion.poses)),
        motion.translations,
        30.0,
        "",
    )
    np.testing.assert_allclose(loop(flipped, 2).poses, loop(motion, 2).poses, atol=1e-9)
