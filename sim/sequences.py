"""Garments on a moving body: with inertia, or at rest in every frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from muslin.garments.mesh import GarmentMesh
from muslin.sim.body_motion import clip_times
from muslin.sim.budget import with_budget
from muslin.sim.dataset.sample import Sample
from muslin.sim.failure import stopped
from muslin.sim.motion.lead_in import lead_in
from muslin.sim.motion.motion import Motion
from muslin.sim.recording import Recording
from muslin.sim.relax import RestReport, settle
from muslin.sim.scene import Scene
from muslin.sim.solve.errors import SimulationError
from muslin.sim.wear import WornGarment

LEAD_IN_SECONDS = 1.0

_Place = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Pose (24, 3) and translation (3,) of a body."""


def sequence(
    scene: Scene, mesh: GarmentMesh, worn: WornGarment, clip: Motion, tick: Callable[[], None], started: float
) -> Sample:
    """The sample of a scene with a motion: `clip`, on the body of `worn`, which stands in the rest pose.

    `tick` is called after every frame. SimulationError names scene and frame.
    """
    assert scene.motion is not None
    run = _at_rest if scene.motion.mode == "quasi-static" else _dynamic
    return run(scene, Recording(worn, mesh), worn, clip, tick, started)


def _dynamic(
    scene: Scene,
    recording: Recording,
    worn: WornGarment,
    clip: Motion,
    tick: Callable[[], None],
    started: float,
) -> Sample:
    assert scene.motion is not None
    s, fps = scene.solver, scene.motion.fps
    substeps = s.substeps(fps)
    dt = 1.0 / (fps * substeps)
    next_step = with_budget(worn.sim, s.max_work, tick)
    for passed, (theta, translation) in _path(clip, worn, fps, substeps):
        if (passed - 1) % substeps == 0:
            worn.sim.work_left = s.max_work
        try:
            worn.follow(theta, translation, dt)
            worn.remesh()
            if passed == 0:
                settle(worn.sim, s.settle_tolerance, s.settle_steps // 3, next_step, worn.remesh)
            if passed >= 0 and passed % substeps == 0:
                recording.take()
                tick()
        except SimulationError as error:
            raise stopped(_where(scene, passed, substeps), error, worn.sim) from error
    return recording.sample(scene, None, started, clip)


def _at_rest(
    scene: Scene,
    recording: Recording,
    worn: WornGarment,
    clip: Motion,
    tick: Callable[[], None],
    started: float,
) -> Sample:
    """Every frame an equilibrium, found from that of the frame before, as drapes are along beta.

    Of the reports, the sample's certificate has the steps of all frames and the largest move and residual.
    """
    assert scene.motion is not None
    s = scene.solver
    reports: list[RestReport] = []
    next_step = with_budget(worn.sim, s.max_work, lambda: None)
    for passed, (theta, translation) in _path(clip, worn, scene.motion.fps, 1):
        try:
            worn.move(theta, translation, next_step)
            if passed >= 0:
                reports.append(settle(worn.sim, s.settle_tolerance, s.settle_steps, next_step, worn.remesh))
                recording.take()
                tick()
        except SimulationError as error:
            raise stopped(_where(scene, passed, 1), error, worn.sim) from error
    rest = RestReport(
        steps=sum(report.steps for report in reports),
        moved=max(report.moved for report in reports),
        residual=max(report.residual for report in reports),
        at_rest=all(report.at_rest for report in reports),
    )
    sample = recording.sample(scene, rest, started, clip)
    moving = sum(not report.at_rest for report in reports)
    certificate = sample.certificate
    extra = certificate.extra | {"frames_not_at_rest": moving}
    return replace(sample, certificate=replace(certificate, extra=extra))


def _path(clip: Motion, worn: WornGarment, fps: float, substeps: int) -> Iterator[tuple[int, _Place]]:
    """Where the body goes step by step, counted from the motion's first frame; before 0 is the way into it.

    At its beginning body and garments are carried to where that way starts.
    """
    rate = fps * substeps
    way_in = lead_in(clip, LEAD_IN_SECONDS, rate)
    worn.carry(way_in.poses[0], way_in.translations[0])
    before = len(way_in.poses) - 1
    for k in range(1, before + 1):
        yield k - before, (way_in.poses[k], way_in.translations[k])
    poses, translations = clip.at(clip_times(clip, fps, substeps))
    for k in range(1, len(poses)):
        yield k, (poses[k], translations[k])


def _where(scene: Scene, passed: int, substeps: int) -> str:
    return f"scene {scene.name}, {'lead-in' if passed <= 0 else f'frame {passed // substeps}'}"
