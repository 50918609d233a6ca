"""Pictures of samples: body and garment of a frame, framed and lit."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np

from muslin.sim.dataset.sample import Sample
from muslin.sim.view.camera import Camera, frame_camera
from muslin.sim.view.layer import FABRIC, OBSTACLE, SKIN, Layer, seam_edges
from muslin.sim.view.lighting import FINE, Quality
from muslin.sim.view.render import render

AZIMUTH = float(np.deg2rad(22.0))  # from the front, a little from the wearer's left
ELEVATION = float(np.deg2rad(7.0))
PALETTE = (
    FABRIC,
    (0.62, 0.26, 0.24),
    (0.27, 0.45, 0.35),
    (0.74, 0.58, 0.30),
    (0.42, 0.32, 0.52),
    (0.36, 0.42, 0.46),
)


def fabric_colour(name: str) -> tuple[float, float, float]:
    """A colour of the palette, always the same for a fabric of this name."""
    if not name:
        return FABRIC
    return PALETTE[hashlib.sha256(name.encode()).digest()[0] % len(PALETTE)]


def sample_layers(sample: Sample, frame: int = 0, colours: np.ndarray | None = None) -> list[Layer]:
    """Body (or obstacle) and garment of a frame.

    colours   (V, 3) sRGB of the garment's vertices, such as a heat map; None for the colour of its fabric
    """
    layers = []
    body_vertices = sample.body_vertices(frame)
    if len(body_vertices):
        skin = SKIN if sample.body is not None else OBSTACLE
        layers.append(Layer(body_vertices, sample.body_faces, np.array(skin), gloss=0.12))
    garment = sample.garment
    layers.append(
        Layer(
            sample.positions[frame].astype(np.float64),
            garment.faces,
            np.array(fabric_colour(sample.fabric)) if colours is None else colours,
            sheet=True,
            gloss=0.02,
            seams=seam_edges(garment.faces, garment.panel_faces),
            flat_light=colours is not None,
        )
    )
    return layers


def facing(sample: Sample, frame: int) -> float:
    """Angle from +z towards +x, radians, in which the wearer faces in a frame; 0 without a body."""
    if sample.body is None:
        return 0.0
    rotation = rotation_matrix(sample.body.poses[frame, 0])
    return float(np.arctan2(rotation[0, 2], rotation[2, 2]))


def rotation_matrix(axis_angle: np.ndarray) -> np.ndarray:
    """R = I + sin(a) K + (1 - cos(a)) K^2 (Rodrigues); (3, 3)."""
    angle = float(np.linalg.norm(axis_angle))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = axis_angle / angle
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K


def sample_camera(
    sample: Sample, frames: Sequence[int], size: tuple[int, int], azimuth: float = AZIMUTH
) -> tuple[Camera, float]:
    """A camera that holds the given frames together, from the front of the first; the ground's height."""
    clouds = []
    for frame in frames:
        body = sample.body_vertices(frame)
        clouds.append(np.concatenate([sample.positions[frame], body[:: max(1, len(body) // 2000)]]))
    points = np.concatenate(clouds).astype(np.float64)
    camera = frame_camera(points, *size, facing(sample, frames[0]) + azimuth, ELEVATION)
    return camera, float(points[:, 1].min())


def picture(
    sample: Sample,
    frame: int = 0,
    size: tuple[int, int] = (480, 640),
    azimuth: float = AZIMUTH,
    colours: np.ndarray | None = None,
    quality: Quality = FINE,
    camera: Camera | None = None,
    ground: float | None = None,
) -> np.ndarray:
    """Picture of one frame of a sample; (height, width, 3) uint8.

    azimuth   radians from the wearer's front towards the wearer's left; pi shows the back
    camera    with `ground`, instead of one that frames this frame by itself
    """
    if camera is None:
        camera, ground = sample_camera(sample, [frame], size, azimuth)
    return render(sample_layers(sample, frame, colours), camera, size, quality, ground)
