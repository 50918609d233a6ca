"""From a scene to a verified sample."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import warp as wp

from muslin.garments.errors import InputError
from muslin.garments.merge import merge_meshes
from muslin.garments.mesh import GarmentMesh
from muslin.sim.body.load import load_body
from muslin.sim.body_motion import scene_beta, scene_motion
from muslin.sim.budget import with_budget
from muslin.sim.dataset.sample import Sample
from muslin.sim.device import open_device
from muslin.sim.failure import stopped
from muslin.sim.recording import Recording
from muslin.sim.relax import settle
from muslin.sim.remesh.in_loop import Remesher
from muslin.sim.scene import Scene
from muslin.sim.sequences import sequence
from muslin.sim.setting import cut_garment, garments_of, settings_of
from muslin.sim.solve.errors import SimulationError
from muslin.sim.topologies import Topologies, same_simulation, simulated
from muslin.sim.wear import WornGarment, a_pose
from muslin.sim.world.play import play

__all__ = ["SimulationError", "compile_kernels", "cut_garment", "simulate", "simulate_chain"]

Progress = Callable[[int, int], None]

DRESS_WORK, MORPH_WORK = 30, 20


def simulate(scene: Scene, device: str = "cpu", progress: Progress | None = None) -> Sample:
    """Simulate one scene. InputError: the scene cannot be; SimulationError: the solver gave up."""
    return next(simulate_chain([scene], device, progress))


def simulate_chain(
    scenes: Sequence[Scene], device: str = "cpu", progress: Progress | None = None
) -> Iterator[Sample]:
    """Samples of scenes that share garment, fabric and body model, each draped from where the last one ended.

    The garment is put on once; between drapes the body changes shape inside it. Scenes that follow one
    another and differ in nothing but the topology fitted to them come from one simulation.
    """
    together: list[list[Scene]] = []
    for scene in scenes:
        fitted = simulated(scene) is not scene
        if fitted and together and same_simulation(together[-1][0], scene):
            together[-1].append(scene)
        else:
            together.append([scene])
    topologies = Topologies()
    sources = _simulated_chain([simulated(group[0]) for group in together], device, progress)
    for group, source in zip(together, sources, strict=True):
        for scene in group:
            yield source if simulated(scene) is scene else topologies.fitted(scene, source)


def _simulated_chain(scenes: Sequence[Scene], device: str, progress: Progress | None) -> Iterator[Sample]:
    """Samples of scenes without topologies that are fitted."""
    if not scenes:
        return
    open_device(device)
    first = scenes[0]
    for scene in scenes[1:]:
        different = [key for key, value in _shared(scene).items() if value != _shared(first)[key]]
        if different:
            raise InputError(
                f"scene {scene.name}: {', '.join(different)} differ from scene {first.name}'s; "
                "scenes of a chain share them: start another chain"
            )
        if scene.motion is not None or first.motion is not None:
            raise InputError(f"scene {scene.name}: a sequence starts from its own dressing; give it alone")
    work = _Work(scenes, progress)
    if first.body is None:
        for scene in scenes:
            yield play(scene, device, work.tick)
            work.finish(_steps_guess(scene))
        return
    garments = garments_of(first)
    mesh = merge_meshes([g.name for g in garments], [g.mesh for g in garments])
    model = load_body(first.body.model)
    started = time.perf_counter()
    clip = None if first.motion is None else scene_motion(first, model)
    contact, solver = settings_of(first)
    meshes, cloths = [g.mesh for g in garments], [g.cloth for g in garments]
    beta = scene_beta(first, model)
    try:
        worn = WornGarment(meshes, cloths, model, beta, contact, solver, device, work.tick)
    except SimulationError as error:
        raise SimulationError(f"scene {first.name}, {error}", error.state) from error
    work.finish(DRESS_WORK * len(garments))
    if first.remesh is not None:
        worn.remesher = Remesher(first.remesh.settings, mesh, [g.fabric for g in garments])
    for scene in scenes:
        if clip is None:
            yield _drape(scene, mesh, worn, work, started)
        else:
            work.finish(MORPH_WORK)
            yield sequence(scene, mesh, worn, clip, work.tick, started)
        started = time.perf_counter()


def compile_kernels(device: str = "cpu") -> None:
    """Compile every kernel of the simulator for `device`, or load it from Warp's cache."""
    open_device(device)
    wp.force_load(device)


class _Work:
    """Progress of a chain in steps of about the same cost."""

    def __init__(self, scenes: Sequence[Scene], progress: Progress | None) -> None:
        first = scenes[0]
        self.total = 0 if first.body is None else DRESS_WORK * (1 + len(first.layers))
        for scene in scenes:
            self.total += _steps_guess(scene) + (0 if scene.body is None else MORPH_WORK)
        self.done = 0
        self.goal = 0
        self.progress = progress

    def tick(self) -> None:
        self.done = min(self.done + 1, self.total)
        if self.progress is not None:
            self.progress(self.done, self.total)

    def finish(self, work: int) -> None:
        """A stage planned as `work` steps is over, however many it took."""
        self.goal += work
        self.done = max(self.done, min(self.goal, self.total) - 1)
        self.tick()


def _steps_guess(scene: Scene) -> int:
    """Frames of a sequence, or steps of a drape once it is in its pose."""
    if scene.sequence is not None:
        return max(1, round(scene.sequence.duration * scene.sequence.fps))
    if scene.motion is None:
        return scene.solver.settle_steps
    return (
        300 if scene.motion.end is None else round((scene.motion.end - scene.motion.start) * scene.motion.fps)
    )


def _drape(scene: Scene, mesh: GarmentMesh, worn: WornGarment, work: _Work, started: float) -> Sample:
    assert scene.body is not None
    beta = scene_beta(scene, worn.model)
    pose = a_pose() if scene.body.pose == "a" else np.zeros((24, 3))
    next_step = with_budget(worn.sim, scene.solver.max_work, work.tick)
    try:
        worn.morph(beta, pose, next_step)
        worn.carry(worn.theta, np.array([0.0, float(worn.model.ground_offset(beta, pose)), 0.0]))
        work.finish(MORPH_WORK)
        tolerance, steps = scene.solver.settle_tolerance, scene.solver.settle_steps
        rest = settle(worn.sim, tolerance, steps, next_step, worn.remesh)
        recording = Recording(worn, mesh)
        recording.take()
    except SimulationError as error:
        raise stopped(f"scene {scene.name}, drape", error, worn.sim) from error
    work.finish(scene.solver.settle_steps)
    return recording.sample(scene, rest, started)


def _shared(scene: Scene) -> dict[str, object]:
    """What all scenes of a chain have in common."""
    body = None if scene.body is None else scene.body.model
    own = {"name", "motion", "seed", "expect", "body", "colliders", "pins", "sequence"}
    return {"body.model": body, **{key: getattr(scene, key) for key in Scene.model_fields if key not in own}}
