"""From a scene to a verified sample."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from importlib.metadata import version

import numpy as np
import trimesh
import warp as wp
from numpy.typing import NDArray

from muslin.garments import catalogue
from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.pattern_file import read_pattern
from muslin.garments.template import template
from muslin.garments.triangulate import triangulate
from muslin.sim.body.load import load_body
from muslin.sim.body.model import BodyModel
from muslin.sim.certify import certify
from muslin.sim.cloth import ClothModel, build_cloth
from muslin.sim.contact.system import ContactSettings
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.sample import BodyTrack, Sample
from muslin.sim.device import open_device
from muslin.sim.material import load_fabric
from muslin.sim.motion.arms import spread_arms
from muslin.sim.motion.clips import load_motion
from muslin.sim.motion.grounding import fit_to_body
from muslin.sim.motion.lead_in import lead_in
from muslin.sim.motion.motion import Motion
from muslin.sim.relax import RestReport, settle
from muslin.sim.scene import Scene
from muslin.sim.solve.errors import SimulationError
from muslin.sim.solve.simulator import ClothSimulator, SolverSettings
from muslin.sim.wear import WornGarment, a_pose

__all__ = ["SimulationError", "compile_kernels", "simulate", "simulate_chain"]

Progress = Callable[[int, int], None]

DRESS_WORK, MORPH_WORK = 40, 40
LEAD_IN_SECONDS = 1.0


def simulate(scene: Scene, device: str = "cpu", progress: Progress | None = None) -> Sample:
    """Simulate one scene. InputError: the scene cannot be; SimulationError: the solver gave up."""
    return next(simulate_chain([scene], device, progress))


def simulate_chain(
    scenes: Sequence[Scene], device: str = "cpu", progress: Progress | None = None
) -> Iterator[Sample]:
    """Samples of scenes that share garment, fabric and body model, each draped from where the last one ended.

    The garment is put on once; between drapes the body changes shape inside it.
    """
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
    mesh = cut_garment(first)
    scale = first.fabric_scale
    cloth = build_cloth(mesh, load_fabric(first.fabric).scaled(scale.density, scale.stretch, scale.bend))
    work = _Work(scenes, progress)
    if first.body is None:
        for scene in scenes:
            yield _drape_on_sphere(scene, mesh, cloth, device, work)
        return
    model = load_body(first.body.model)
    started = time.perf_counter()
    clip = None if first.motion is None else _clip(first, model)
    contact, solver = _settings(first)
    try:
        worn = WornGarment(mesh, cloth, model, _beta(first, model), contact, solver, device, work.tick)
    except SimulationError as error:
        raise SimulationError(f"scene {first.name}, dressing: {error}") from error
    work.finish(DRESS_WORK)
    for scene in scenes:
        if clip is None:
            yield _drape(scene, mesh, cloth, worn, work, started)
        else:
            yield _sequence(scene, mesh, cloth, worn, clip, work, started)
        started = time.perf_counter()


def cut_garment(scene: Scene) -> GarmentMesh:
    """The garment mesh of a scene."""
    g = scene.garment
    if g.pattern is not None:
        return triangulate(read_pattern(g.pattern), g.edge_length, g.seed)
    design = catalogue.get(g.design)
    parameters = {**(design.preset(g.preset) if g.preset is not None else {}), **g.parameters}
    if g.template is not None:
        return template(g.design, parameters, g.template)
    return triangulate(design.pattern(**parameters), g.edge_length, g.seed)


def compile_kernels(device: str = "cpu") -> None:
    """Compile every kernel of the simulator for `device`, or load it from Warp's cache."""
    open_device(device)
    wp.force_load(device)


class _Work:
    """Progress of a chain in steps of about the same cost."""

    def __init__(self, scenes: Sequence[Scene], progress: Progress | None) -> None:
        self.total = DRESS_WORK
        for scene in scenes:
            self.total += MORPH_WORK
            self.total += scene.solver.settle_steps if scene.motion is None else _frames_guess(scene)
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


def _frames_guess(scene: Scene) -> int:
    assert scene.motion is not None
    if scene.motion.end is None:
        return 300
    return round((scene.motion.end - scene.motion.start) * scene.motion.fps)


