"""The setting of the comparison: a t-shirt at rest on the first pose of a walk, made by muslin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from benchmarks.garment import SCENE
from benchmarks.setting import DT, Setting
from muslin.sim.body.interior import MASK_GAP_M, masked_face_is_interior
from muslin.sim.body.load import load_body
from muslin.sim.cloth import build_cloth
from muslin.sim.device import open_device
from muslin.sim.motion.arms import spread_arms
from muslin.sim.motion.grounding import fit_to_body
from muslin.sim.motion.lead_in import lead_in
from muslin.sim.motion_table import read_motion
from muslin.sim.relax import settle
from muslin.sim.run import cut_garment
from muslin.sim.scene import load_scene
from muslin.sim.setting import fabric_of, settings_of
from muslin.sim.solve.simulator import ClothSimulator
from muslin.sim.wear import WornGarment

LEAD_IN_SECONDS = 1.0
START_SECONDS = 0.25
RELEASE_STEPS = 30
RELEASE_DT = 1.0 / 30.0


def make_setting(frames: int, edge_length: float | None = None, scene_file: str = SCENE) -> Setting:
    """Dress, pose and settle; then `frames` frames of the body, 60 a second.

    The cloth starts at rest, since not every simulator can be given velocities; so the body does too.
    `edge_length` metres: of the cloth's triangles, instead of the scene's.
    """
    open_device("cpu")
    overrides = [] if edge_length is None else [f"garment.edge_length={edge_length}"]
    scene = load_scene(scene_file, overrides)
    if scene.body is None or scene.motion is None:
        raise ValueError(f"{scene_file}: a setting needs [body] and [motion]")
    mesh = cut_garment(scene)
    fabric = fabric_of(scene, scene.garment)
    cloth = build_cloth(mesh, fabric)
    model = load_body(scene.body.model)
    beta = np.zeros(model.num_betas)
    clip = fit_to_body(read_motion(scene.motion), model, beta)
    clip, _ = spread_arms(clip.clip(scene.motion.start, scene.motion.end or clip.duration), model, beta)
    times = from_rest(DT * np.arange(frames + 1, dtype=np.float64))
    if times[-1] > clip.duration:
        most = int((clip.duration + 0.5 * START_SECONDS) / DT)
        raise ValueError(f"frames = {frames}: {scene.motion.usual_name} of {scene_file} has {most}")

    contact, solver = settings_of(scene)
    worn = WornGarment([mesh], [cloth], model, beta, contact, solver, "cpu")
    way_in = lead_in(clip, LEAD_IN_SECONDS, 1.0 / DT)
    worn.carry(way_in.poses[0], way_in.translations[0])
    for theta, translation in zip(way_in.poses[1:], way_in.translations[1:], strict=True):
        worn.follow(theta, translation, DT)
    settle(worn.sim, scene.solver.settle_tolerance, scene.solver.settle_steps)

    poses, translations = clip.at(times)
    body = np.array([model.vertices(beta, *at) for at in zip(poses, translations, strict=True)])
    every = np.arange(len(model.faces))
    hidden = [masked_face_is_interior(frame, model.faces, every, MASK_GAP_M) for frame in body]

    # Released from gravity and body, the cloth takes the shape in space that strains it least.
    free = ClothSimulator(
        cloth, worn.sim.positions, np.zeros((0, 3)), np.zeros((0, 3), np.int32), contact, solver
    )
    free.set_gravity((0.0, 0.0, 0.0))
    for _ in range(RELEASE_STEPS):
        free.advance(None, RELEASE_DT, inertia=False)
    return Setting(
        positions=worn.sim.positions,
        faces=mesh.faces.astype(np.int32),
        panel_vertices=mesh.panel_vertices,
        panel_faces=mesh.panel_faces.astype(np.int32),
        free_positions=free.positions,
        mass=cloth.mass,
        body=body,
        body_faces=model.faces.astype(np.int32),
        hidden=np.array(hidden),
        density=np.array(fabric.density),
        stretch=fabric.stretch_rest,
        bend=fabric.bend[:, 0],
        friction=np.array(scene.friction_body),
    )


def from_rest(times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Times in a clip, s, at times since the start: its pace grows evenly to 1 in `START_SECONDS`."""
    ramp = np.minimum(times, START_SECONDS)
    return ramp**2 / (2.0 * START_SECONDS) + times - ramp
