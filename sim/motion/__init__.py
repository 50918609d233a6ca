"""Motion clips of AMASS form: load, resample, mirror, splice, and make new ones from seen poses."""

from muslin.sim.motion.amass import read_amass, write_amass
from muslin.sim.motion.arms import spread_arms
from muslin.sim.motion.clips import load_motion, motion_names
from muslin.sim.motion.grounding import fit_to_body
from muslin.sim.motion.lead_in import lead_in
from muslin.sim.motion.motion import Motion
from muslin.sim.motion.random_walk import PoseSpace, random_walk
from muslin.sim.motion.splicing import blend, loop
from muslin.sim.motion.time_warp import time_warp

__all__ = [
    "Motion",
    "PoseSpace",
    "blend",
    "fit_to_body",
    "lead_in",
    "load_motion",
    "loop",
    "motion_names",
    "random_walk",
    "read_amass",
    "spread_arms",
    "time_warp",
    "write_amass",
]
