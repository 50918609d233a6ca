"""Cloth without a wearer, from its scene to a sample."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.garments.merge import merge_meshes
from muslin.garments.mesh import GarmentMesh
from muslin.sim.budget import with_budget
from muslin.sim.certify import certify, solved
from muslin.sim.cloth import merge_cloths
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.intersections import count_intersections
from muslin.sim.dataset.remeshed import sample_of_frames
from muslin.sim.dataset.sample import Sample
from muslin.sim.failure import stopped
from muslin.sim.relax import RestReport, settle
from muslin.sim.remesh.in_loop import Remesher
from muslin.sim.scene import Scene
from muslin.sim.setting import garments_of, settings_of
from muslin.sim.solve.errors import SimulationError
from muslin.sim.solve.simulator import ClothSimulator
from muslin.sim.world.colliders import Colliders
from muslin.sim.world.pins import Pins
from muslin.sim.world.placing import lay_flat

Tick = Callable[[], None]


def play(scene: Scene, device: str, tick: Tick) -> Sample:
    """The drape or the sequence of a scene that has no body; `tick` is called after every step or frame."""
    started = time.perf_counter()
    stage = _Stage(scene, device)
    rest = None
    if scene.sequence is None:
        rest = stage.settle(tick)
        frames = [stage.frame(0.0)]
    else:
        frames = stage.run(tick)
    moving = stage.colliders.moves and len(frames) > 1
    sample = sample_of_frames(
        [frame.mesh for frame in frames],
        [frame.positions for frame in frames],
        id=scene.name,
        kind="drape" if scene.sequence is None else "sequence",
        certificate=Certificate(),
        fps=None if scene.sequence is None else scene.sequence.fps,
        obstacle_vertices=np.array([frame.colliders for frame in frames[: None if moving else 1]], np.float32)
        if len(stage.colliders.faces)
        else None,
        obstacle_faces=stage.colliders.faces if len(stage.colliders.faces) else None,
        fabric="+".join(dict.fromkeys(fabric.name for fabric in stage.cloth.fabrics)),
        scene=scene.model_dump(mode="json"),
        seed=scene.seed,
    )
    distance = min(frame.distance for frame in frames)
    return certify(sample, solved(scene, distance, rest, started, len(frames), stage.remesher))


@dataclass(frozen=True, eq=False)
class _Frame:
    """A mesh and its positions (V, 3), those of the colliders (N, 3), and their smallest distance; metres."""

    mesh: GarmentMesh
    positions: NDArray[np.float64]
    colliders: NDArray[np.float64]
    distance: float


class _Stage:
    """All that a scene holds, where it is at the beginning."""

    def __init__(self, scene: Scene, device: str) -> None:
        self.scene = scene
        garments = garments_of(scene)
        meshes = [g.mesh for g in garments]
        self.begun = merge_meshes([g.name for g in garments], meshes)
        self.cloth = merge_cloths([g.cloth for g in garments])
        start = np.concatenate(
            [lay_flat(g.mesh, g.table.position, g.table.rotation) + g.shift for g in garments]
        )
        self.colliders = Colliders(scene.colliders)
        self.pins = Pins(scene.pins, meshes, start)
        there = self.colliders.at(0.0)
        counts = count_intersections(start, self.cloth.faces, there, self.colliders.faces)
        if counts.cloth_cloth or counts.cloth_body:
            raise InputError(
                f"scene {scene.name}: the cloth begins with {counts.cloth_body} intersections with "
                f"colliders and {counts.cloth_cloth} with itself; change garment.position or those of layers "
                "and colliders"
            )
        contact, solver = settings_of(scene)
        self.sim = ClothSimulator(self.cloth, start, there, self.colliders.faces, contact, solver, device)
        self.sim.pins, _ = self.pins.at(0.0)
        self.remesher: Remesher | None = None
        if scene.remesh is not None:
            self.remesher = Remesher(scene.remesh.settings, self.begun, [g.fabric for g in garments])

    def frame(self, time: float) -> _Frame:
        """What is stored of the state at `time` s."""
        mesh = self.begun if self.remesher is None else self.remesher.mesh
        distance = self.sim.contact.smallest_distance(self.sim.x)
        return _Frame(mesh, self.sim.positions, self.colliders.at(time), distance)

    def remesh(self) -> bool:
        """To be called after a time step: the mesh follows what the cloth does, if the scene says so. Returns
        whether it is as it should be."""
        if self.remesher is None:
            return True
        origin = self.remesher.step(self.sim)
        if origin is not None:
            self.pins.renumber(origin)
        return self.remesher.calm

    def settle(self, tick: Tick) -> RestReport:
        s = self.scene.solver
        next_step = with_budget(self.sim, s.max_work, tick)
        try:
            return settle(self.sim, s.settle_tolerance, s.settle_steps, next_step, self.remesh)
        except SimulationError as error:
            raise stopped(f"scene {self.scene.name}", error, self.sim) from error

    def run(self, tick: Tick) -> list[_Frame]:
        """All frames of the sequence; the first is the beginning."""
        assert self.scene.sequence is not None
        fps = self.scene.sequence.fps
        substeps = self.scene.solver.substeps(fps)
        frames = [self.frame(0.0)]
        for frame in range(1, 1 + int(np.floor(self.scene.sequence.duration * fps + 1e-6))):
            self.sim.work_left = self.scene.solver.max_work
            for step in range(1, substeps + 1):
                now = (frame - 1 + step / substeps) / fps
                self.sim.pins, targets = self.pins.at(now)
                goal = self.colliders.at(now) if self.colliders.moves else None
                try:
                    self.sim.advance(goal, 1.0 / (fps * substeps), pin_targets=targets)
                    self.remesh()
                except SimulationError as error:
                    where = f"scene {self.scene.name}, frame {frame}"
                    raise stopped(where, error, self.sim) from error
            frames.append(self.frame(frame / fps))
            tick()
        return frames
