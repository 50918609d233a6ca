"""From the T-pose into a motion: where a garment is dressed, to where the motion starts."""

from __future__ import annotations

import numpy as np

from muslin.garments.errors import InputError
from muslin.sim.motion.motion import Motion
from muslin.sim.motion.rotations import about_y, axis_angle_from_quaternion, heading, slerp, smoothstep


def lead_in(motion: Motion, seconds: float, fps: float, standing: float | None = None) -> Motion:
    """T-pose to the first frame of `motion`, over `seconds`.

    The T-pose stands at the pelvis' first horizontal place and heads as the first frame does; every joint
    goes by slerp with a smoothstep weight, so it starts and ends at rest: the clip's own velocity is not met.

    standing    translation along y of the T-pose, metres (`BodyModel.ground_offset` puts it on the floor);
                None keeps the first frame's.

    Returns round(seconds fps) + 1 frames; the last is the motion's first frame exactly.
    """
    if not (seconds > 0.0 and fps > 0.0 and round(seconds * fps) >= 1):
        raise InputError(f"lead_in: {seconds} s at {fps} fps; at least one frame's time is needed")
    steps = round(seconds * fps)
    weight = smoothstep(np.arange(steps + 1) / steps)
    last = motion.quaternions[0]
    first = np.tile([1.0, 0.0, 0.0, 0.0], (24, 1))
    first[0] = about_y(heading(last[0]))
    poses = axis_angle_from_quaternion(slerp(first, last, weight[:, None]))
    poses[-1] = motion.poses[0]
    end = motion.translations[0]
    start = end if standing is None else np.array([end[0], standing, end[2]])
    translations = (1.0 - weight[:, None]) * start + weight[:, None] * end
    translations[-1] = end
    source = f"T-pose to the first frame of [{motion.source}] in {seconds:g} s"
    return Motion(f"{motion.name}_lead_in", poses, translations, fps, source, motion.rest_pelvis)
