"""Joining motions: repeat one without a seam, or go from one over into another.

Motions are joined by planar moves only (a turn about the vertical and a horizontal shift), so the floor
and gravity stay where they were.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.sim.motion.motion import Motion
from muslin.sim.motion.rotations import (
    about_y,
    axis_angle_from_quaternion,
    conjugate,
    heading,
    multiply,
    quaternion_from_axis_angle,
    rotate,
    slerp,
    smoothstep,
)

Array = NDArray[np.float64]

STRAIGHT = np.radians(10.0)
"""Radians: a cycle whose heading differs by less from start to end goes straight; the rest is sway."""

_HORIZONTAL = np.array([1.0, 0.0, 1.0])


def loop(motion: Motion, count: int, seam: float = 0.25) -> Motion:
    """`count` turns of a motion whose last frame shows about the pose of its first.

    The gap g = q_end^-1 q_start of every joint (for the root after the planar move that carries start to
    end) is closed half from each side: q <- q exp(+ s(t) log(g)/2) towards the end and
    q <- q exp(- s(t) log(g)/2) from the start, s a smoothstep over `seam` seconds. The closed cycle is
    then repeated, each turn carried to the end of the one before; poses are continuous to rounding.
    """
    if count < 1:
        raise InputError(f"motion {motion.name!r}: loop count is {count}; it must be at least 1")
    if motion.num_frames < 3:
        raise InputError(
            f"motion {motion.name!r}: {motion.num_frames} frames are too few to loop; at least 3"
        )
    frames = motion.num_frames - 1
    reach = min(max(seam * motion.fps, 1.0), frames / 2)
    time = np.arange(frames + 1)
    weight = 0.5 * (smoothstep(1.0 - (frames - time) / reach) - smoothstep(1.0 - time / reach))

    q, pelvis = motion.quaternions, motion.pelvis
    turn = float(heading(multiply(q[-1, 0], conjugate(q[0, 0]))))
    turn = 0.0 if abs(turn) < STRAIGHT else turn
    start = q[0].copy()
    start[0] = multiply(about_y(turn), start[0])
    gap = axis_angle_from_quaternion(multiply(conjugate(q[-1]), start))
    closed = multiply(q, quaternion_from_axis_angle(weight[:, None, None] * gap))
    height_gap = pelvis[0, 1] - pelvis[-1, 1]
    pelvis = pelvis + weight[:, None] * np.array([0.0, height_gap, 0.0])

    poses, places = [], []
    turned, shift = 0.0, np.zeros(3)
    for turn_number in range(count):
        last = turn_number == count - 1
        keep = slice(0, frames + 1 if last else frames)
        root = multiply(about_y(turned), closed[keep, 0])
        poses.append(np.concatenate([root[:, None], closed[keep, 1:]], axis=1))
        places.append(rotate(about_y(turned), pelvis[keep]) + shift)
        end = rotate(about_y(turned), pelvis[-1]) + shift
        turned += turn
        shift = (end - rotate(about_y(turned), pelvis[0])) * _HORIZONTAL
    return motion.with_frames(
        axis_angle_from_quaternion(np.concatenate(poses)),
        np.concatenate(places) - motion.rest_pelvis,
        did=f"looped {count} times",
    )


def blend(first: Motion, second: Motion, seconds: float) -> Motion:
    """`first`, then `second`, faded into each other over `seconds`.

    `second` is resampled to the rate of `first` and moved so that it starts where, and heading as, the fade
    starts; in the fade rotations go by slerp and places linearly, with a smoothstep weight.
    """
    fade = round(seconds * first.fps) + 1
    if not (seconds > 0.0 and fade <= min(first.num_frames, second.resample(first.fps).num_frames)):
        raise InputError(
            f"cannot blend {first.name!r} into {second.name!r} over {seconds} s; allowed is above 0 "
            f"and at most the shorter motion, {min(first.duration, second.duration):.3f} s"
        )
    start = first.num_frames - fade
    other = placed(second.resample(first.fps), first, start)
    weight = smoothstep(np.arange(fade) / (fade - 1))
    q = slerp(first.quaternions[start:], other.quaternions[:fade], weight[:, None])
    middle = axis_angle_from_quaternion(q)
    weight = weight[:, None]
    pelvis = (1.0 - weight) * first.pelvis[start:] + weight * other.pelvis[:fade]
    return Motion(
        f"{first.name}_to_{second.name}",
        np.concatenate([first.poses[:start], middle, other.poses[fade:]]),
        np.concatenate([first.pelvis[:start], pelvis, other.pelvis[fade:]]) - first.rest_pelvis,
        first.fps,
        f"blend over {seconds:g} s of [{first.source}] into [{second.source}]",
        first.rest_pelvis,
    )


def placed(motion: Motion, target: Motion, frame: int) -> Motion:
    """`motion` moved in the plane so that its first frame lies and heads as `target` does at `frame`."""
    turn = float(heading(target.quaternions[frame, 0]) - heading(motion.quaternions[0, 0]))
    shift = target.pelvis[frame] - rotate(about_y(turn), motion.pelvis[0])
    return motion.moved(turn, shift * _HORIZONTAL)
