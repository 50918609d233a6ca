"""The body of a scene, in every frame of its motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.sim.body.load import load_body
from muslin.sim.body.model import BodyModel
from muslin.sim.dataset.sample import BodyTrack
from muslin.sim.motion.arms import spread_arms
from muslin.sim.motion.grounding import fit_to_body
from muslin.sim.motion.motion import Motion
from muslin.sim.motion_table import read_motion
from muslin.sim.scene import Scene


def scene_beta(scene: Scene, model: BodyModel) -> NDArray[np.float64]:
    """(n,) shape of the body of a scene, of all coefficients of its model. Raises InputError for too many."""
    assert scene.body is not None
    given = scene.body.beta
    if len(given) > model.num_betas:
        raise InputError(
            f"body.beta holds {len(given)} values; body {model.name!r} has {model.num_betas}: give no more"
        )
    return np.array([*given, *np.zeros(model.num_betas - len(given))])


def scene_motion(scene: Scene, model: BodyModel) -> Motion:
    """The motion of a scene on its body."""
    assert scene.motion is not None
    m = scene.motion
    beta = scene_beta(scene, model)
    clip = fit_to_body(read_motion(m), model, beta)
    clip = clip.clip(m.start, clip.duration if m.end is None else m.end)
    return spread_arms(clip, model, beta)[0] if m.spread_arms else clip


def body_track(scene: Scene) -> BodyTrack:
    """The body in the frames that a simulation of the scene would have.

    Raises InputError if the scene has no body or no motion, or a wrong one.
    """
    if scene.body is None or scene.motion is None:
        raise InputError(f"scene {scene.name}: needs [body] and [motion]")
    model = load_body(scene.body.model)
    clip = scene_motion(scene, model)
    poses, translations = clip.at(clip_times(clip, scene.motion.fps))
    beta = scene_beta(scene, model)
    return BodyTrack(scene.body.model, model.digest, beta, poses, translations)


def clip_times(clip: Motion, fps: float, substeps: int = 1) -> NDArray[np.float64]:
    """Seconds of all frames of a clip, and of those that divide the time between them into substeps."""
    frames = int(np.floor(clip.duration * fps + 1e-6)) + 1
    return np.arange((frames - 1) * substeps + 1) / (fps * substeps)
