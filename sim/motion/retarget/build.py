"""Make the committed clips: `python -m muslin.sim.motion.retarget.build --bvh DIR --deepmimic DIR [NAME...]`.

--bvh        folder of 01_01.bvh and 01_03.bvh, from the Debian package assimp-testmodels
--deepmimic  folder of humanoid3d_*.txt and walker/, pybullet_data/data/motions of the PyPI wheel pybullet

For each clip: retarget onto the neutral body, low-pass, resample, loop if asked, spread the arms, clean the
feet, start at the origin facing +z, write. Prints one row of figures a clip.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import binary_dilation, median_filter

from muslin.sim.body.load import load_body
from muslin.sim.body.model import BodyModel
from muslin.sim.motion.amass import write_amass
from muslin.sim.motion.arms import spread_arms
from muslin.sim.motion.clips import ASSETS
from muslin.sim.motion.motion import Motion
from muslin.sim.motion.retarget.bvh import read_bvh
from muslin.sim.motion.retarget.deepmimic import read_deepmimic
from muslin.sim.motion.retarget.feet import clean_feet
from muslin.sim.motion.retarget.onto_smpl import CMU, DEEPMIMIC, retarget
from muslin.sim.motion.rotations import angular_speed, axis_angle_from_quaternion, heading, slerp, smooth
from muslin.sim.motion.skeleton import JOINT
from muslin.sim.motion.splicing import loop

CMU_SOURCE = "CMU Graphics Lab Motion Capture Database, subject 1, trial {trial} (mocap.cs.cmu.edu)"
DEEPMIMIC_SOURCE = "DeepMimic motion clip {file} of pybullet 3.2.7"

LOW_PASS = 0.02
"""Seconds, standard deviation: keeps what moves a garment, drops marker noise (above 8 Hz)."""
TOE_LOW_PASS = 0.06
"""Seconds: toe markers are the noisiest, and no garment feels toes."""
LEAP = 5.0
"""Radians per second."""
HEAL = 0.08
"""Seconds."""


@dataclass(frozen=True)
class Recipe:
    """file: source below --bvh or --deepmimic; fps: of the clip; loops: turns of a cycle."""

    file: str
    fps: float
    loops: int = 1


RECIPES: dict[str, Recipe] = {
    "cmu_01_01": Recipe("01_01.bvh", 60.0),
    "cmu_01_03": Recipe("01_03.bvh", 60.0),
    "backflip": Recipe("humanoid3d_backflip.txt", 30.0),
    "cartwheel": Recipe("humanoid3d_cartwheel.txt", 60.0),
    "crawl": Recipe("humanoid3d_crawl.txt", 60.0),
    "dance_a": Recipe("humanoid3d_dance_a.txt", 60.0, loops=4),
    "dance_b": Recipe("humanoid3d_dance_b.txt", 60.0, loops=2),
    "getup_facedown": Recipe("humanoid3d_getup_facedown.txt", 60.0),
    "getup_faceup": Recipe("humanoid3d_getup_faceup.txt", 60.0),
    "jump": Recipe("humanoid3d_jump.txt", 60.0),
    "kick": Recipe("humanoid3d_kick.txt", 30.0),
    "punch": Recipe("humanoid3d_punch.txt", 30.0),
    "roll": Recipe("humanoid3d_roll.txt", 60.0),
    "run": Recipe("humanoid3d_run.txt", 30.0, loops=5),
    "spin": Recipe("humanoid3d_spin.txt", 30.0),
    "spinkick": Recipe("humanoid3d_spinkick.txt", 60.0),
    "walk": Recipe("humanoid3d_walk.txt", 30.0, loops=5),
    "walk_forward": Recipe("walker/0walk_forward.txt", 30.0, loops=5),
    "walk_left": Recipe("walker/turn_left0.txt", 30.0, loops=4),
    "walk_left_sharp": Recipe("walker/turn_left1.txt", 30.0, loops=4),
    "walk_right": Recipe("walker/turn_right1.txt", 30.0, loops=4),
    "walk_right_sharp": Recipe("walker/turn_right0.txt", 30.0, loops=4),
}


def make(name: str, bvh: Path, deepmimic: Path, body: BodyModel) -> tuple[Motion, dict[str, float]]:
    """The clip `name` on `body`, and the figures of its arm correction."""
    recipe = RECIPES[name]
    if recipe.file.endswith(".bvh"):
        path = bvh / recipe.file
        source = read_bvh(path, CMU_SOURCE.format(trial=int(path.stem[-2:])))
        motion = retarget(source, CMU, body.joint_template)
        motion = motion.clip(1.0 / motion.fps, motion.duration)  # the first frame is the skeleton's T-pose
    else:
        path = deepmimic / recipe.file
        motion = retarget(
            read_deepmimic(path, DEEPMIMIC_SOURCE.format(file=path.name)), DEEPMIMIC, body.joint_template
        )
    motion = low_pass(heal(motion)).resample(recipe.fps)
    if recipe.loops > 1:
        motion = loop(motion, recipe.loops)
    motion, figures = spread_arms(motion, body)
    motion = clean_feet(motion, body)
    motion = motion.moved(-float(heading(motion.quaternions[0, 0])))
    motion = motion.moved(0.0, -motion.pelvis[0] * np.array([1.0, 0.0, 1.0]))
    spread = np.degrees(max(figures["arm_spread_left"], figures["arm_spread_right"]))
    did = (
        f"retargeted onto body {body.name}, smoothed, feet cleaned, arms spread by up to {spread:.0f} degrees"
    )
    return motion.with_frames(motion.poses, motion.translations, name=name, did=did), figures


def heal(motion: Motion) -> Motion:
    """Bridge leaps of single joints: steps much faster than what is around them, which no joint makes.

    A step of a joint is a leap if it is above LEAP and four times the median speed within a quarter second.
    The frames within HEAL seconds of it are replaced by the slerp across.
    """
    q = motion.quaternions.copy()
    speed = angular_speed(q, motion.fps)
    usual = median_filter(speed, size=(2 * round(0.25 * motion.fps) + 1, 1), mode="nearest")
    reach = max(round(HEAL * motion.fps), 1)
    leaps = np.pad((speed > LEAP) & (speed > 4.0 * usual), ((0, 1), (0, 0)))
    for joint in range(24):
        bad = binary_dilation(leaps[:, joint], iterations=reach)
        good = np.flatnonzero(~bad)
        if bad.any() and len(good) > 1:
            frames = np.flatnonzero(bad)
            after = np.clip(np.searchsorted(good, frames), 1, len(good) - 1)
            start, end = good[after - 1], good[after]
            weight = np.clip((frames - start) / (end - start), 0.0, 1.0)
            q[frames, joint] = slerp(q[start, joint], q[end, joint], weight)
    return motion.with_frames(axis_angle_from_quaternion(q), motion.translations)


def low_pass(motion: Motion) -> Motion:
    """Gaussian low-pass of every joint's rotation, stronger for the toes."""
    q = smooth(motion.quaternions, LOW_PASS * motion.fps)
    toes = [JOINT["left_foot"], JOINT["right_foot"]]
    q[:, toes] = smooth(q[:, toes], TOE_LOW_PASS * motion.fps)
    return motion.with_frames(axis_angle_from_quaternion(q), motion.translations)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--bvh", type=Path, required=True)
    parser.add_argument("--deepmimic", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=ASSETS)
    parser.add_argument("names", nargs="*", help="clips to make; all of them by default")
    arguments = parser.parse_args()
    body = load_body("neutral")
    for name in arguments.names or RECIPES:
        motion, figures = make(name, arguments.bvh, arguments.deepmimic, body)
        write_amass(arguments.out / f"{name}.npz", motion)
        print(
            f"{name}: {motion.num_frames} frames at {motion.fps:g} fps, "
            f"joint speed {motion.max_joint_speed():.1f} rad/s, "
            + ", ".join(f"{key} {value:.3f}" for key, value in figures.items()),
            flush=True,
        )


if __name__ == "__main__":
    main()