def _settings(scene: Scene) -> tuple[ContactSettings, SolverSettings]:
    s = scene.solver
    contact = ContactSettings(
        range=s.contact_range,
        stiffness=s.contact_stiffness,
        friction_body=scene.friction_body,
        friction_cloth=scene.friction_cloth,
    )
    solver = SolverSettings(
        gravity=scene.gravity,
        damping=s.damping,
        drag=s.drag,
        tolerance=s.tolerance,
        max_iterations=s.max_iterations,
    )
    return contact, solver


def _beta(scene: Scene, model: BodyModel) -> NDArray[np.float64]:
    assert scene.body is not None
    given = scene.body.beta
    if len(given) > model.num_betas:
        raise InputError(
            f"body.beta holds {len(given)} values; body {model.name!r} has {model.num_betas}: give no more"
        )
    return np.array([*given, *np.zeros(model.num_betas - len(given))])


def _drape(
    scene: Scene, mesh: GarmentMesh, cloth: ClothModel, worn: WornGarment, work: _Work, started: float
) -> Sample:
    assert scene.body is not None
    beta = _beta(scene, worn.model)
    pose = a_pose() if scene.body.pose == "a" else np.zeros((24, 3))
    try:
        worn.morph(beta, pose, work.tick)
        worn.carry(worn.theta, np.array([0.0, float(worn.model.ground_offset(beta, pose)), 0.0]))
        work.finish(MORPH_WORK)
        rest = settle(worn.sim, scene.solver.settle_tolerance, scene.solver.settle_steps, tick=work.tick)
    except SimulationError as error:
        raise SimulationError(f"scene {scene.name}, drape: {error}") from error
    work.finish(scene.solver.settle_steps)
    return _sample(scene, mesh, cloth, worn, [worn.sim.positions], [_state(worn)], rest, started)


def _shared(scene: Scene) -> dict[str, object]:
    """What all scenes of a chain have in common."""
    body = None if scene.body is None else scene.body.model
    own = {"name", "motion", "seed", "expect", "body", "collider"}
    return {"body.model": body, **{key: getattr(scene, key) for key in Scene.model_fields if key not in own}}


def _clip(scene: Scene, model: BodyModel) -> Motion:
    """The motion of a scene on its body."""
    assert scene.motion is not None
    m = scene.motion
    beta = _beta(scene, model)
    clip = fit_to_body(load_motion(m.clip), model, beta)
    clip = clip.clip(m.start, clip.duration if m.end is None else m.end)
    return spread_arms(clip, model, beta)[0] if m.spread_arms else clip


def _sequence(
    scene: Scene,
    mesh: GarmentMesh,
    cloth: ClothModel,
    worn: WornGarment,
    clip: Motion,
    work: _Work,
    started: float,
) -> Sample:
    assert scene.motion is not None
    m = scene.motion
    substeps = int(np.ceil(1.0 / (m.fps * scene.solver.dt) - 1e-9))
    step_rate = m.fps * substeps
    way_in = lead_in(clip, LEAD_IN_SECONDS, step_rate)
    worn.carry(way_in.poses[0], way_in.translations[0])
    frames = int(np.floor(clip.duration * m.fps + 1e-6)) + 1
    times = np.arange((frames - 1) * substeps + 1) / step_rate
    poses, translations = clip.at(times)
    path = [*zip(way_in.poses[1:], way_in.translations[1:], strict=True)]
    path += [*zip(poses[1:], translations[1:], strict=True)]
    positions, states = [], []
    for k, (theta, translation) in enumerate(path):
        passed = k + 1 - (len(way_in.poses) - 1)
        try:
            worn.follow(theta, translation, 1.0 / step_rate)
            if passed == 0:
                steps = scene.solver.settle_steps // 3
                settle(worn.sim, scene.solver.settle_tolerance, steps, tick=work.tick)
                work.finish(MORPH_WORK)
        except SimulationError as error:
            where = "lead-in" if passed <= 0 else f"frame {passed // substeps}"
            raise SimulationError(f"scene {scene.name}, {where}: {error}") from error
        if passed >= 0 and passed % substeps == 0:
            positions.append(worn.sim.positions)
            states.append(_state(worn))
            work.tick()
    return _sample(scene, mesh, cloth, worn, positions, states, None, started, clip)


_State = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int32], float]


def _state(worn: WornGarment) -> _State:
    return worn.theta, worn.translation, worn.masked_faces(), worn.sim.contact.smallest_distance(worn.sim.x)


