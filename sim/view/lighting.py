"""Soft three-point light: what every vertex, and the ground, receives."""

from __future__ import annotations

from dataclasses import dataclass

import igl.embree
import numpy as np

from muslin.sim.view.camera import Camera
from muslin.sim.view.rays import lit_share

KEY = np.array([-0.55, 0.75, 0.60])  # right, up, towards the camera
FILL = np.array([0.80, 0.15, 0.55])
RIM = np.array([0.35, 0.55, -0.85])
LIGHT_RADIUS = 0.14  # of the key light, radians: how soft its shadows are
OFFSET = 1e-3  # metres, of ray origins off the surface
SHADOW_TOLERANCE = 4e-3  # metres


@dataclass(frozen=True)
class Quality:
    """Rays a vertex for ambient light, directions of the key light, samples a pixel along each axis."""

    ambient_rays: int = 48
    key_rays: int = 12
    pixel_samples: int = 2
    ground_cells: int = 72


DRAFT = Quality(ambient_rays=16, key_rays=5, pixel_samples=2, ground_cells=40)
FINE = Quality()


@dataclass(frozen=True, eq=False)
class Lights:
    """Unit directions towards the three lights, (3,) each, in the world."""

    key: np.ndarray
    fill: np.ndarray
    rim: np.ndarray


def lights_of(camera: Camera) -> Lights:
    """Lights that turn with the camera about the vertical, as in a photo studio."""
    right, _, backward = camera.axes
    forward = np.array([backward[0], 0.0, backward[2]])
    forward = forward / np.linalg.norm(forward)
    basis = np.stack([right, [0.0, 1.0, 0.0], forward])
    key, fill, rim = (light @ basis / np.linalg.norm(light) for light in (KEY, FILL, RIM))
    return Lights(key, fill, rim)


def key_directions(key: np.ndarray, count: int) -> np.ndarray:
    """Unit directions evenly spread over the disc of the key light (golden-angle spiral); (count, 3)."""
    side = np.cross(key, [0.0, 0.0, 1.0] if abs(key[2]) < 0.9 else [1.0, 0.0, 0.0])
    side = side / np.linalg.norm(side)
    i = np.arange(count)
    radius = LIGHT_RADIUS * np.sqrt((i + 0.5) / count)
    angle = i * np.pi * (3.0 - np.sqrt(5.0))
    d = (
        key
        + (radius * np.cos(angle))[:, None] * side
        + (radius * np.sin(angle))[:, None] * np.cross(key, side)
    )
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def received(
    points: np.ndarray,
    normals: np.ndarray,
    vertices: np.ndarray,
    faces: np.ndarray,
    lights: Lights,
    quality: Quality,
) -> np.ndarray:
    """(N, 2): share of the sky seen (1: all) and of the key light seen, by points with normals.

    points, normals (N, 3); vertices, faces: everything that casts shadows.
    """
    v = np.ascontiguousarray(vertices, dtype=np.float64)
    f = np.ascontiguousarray(faces, dtype=np.int64)
    lifted = np.ascontiguousarray(points + OFFSET * normals)
    hidden = igl.embree.ambient_occlusion(v, f, lifted, np.ascontiguousarray(normals), quality.ambient_rays)
    directions = key_directions(lights.key, quality.key_rays)
    return np.stack([1.0 - hidden, lit_share(lifted, directions, v, f, SHADOW_TOLERANCE)], axis=1)


def smoothed(values: np.ndarray, faces: np.ndarray, passes: int = 1) -> np.ndarray:
    """Values (V, k) averaged with those of neighbouring vertices: takes the grain out of few rays."""
    start = np.concatenate([faces[:, [0, 1, 2]].ravel(), faces[:, [1, 2, 0]].ravel()])
    end = np.concatenate([faces[:, [1, 2, 0]].ravel(), faces[:, [0, 1, 2]].ravel()])
    degree = np.bincount(start, minlength=len(values)).astype(np.float64)
    for _ in range(passes):
        around = np.stack(
            [
                np.bincount(start, weights=values[end, k], minlength=len(values))
                for k in range(values.shape[1])
            ],
            axis=1,
        )
        values = 0.5 * values + 0.5 * np.where(
            degree[:, None] > 0, around / np.maximum(degree, 1)[:, None], values
        )
    return values
