"""What every place of the cloth is told of its motion."""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import NDArray

from muslin.learn.wrinkles.skin import GarmentSkin
from muslin.sim.dataset.sample import BodyTrack

Floats = NDArray[np.float64]

FIELDS = 12
NEAR = 0.05
"""Metres that a gap of one stands for; larger ones than two are cut to that."""
DOWN = np.array([0.0, -1.0, 0.0])
GRAVITY = 9.81


def motion_fields(skin: GarmentSkin, template: NDArray[np.floating], track: BodyTrack, fps: float) -> Floats:
    """(T, V, FIELDS): what acts on cloth that follows the skin from its template x (V, 3), as it sees it,

        M^T [g / |g|,  v,  a / |g|,  (y - c) / NEAR],   v_t = (y_t - y_{t-1}) fps,  a_t = (v_t - v_{t-1}) fps,

    y the posed template, metres, c the point of the body nearest to it, and M the blended transform of
    `GarmentSkin`, so that M^T f is the force that f is in the unposed garment, where displacements are told.
    Frames that have no v or a yet take the first that there is; with too few frames for one, 0.

    A vector of pose and motion says the same of the whole body, but nothing about where on it the cloth is:
    what a network has learned at one arm, or in one motion, serves it at another.
    """
    linear, shift, offsets = skin.motion(track.beta, track.poses, track.translations)
    posed = np.einsum("tvij,tvj->tvi", linear, template + offsets) + shift
    velocity = _rate(posed, fps, 1)
    acceleration = _rate(velocity[1:], fps, 2) if len(posed) > 1 else np.zeros_like(posed)
    down = np.broadcast_to(DOWN, posed.shape)
    acting = np.stack([down, velocity, acceleration / GRAVITY, gaps(skin, posed, track)], axis=2)
    return np.einsum("tvji,tvkj->tvki", linear, acting).reshape(*posed.shape[:2], FIELDS)


def gaps(skin: GarmentSkin, posed: Floats, track: BodyTrack) -> Floats:
    """(T, V, 3) (y - c) / NEAR of points y (T, V, 3), cut to a length of two."""
    bodies = skin.model.vertices(track.beta, track.poses, track.translations)
    faces = skin.model.faces.astype(np.int64)
    nearest = [
        igl.point_mesh_squared_distance(y, body, faces)[2] for y, body in zip(posed, bodies, strict=True)
    ]
    apart = (posed - np.stack(nearest)) / NEAR
    length = np.linalg.norm(apart, axis=-1, keepdims=True)
    return apart * np.minimum(1.0, 2.0 / np.maximum(length, 1e-12))


def _rate(values: Floats, fps: float, before: int) -> Floats:
    """Rates between frames, the first of them also for the `before` frames that have none."""
    if len(values) < 2:
        return np.zeros((len(values) + before - 1, *values.shape[1:]))
    rates = np.diff(values, axis=0) * fps
    return np.concatenate([np.repeat(rates[:1], before, axis=0), rates])
