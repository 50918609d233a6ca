"""Pictures of samples: body and garment of a frame, framed and lit."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np

from muslin.garments.merge import face_owner
from muslin.sim.dataset.sample import Sample
from muslin.sim.view.camera import Camera, frame_camera
from muslin.sim.view.layer import FABRIC, OBSTACLE, SKIN, Layer, seam_edges
from muslin.sim.view.lighting import FINE, Quality
from muslin.sim.view.render import render

AZIMUTH = float(np.deg2rad(22.0))  # from the front, a little from the wearer's left
ELEVATION = float(np.deg2rad(7.0))
STEADY = 0.8  # seconds over which a walking camera's path is averaged
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


def garment_colours(sample: Sample, frame: int = 0) -> np.ndarray:
    """Colour of a sample's cloth: (3,), or (V_t, 3) with one of the palette for each of several garments."""
    first = fabric_colour(sample.fabric)
    garment = sample.frame_garment(frame)
    owner = face_owner(garment)
    if not owner.any():
        return np.array(first)
    vertex_owner = np.zeros(garment.num_vertices, dtype=np.int64)
    vertex_owner[garment.faces] = owner[:, None]
    return np.array(PALETTE)[(PALETTE.index(first) + vertex_owner) % len(PALETTE)]


def sample_layers(sample: Sample, frame: int = 0, colours: np.ndarray | None = None) -> list[Layer]:
    """Body (or obstacle) and garment of a frame.

    colours   (V_t, 3) sRGB of the garment's vertices, such as a heat map; None for the colours of its fabrics
    """
    layers = []
    body_vertices = sample.body_vertices(frame)
    if len(body_vertices):
        skin = SKIN if sample.body is not None else OBSTACLE
        layers.append(Layer(body_vertices, sample.body_faces, np.array(skin), gloss=0.12))
    garment = sample.frame_garment(frame)
    layers.append(
        Layer(
            sample.frame_positions(frame).astype(np.float64),
            garment.faces,
            garment_colours(sample, frame) if colours is None else colours,
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


def sample_cameras(
    sample: Sample, frames: Sequence[int], size: tuple[int, int], azimuth: float = AZIMUTH
) -> tuple[list[Camera], float]:
    """A camera a frame, and the height of the ground.

    The camera looks from one direction, from the front of the first frame, and walks beside the wearer: its
    path is that of the figure's middle, averaged over `STEADY` seconds. All frames together fill the picture.
    """
    clouds = []
    for frame in frames:
        body = sample.body_vertices(frame)
        some = body[:: max(1, len(body) // 2000)]
        clouds.append(np.concatenate([sample.frame_positions(frame).astype(np.float64), some]))
    ground = min(float(cloud[:, 1].min()) for cloud in clouds)
    middles = np.array([0.5 * (cloud.min(axis=0) + cloud.max(axis=0)) for cloud in clouds])
    middles[:, 1] = 0.0
    seconds = sample.times[list(frames)]
    near = np.maximum(0.0, 1.0 - np.abs(seconds[:, None] - seconds) / (STEADY / 2))
    path = near @ middles / near.sum(axis=1, keepdims=True)
    points = np.concatenate([cloud - step for cloud, step in zip(clouds, path, strict=True)])
    still = frame_camera(points, *size, facing(sample, frames[0]) + azimuth, ELEVATION)
    return [Camera(still.eye + step, still.target + step, still.field_of_view) for step in path], ground


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
        (camera,), ground = sample_cameras(sample, [frame], size, azimuth)
    return render(sample_layers(sample, frame, colours), camera, size, quality, ground)
