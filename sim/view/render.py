"""Pictures of surfaces: rays cast on the processor, so no display, driver or system library is needed.

VTK's wheels draw off screen only where libEGL, libGL or libOSMesa is installed, and end the process with a
segmentation fault where none is; the ray caster in libigl's wheel works everywhere, with the same picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from muslin.garments.errors import InputError
from muslin.sim.view.camera import Camera
from muslin.sim.view.layer import Layer, vertex_normals
from muslin.sim.view.lighting import FINE, Lights, Quality, lights_of, received, smoothed
from muslin.sim.view.rays import cast

BACKGROUND_TOP = (0.965, 0.962, 0.955)
BACKGROUND_BOTTOM = (0.885, 0.880, 0.870)
SEAM_WIDTH = 0.0022  # metres
SEAM_DARKNESS = 0.35


@dataclass(frozen=True, eq=False)
class Scene:
    """All layers as one mesh, with what is interpolated over its faces."""

    vertices: np.ndarray
    faces: np.ndarray
    face_layer: np.ndarray
    normals: np.ndarray
    albedo: np.ndarray  # (V, 3) linear
    seams: np.ndarray


def render(
    layers: Sequence[Layer],
    camera: Camera,
    size: tuple[int, int] = (480, 640),
    quality: Quality = FINE,
    ground: float | None = None,
) -> np.ndarray:
    """Picture of the layers; (height, width, 3) uint8 sRGB.

    size     (width, height), pixels
    ground   height of a ground that only catches shadows, metres; None for no ground

    Raises InputError if a layer holds NaN or infinity, or nothing is there to be seen.
    """
    for layer in layers:
        if not np.isfinite(layer.vertices).all():
            raise InputError("picture: NaN or infinity in the vertices; every coordinate must be finite")
    if not any(len(layer.faces) for layer in layers):
        raise InputError("picture: no triangle to show; give a mesh with faces")
    lights = lights_of(camera)
    visible = [layer for layer in layers if len(layer.faces)]
    scene = _merged(visible)
    picture = _background(*size)
    if ground is not None:
        picture *= _ground_shadow(scene, camera, lights, quality, ground, *size)[..., None]
    n = quality.pixel_samples
    low, high = _covered_rectangle(scene.vertices, camera, *size)
    columns, rows = (high - low) * n
    x, y = np.meshgrid(low[0] * n + np.arange(columns), low[1] * n + np.arange(rows))
    directions = camera.directions(x.ravel() + 0.5, y.ravel() + 0.5, size[0] * n, size[1] * n)
    hits = cast(np.broadcast_to(camera.eye, directions.shape), directions, scene.vertices, scene.faces)
    hit = hits.face >= 0
    region = picture[low[1] : high[1], low[0] : high[0]]
    fine = np.repeat(np.repeat(region, n, axis=0), n, axis=1).reshape(-1, 3)
    fine[hit] = _shade(scene, visible, hits.face[hit], hits.weights[hit], directions[hit], lights, quality)
    region[:] = fine.reshape(rows // n, n, columns // n, n, 3).mean(axis=(1, 3))
    return np.rint(_to_srgb(picture) * 255.0).astype(np.uint8)


def _merged(layers: Sequence[Layer]) -> Scene:
    offsets = np.cumsum([0] + [len(layer.vertices) for layer in layers])
    vertices = np.concatenate([layer.vertices for layer in layers]).astype(np.float64)
    faces = np.concatenate([layer.faces + o for layer, o in zip(layers, offsets, strict=False)]).astype(
        np.int64
    )
    normals = np.concatenate([vertex_normals(layer.vertices, layer.faces) for layer in layers])
    colours = [np.broadcast_to(layer.colour, layer.vertices.shape) for layer in layers]
    seams = [
        np.zeros(layer.faces.shape, dtype=bool) if layer.seams is None else layer.seams for layer in layers
    ]
    return Scene(
        vertices=vertices,
        faces=faces,
        face_layer=np.repeat(np.arange(len(layers)), [len(layer.faces) for layer in layers]),
        normals=normals,
        albedo=_to_linear(np.concatenate(colours)),
        seams=np.concatenate(seams),
    )


def _shade(
    scene: Scene,
    layers: Sequence[Layer],
    face: np.ndarray,
    weights: np.ndarray,
    directions: np.ndarray,
    lights: Lights,
    quality: Quality,
) -> np.ndarray:
    """Linear colours (N, 3) of hits: sky, key and fill (wrapped Lambert), rim, highlight, fuzz, seams."""
    corners = scene.faces[face]
    normal = np.einsum("nk,nkd->nd", weights, scene.normals[corners])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    positions = scene.vertices[corners]
    flat = np.cross(positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0])
    behind = np.einsum("nd,nd->n", flat, directions) > 0
    normal[behind] *= -1.0
    light = np.empty((len(face), 2))
    for side, sign in ((~behind, 1.0), (behind, -1.0)):
        at_vertices = _light_at(scene, np.unique(corners[side]), sign, lights, quality)
        light[side] = np.einsum("nk,nkc->nc", weights[side], at_vertices[corners[side]])
    sky, key = light[:, 0] ** 0.9, light[:, 1]
    albedo = np.einsum("nk,nkd->nd", weights, scene.albedo[corners])
    gloss = np.array([layer.gloss for layer in layers])[scene.face_layer[face]]
    data = np.array([layer.flat_light for layer in layers])[scene.face_layer[face]]

    ambient = sky * (0.42 + 0.16 * normal[:, 1])
    shine = ambient + 0.78 * key * _wrapped(normal @ lights.key, 0.15)
    shine += 0.16 * sky * _wrapped(normal @ lights.fill, 0.4)
    shine = np.where(data, 0.62 + 0.38 * np.minimum(shine, 1.0), shine)
    grazing = np.clip(1.0 + np.einsum("nd,nd->n", normal, directions), 0.0, 1.0)
    rim = np.where(data, 0.0, 0.10 * grazing**3 * sky * (0.4 + _wrapped(normal @ lights.rim, 0.3)))
    half = lights.key - directions
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    highlight = gloss * key * np.clip(np.einsum("nd,nd->n", normal, half), 0.0, 1.0) ** 22
    seam = _seam_share(scene, face, weights, positions)
    return albedo * (shine * (1.0 - SEAM_DARKNESS * seam))[:, None] + (rim + 0.5 * highlight)[:, None]


def _light_at(scene: Scene, used: np.ndarray, sign: float, lights: Lights, quality: Quality) -> np.ndarray:
    """(V, 2) light received at the used vertices only: most of a body is turned away, or covered."""
    light = np.zeros((len(scene.vertices), 2))
    if len(used):
        points, normals = scene.vertices[used], sign * scene.normals[used]
        light[used] = received(points, normals, scene.vertices, scene.faces, lights, quality)
        among = np.zeros(len(light), dtype=bool)
        among[used] = True
        light = smoothed(light, scene.faces[among[scene.faces].all(axis=1)])
    return light


def _wrapped(cosine: np.ndarray, wrap: float) -> np.ndarray:
    return np.clip((cosine + wrap) / (1.0 + wrap), 0.0, None)


def _seam_share(scene: Scene, face: np.ndarray, weights: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """(N,) in [0, 1]: how far a hit is inside the drawn width of a seam."""
    share = np.zeros(len(face))
    marked = np.flatnonzero(scene.seams[face].any(axis=1))
    p = positions[marked]
    area2 = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    for k in range(3):
        length = np.linalg.norm(p[:, (k + 1) % 3] - p[:, k], axis=1)
        height = weights[marked, (k + 2) % 3] * area2 / np.maximum(length, 1e-12)
        inside = np.clip(1.5 - height / (SEAM_WIDTH / 2.0), 0.0, 1.0) * scene.seams[face[marked], k]
        share[marked] = np.maximum(share[marked], inside)
    return share


def _covered_rectangle(
    vertices: np.ndarray, camera: Camera, width: int, height: int
) -> tuple[np.ndarray, np.ndarray]:
    """First and one-past-last pixel (x, y) of the rectangle that the vertices project into."""
    p = camera.project(vertices, width, height)
    low = np.clip(np.floor(p.min(axis=0)).astype(int) - 1, 0, [width, height])
    return low, np.clip(np.ceil(p.max(axis=0)).astype(int) + 1, low, [width, height])


def _background(width: int, height: int) -> np.ndarray:
    t = np.linspace(0.0, 1.0, height)[:, None, None]
    top, bottom = _to_linear(np.array(BACKGROUND_TOP)), _to_linear(np.array(BACKGROUND_BOTTOM))
    return np.broadcast_to((1 - t) * top + t * bottom, (height, width, 3)).copy()


def _ground_shadow(
    scene: Scene,
    camera: Camera,
    lights: Lights,
    quality: Quality,
    ground: float,
    width: int,
    height: int,
) -> np.ndarray:
    """(height, width) factor on the background: 1 where the ground is lit."""
    low, high = scene.vertices.min(axis=0), scene.vertices.max(axis=0)
    reach = 0.9 * float(high[1] - ground) + 0.3
    n = quality.ground_cells
    gx = np.linspace(low[0] - reach, high[0] + reach, n)
    gz = np.linspace(low[2] - reach, high[2] + reach, n)
    X, Z = np.meshgrid(gx, gz, indexing="ij")
    points = np.stack([X.ravel(), np.full(X.size, ground), Z.ravel()], axis=1)
    up = np.broadcast_to([0.0, 1.0, 0.0], points.shape).copy()
    light = received(points, up, scene.vertices, scene.faces, lights, quality)
    factor = (0.62 + 0.38 * light[:, 0]) * (0.86 + 0.14 * light[:, 1])
    border = np.minimum(np.minimum(X - gx[0], gx[-1] - X), np.minimum(Z - gz[0], gz[-1] - Z)).ravel()
    factor = 1.0 - (1.0 - factor) * np.clip(border / (0.5 * reach), 0.0, 1.0)

    x, y = np.meshgrid(np.arange(width), np.arange(height))
    d = camera.directions(x.ravel() + 0.5, y.ravel() + 0.5, width, height)
    result = np.ones(width * height)
    down = np.flatnonzero(d[:, 1] < -1e-6)
    t = (ground - camera.eye[1]) / d[down, 1]
    hx, hz = camera.eye[0] + t * d[down, 0], camera.eye[2] + t * d[down, 2]
    u, v = (hx - gx[0]) / (gx[1] - gx[0]), (hz - gz[0]) / (gz[1] - gz[0])
    held = (u >= 0) & (v >= 0) & (u < n - 1) & (v < n - 1) & (t > 0)
    u, v, down = u[held], v[held], down[held]
    i, j = u.astype(int), v.astype(int)
    a, b = u - i, v - j
    grid = factor.reshape(n, n)
    result[down] = (1 - a) * ((1 - b) * grid[i, j] + b * grid[i, j + 1]) + a * (
        (1 - b) * grid[i + 1, j] + b * grid[i + 1, j + 1]
    )
    return result.reshape(height, width)


def _to_linear(srgb: np.ndarray) -> np.ndarray:
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def _to_srgb(linear: np.ndarray) -> np.ndarray:
    linear = np.clip(linear, 0.0, 1.0)
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)
