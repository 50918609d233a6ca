"""A cheap, exact producer of samples: a rippling sheet that floats over a ball.

The sheet is y = height + ripple sin(12 x + phase), its lowest point `clearance` above a ball of radius 0.3 m, so whether
and where it meets the ball or not is known from geometry. Like a chain of real drapes, each sample depends on those before
it in its chain: the phase is the sum of the betas so far.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.sample import Sample

RADIUS = 0.3
RIPPLE = 0.01


@lru_cache
def sheet(n: int = 9) -> GarmentMesh:
    """A square of one metre, n x n vertices, that faces up."""
    line = np.linspace(0.0, 1.0, n)
    x, z = (grid.ravel() for grid in np.meshgrid(line, line, indexing="ij"))
    panel = np.stack([x, 1.0 - z], axis=1)
    corner = np.arange(n * n, dtype=np.int32).reshape(n, n)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    faces = np.concatenate([np.stack([p.ravel() for p in t], 1) for t in ((a, d, c), (a, c, b))]).astype(np.int32)
    return GarmentMesh(
        faces=faces,
        panel_faces=faces,
        panel_vertices=panel,
        panel_to_vertex=np.arange(n * n, dtype=np.int32),
        face_panel=np.zeros(len(faces), dtype=np.int32),
        panel_names=("sheet",),
        uv=panel,
        name="sheet",
        parameters={"side": 1.0},
    )


def sheet_positions(garment: GarmentMesh, height: float, phases: np.ndarray) -> np.ndarray:
    """(T, V, 3) float32 positions for phases (T,)."""
    x = garment.panel_vertices[:, 0] - 0.5
    z = 0.5 - garment.panel_vertices[:, 1]
    frames = [np.stack([x, height + RIPPLE * np.sin(12 * x + phase), z], axis=1) for phase in phases]
    return np.array(frames, dtype=np.float32)


@lru_cache
def ball() -> tuple[np.ndarray, np.ndarray]:
    """Vertices (1, N, 3) and faces of the ball."""
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=RADIUS)
    return mesh.vertices[None].astype(np.float32), mesh.faces.astype(np.int32)


def make_sample(sample_id: str = "sheet", frames: int = 1, clearance: float = 0.02, phase: float = 0.0) -> Sample:
    garment = sheet()
    vertices, faces = ball()
    phases = phase + 0.3 * np.arange(frames)
    return Sample(
        id=sample_id,
        kind="drape" if frames == 1 else "sequence",
        garment=garment,
        positions=sheet_positions(garment, RADIUS + clearance + RIPPLE, phases),
        certificate=Certificate(cloth_cloth_intersections=0, cloth_body_intersections=0, min_distance_m=clearance),
        fps=None if frames == 1 else 30.0,
        obstacle_vertices=vertices,
        obstacle_faces=faces,
        fabric="paper",
        scene={"clearance": clearance},
    )


def make_scene(values: dict[str, Any]) -> dict[str, Any]:
    """The scene as it is; ValueError for what a sheet does not know, as pydantic would raise."""
    unknown = values.keys() - {"garment", "body", "motion", "fabric", "fail_at", "delay", "die"}
    if unknown:
        raise ValueError(f"unknown key {min(unknown)}")
    return values


def simulate(
    scenes: list[dict[str, Any]], device: str, progress: Callable[[int, int], None] | None
) -> Iterator[Sample]:
    """Samples of a chain of scenes; `delay` s each, fails at shape `fail_at`, `die` ends the process."""
    phase = 0.0
    for done, scene in enumerate(scenes):
        beta = scene.get("body", {}).get("beta", [0.0])
        phase += beta[0]
        time.sleep(scene.get("delay", 0.0))
        if scene.get("fail_at") == beta[0]:
            raise InputError(f"cannot dress shape {beta[0]}")
        if scene.get("die"):
            os._exit(9)
        frames = 1 if "motion" not in scene else round(scene["motion"]["end"] * scene["motion"]["fps"])
        yield make_sample("unnamed", frames=frames, phase=phase)
        if progress is not None:
            progress(done + 1, len(scenes))


def files_of(root: Path) -> dict[str, bytes]:
    """Every file of a dataset's samples but the seconds that they took."""
    files = {}
    for file in sorted((root / "samples").rglob("*")):
        if file.is_file():
            data = file.read_bytes()
            if file.parent.suffix == ".zarr":
                import json

                values = json.loads(data)
                values["attributes"]["meta"]["certificate"].pop("seconds")
                values["attributes"].pop("meta_sha256")
                data = json.dumps(values).encode()
            files[str(file.relative_to(root))] = data
    return files
