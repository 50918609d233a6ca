"""Garments around the mean body, waves on them, and motions of the body."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from muslin.garments.designs.tee import armhole_depth
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template
from muslin.learn.wrinkles.skin import GarmentSkin, garment_skin
from muslin.sim.body.load import load_body
from muslin.sim.dataset.sample import BodyTrack
from muslin.sim.dress import place

FPS = 30.0
BETA = np.array([0.7, -0.4, 0.2])


def around_body(mesh: GarmentMesh) -> NDArray[np.float64]:
    """(V, 3) positions around the mean body in T-pose, metres, some of them inside of it."""
    body = load_body("female")
    mean = np.zeros(3)
    return place(mesh, body, mean, body.vertices(mean))


@lru_cache(maxsize=8)
def skinned(length: float = 0.64, resolution: int = 403) -> tuple[GarmentMesh, NDArray, GarmentSkin]:
    """A tee, where it lies around the mean body, and its skin; length: of the garment, metres."""
    mesh = template("tee", {"garment_length": length}, resolution)
    points = around_body(mesh)
    return mesh, points, garment_skin(mesh, points, load_body("female"))


def waves(mesh: GarmentMesh, length: float, height: float = 0.01) -> NDArray[np.float64]:
    """(V, 3) waves of a height and a length, metres, equal on both sides of every seam.

    Front and back have them from 10 cm below the armholes on, where the side seams of the two are the same
    lines, and sleeves below the cap, as functions of the height alone: their underarm seams are as long.
    """
    x, y = mesh.panel_vertices.T
    name = np.asarray(mesh.panel_names)[mesh.panel_vertex_panel]
    sleeve = np.isin(name, ["sleeve_left", "sleeve_right"])
    across = np.where(sleeve, 0.0, np.where(name == "back", -x, x))
    top = np.where(sleeve, 0.12, armhole_depth(mesh.parameters["chest_circumference"]))
    s = np.clip((-y - top) / 0.1, 0.0, 1.0)
    # C2 at both ends, so that no wave is shorter than those asked for.
    begun = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    k = 2.0 * np.pi / length
    phases = np.stack([0.8 * across + 0.6 * y, 0.6 * across - 0.8 * y, across + 0.1], axis=1)
    both = height * begun[:, None] * np.sin(k * phases)
    values = np.zeros((mesh.num_vertices, 3))
    values[mesh.panel_to_vertex] = both
    np.testing.assert_allclose(values[mesh.panel_to_vertex], both, atol=1e-12)
    return values


def track(poses: NDArray[np.float64], translations: NDArray[np.float64] | None = None) -> BodyTrack:
    """The female body of BETA in poses (T, 24, 3) at translations (T, 3)."""
    at = np.zeros((len(poses), 3)) if translations is None else translations
    return BodyTrack("female", load_body("female").digest, BETA, poses, at)


def swinging(frames: int, seed: int = 0) -> BodyTrack:
    """All joints and the translation swing, each by its own phase; joints up to 0.5 rad."""
    draw = np.random.default_rng(seed)
    time = np.arange(frames)[:, None, None] / FPS
    swing = np.sin(2.0 * np.pi * time + draw.uniform(0.0, 2.0 * np.pi, (24, 3)))
    poses = draw.uniform(0.0, 0.5, (24, 3)) * swing / np.sqrt(3.0)
    return track(poses, 0.3 * np.sin(5.0 * time[:, 0] + draw.uniform(0.0, 6.0, 3)))


def turned(moving: BodyTrack, angle: float, shift: NDArray[np.float64]) -> BodyTrack:
    """The same motion, turned by an angle about the vertical through the origin and then shifted."""
    turn = Rotation.from_rotvec([0.0, angle, 0.0])
    pelvis = load_body(moving.model).rest_joints(moving.beta)[0]
    poses = moving.poses.copy()
    poses[:, 0] = (turn * Rotation.from_rotvec(poses[:, 0])).as_rotvec()
    # The root turns about the pelvis, so it is the pelvis that has to get there.
    there = turn.apply(moving.translations + pelvis) + shift - pelvis
    return replace(moving, poses=poses, translations=there)