def _sample(
    scene: Scene,
    mesh: GarmentMesh,
    cloth: ClothModel,
    worn: WornGarment,
    positions: list[NDArray[np.float64]],
    states: list[_State],
    rest: RestReport | None,
    started: float,
    clip: Motion | None = None,
) -> Sample:
    assert scene.body is not None
    track = BodyTrack(
        model=scene.body.model,
        digest=worn.model.digest,
        beta=worn.beta,
        poses=np.array([state[0] for state in states]),
        translations=np.array([state[1] for state in states]),
    )
    sample = Sample(
        id=scene.name,
        kind="drape" if scene.motion is None else "sequence",
        garment=mesh,
        positions=np.array(positions, dtype=np.float32),
        certificate=Certificate(),
        fps=None if scene.motion is None else scene.motion.fps,
        body=track,
        masked_faces=tuple(state[2] for state in states),
        fabric=scene.fabric,
        scene=scene.model_dump(mode="json"),
        seed=scene.seed,
        labels={"sequence": clip.name, "motion_source": clip.source} if clip is not None else {},
    )
    distance = min(state[3] for state in states)
    return certify(sample, cloth, _certificate(scene, distance, rest, started, len(positions)))


def _drape_on_sphere(scene: Scene, mesh: GarmentMesh, cloth: ClothModel, device: str, work: _Work) -> Sample:
    assert scene.collider is not None
    started = time.perf_counter()
    sphere = trimesh.creation.icosphere(subdivisions=4, radius=scene.collider.sphere_radius)
    centre = np.array(scene.collider.sphere_centre)
    vertices = np.asarray(sphere.vertices) + centre
    faces = np.asarray(sphere.faces, dtype=np.int32)
    contact, solver = _settings(scene)
    work.finish(DRESS_WORK)
    sim = ClothSimulator(cloth, _flat_above(mesh, scene), vertices, faces, contact, solver, device)
    work.finish(MORPH_WORK)
    try:
        rest = settle(sim, scene.solver.settle_tolerance, scene.solver.settle_steps, tick=work.tick)
    except SimulationError as error:
        raise SimulationError(f"scene {scene.name}: {error}") from error
    work.finish(scene.solver.settle_steps)
    sample = Sample(
        id=scene.name,
        kind="drape",
        garment=mesh,
        positions=sim.positions[None].astype(np.float32),
        certificate=Certificate(),
        obstacle_vertices=vertices[None].astype(np.float32),
        obstacle_faces=faces,
        fabric=scene.fabric,
        scene=scene.model_dump(mode="json"),
        seed=scene.seed,
    )
    return certify(sample, cloth, _certificate(scene, sim.contact.smallest_distance(sim.x), rest, started, 1))


def _flat_above(mesh: GarmentMesh, scene: Scene) -> NDArray[np.float64]:
    """A single flat panel, level and centred, just above the sphere."""
    assert scene.collider is not None
    if len(mesh.panel_names) != 1:
        raise InputError(
            f"garment {mesh.name!r} has {len(mesh.panel_names)} panels; over a sphere goes one flat panel: "
            'use design = "sheet"'
        )
    flat = np.zeros((mesh.num_vertices, 2))
    flat[mesh.panel_to_vertex] = mesh.panel_vertices
    flat -= 0.5 * (flat.min(axis=0) + flat.max(axis=0))
    height = scene.collider.sphere_radius + 4.0 * scene.solver.contact_range
    lifted = np.stack([flat[:, 0], np.full(len(flat), height), -flat[:, 1]], axis=1)
    return lifted + np.array(scene.collider.sphere_centre)


def _certificate(
    scene: Scene, distance: float, rest: RestReport | None, started: float, frames: int
) -> Certificate:
    seconds = time.perf_counter() - started
    extra: dict[str, float | int | bool] = {"seconds_per_frame": seconds / frames}
    if rest is not None:
        extra |= {"settle_steps": rest.steps, "last_move_m": rest.moved, "at_rest": rest.at_rest}
    return Certificate(
        min_distance_m=distance if np.isfinite(distance) else None,
        force_residual=None if rest is None else rest.residual,
        seed=scene.seed,
        seconds=seconds,
        versions={name: version(name) for name in ("muslin", "warp-lang", "numpy", "ipctk")},
        extra=extra,
    )
