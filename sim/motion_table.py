"""The motion of a scene as its file has it: a clip, or one made of clips, and what is done to it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from muslin.sim.motion.clips import load_motion
from muslin.sim.motion.motion import Motion
from muslin.sim.motion.random_walk import PoseSpace, random_walk
from muslin.sim.motion.splicing import blend
from muslin.sim.motion.time_warp import time_warp
from muslin.sim.tables import Positive, Table

Seed = Annotated[int, Field(ge=0)]


class WarpTable(Table):
    """Playing slower and faster in turns, by up to `strength`; see `muslin.sim.motion.time_warp`."""

    strength: Annotated[float, Field(gt=0.0, le=1.0)]
    seed: Seed = 0
    period: Positive = 1.0


class WalkTable(Table):
    """A random walk of `seconds` among the poses of clips; see `muslin.sim.motion.random_walk`."""

    among: Annotated[list[str], Field(min_length=1)]
    seconds: Annotated[float, Field(gt=0.0, le=600.0)]
    seed: Seed = 0
    stride: Positive = 0.6
    memory: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.5
    spread: Annotated[float, Field(ge=0.0, le=3.0)] = 1.0


class MotionSource(Table):
    """A `clip` by name or AMASS file, or a `random_walk` in its place; on request mirrored, faded over `fade`
    seconds `into` others one after another, warped in time; of that, the part from `start` to `end` seconds,
    stored at `fps` frames a second."""

    clip: str | None = None
    random_walk: WalkTable | None = None
    mirror: bool = False
    into: list[str] = Field(default=[], max_length=20)
    fade: Annotated[float, Field(gt=0.0, le=5.0)] = 0.4
    warp: WarpTable | None = None
    start: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] = 0.0
    end: Positive | None = None
    fps: Annotated[float, Field(gt=0.0, le=240.0)] = 30.0

    @model_validator(mode="after")
    def _possible(self) -> MotionSource:
        if (self.clip is None) == (self.random_walk is None):
            raise ValueError("give exactly one of clip and random_walk")
        if self.end is not None and self.end <= self.start:
            raise ValueError(f"end = {self.end} must be later than start = {self.start}")
        return self

    @property
    def usual_name(self) -> str:
        """What it is called where nothing names it."""
        parts = [Path(self.clip).stem if self.clip is not None else "random_walk", *self.into]
        return "_to_".join(parts) + ("_mirrored" if self.mirror else "") + ("_warped" if self.warp else "")


class MotionTable(MotionSource):
    """How a body moves.

    `spread_arms` turns arms that sink into this body's trunk or thighs outwards, as `muslin.sim.motion.arms`
    tells. `mode`: with inertia, from each step to the next, or every frame at rest on the body as it stands
    then.
    """

    spread_arms: bool = True
    mode: Literal["dynamic", "quasi-static"] = "dynamic"


def read_motion(table: MotionSource) -> Motion:
    """The motion of a table, whole: `start` and `end` are not yet cut. InputError: there is no such clip, or
    two are too short to be faded into each other."""
    if table.random_walk is None:
        assert table.clip is not None
        motion = load_motion(table.clip)
    else:
        motion = _walk(table.random_walk)
    for name in table.into:
        motion = blend(motion, load_motion(name), table.fade)
    if table.mirror:
        motion = motion.mirror()
    if table.warp is not None:
        motion = time_warp(motion, table.warp.strength, table.warp.seed, table.warp.period)
    return motion


def _walk(walk: WalkTable) -> Motion:
    clips = [load_motion(name) for name in walk.among]
    settings = {"stride": walk.stride, "memory": walk.memory, "spread": walk.spread}
    space = PoseSpace.of(clips)
    return random_walk(
        space, walk.seconds, clips[0].fps, walk.seed, translation=clips[0].translations[0], **settings
    )
