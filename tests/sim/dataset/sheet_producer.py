"""A cheap, exact producer of samples: a rippling sheet that floats over a ball.

The sheet is y = height + ripple sin(12 x + phase), its lowest point `clearance` above a ball of radius 0.3 m,
so whether it meets the ball is known from geometry. Like a chain of real drapes, each sample depends on those
before it in its chain: the phase is the sum of the betas so far.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from unpacked import entries_of

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.config import DatasetConfig, parse_config
from muslin.sim.dataset.sample import Sample
from muslin.sim.solve.errors import LastState, SimulationError

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
    faces = np.concatenate([np.stack([p.ravel() for p in t], 1) for t in ((a, d, c), (a, c, b))]).astype(
        np.int32
    )
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
def ball(n: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (1, N, 3) and faces of the ball: poles, and n/2 - 1 circles of n vertices."""
    polar, around = np.meshgrid(
        np.pi * np.arange(1, n // 2) / (n // 2), 2 * np.pi * np.arange(n) / n, indexing="ij"
    )
    rings = np.stack([np.sin(polar) * np.sin(around), np.cos(polar), np.sin(polar) * np.cos(around)], axis=-1)
    vertices = np.concatenate([rings.reshape(-1, 3), [[0, 1, 0], [0, -1, 0]]])
    ring = np.arange((n // 2 - 1) * n).reshape(-1, n)
    after = np.roll(ring, -1, axis=1)
    a, b, c, d = ring[:-1], ring[1:], after[1:], after[:-1]
    top, bottom = np.full(n, len(vertices) - 2), np.full(n, len(vertices) - 1)
    triangles = [(a, b, c), (a, c, d), (top, ring[0], after[0]), (bottom, after[-1], ring[-1])]
    faces = np.concatenate([np.stack([corner.ravel() for corner in t], axis=1) for t in triangles])
    return (RADIUS * vertices)[None].astype(np.float32), faces.astype(np.int32)


def make_sample(
    sample_id: str = "sheet", frames: int = 1, clearance: float = 0.02, phase: float = 0.0
) -> Sample:
    garment = sheet()
    vertices, faces = ball()
    phases = phase + 0.3 * np.arange(frames)
    return Sample(
        id=sample_id,
        kind="drape" if frames == 1 else "sequence",
        garment=garment,
        positions=sheet_positions(garment, RADIUS + clearance + RIPPLE, phases),
        certificate=Certificate(
            cloth_cloth_intersections=0, cloth_body_intersections=0, min_distance_m=clearance
        ),
        fps=None if frames == 1 else 30.0,
        obstacle_vertices=vertices,
        obstacle_faces=faces,
        fabric="paper",
        scene={"clearance": clearance},
    )


def make_scene(values: dict[str, Any]) -> dict[str, Any]:
    """The scene as it is; ValueError for what a sheet does not know, as pydantic would raise."""
    unknown = values.keys() - {"garment", "body", "motion", "fabric", "fail_at", "stuck_at", "die_at"}
    if unknown:
        raise ValueError(f"unknown key {min(unknown)}")
    return values


def simulate(
    scenes: list[dict[str, Any]], device: str, progress: Callable[[int, int], None] | None
) -> Iterator[Sample]:
    """Samples of a chain of scenes; fails at shape `fail_at`, is stuck at `stuck_at`, dies at `die_at`.

    SHEET_FAULTS, a JSON object, says where for all scenes. SHEET_DELAY s each; shapes whose beta is above
    SHEET_HOLD are never done.
    """
    phase = 0.0
    hold = float(os.environ.get("SHEET_HOLD", "inf"))
    everywhere = json.loads(os.environ.get("SHEET_FAULTS", "{}"))
    for done, scene in enumerate(scenes):
        beta = scene.get("body", {}).get("beta", [0.0])
        phase += beta[0]
        time.sleep(float(os.environ.get("SHEET_DELAY", "0")))
        while beta[0] > hold:
            time.sleep(1.0)
        faults = everywhere | scene
        if faults.get("fail_at") == beta[0]:
            raise InputError(f"cannot dress shape {beta[0]}")
        if faults.get("stuck_at") == beta[0]:
            here = make_sample().positions[0].astype(np.float64)
            state = LastState(here, np.zeros_like(here), sheet().faces, ball()[0][0], ball()[1])
            raise SimulationError("frame 3: cloth [7] is stuck", state)
        if faults.get("die_at") == beta[0]:
            os._exit(9)
        frames = 1 if "motion" not in scene else round(scene["motion"]["end"] * scene["motion"]["fps"])
        yield make_sample("unnamed", frames=frames, phase=phase)
        if progress is not None:
            progress(done + 1, len(scenes))


def files_of(root: Path) -> dict[str, bytes]:
    """{sample/entry: bytes} of every sample of a dataset, in the order of the file, but the seconds that it
    took."""
    files = {}
    for file in sorted((root / "samples").iterdir()):
        for name, content in entries_of(file).items():
            data = content
            if name == "zarr.json":
                values = json.loads(data)
                values["attributes"]["meta"]["certificate"].pop("seconds")
                values["attributes"].pop("meta_sha256")
                data = json.dumps(values).encode()
            files[f"{file.name}/{name}"] = data
    return files


def sheets_config() -> DatasetConfig:
    """Two chains of four drapes and a sequence of 30 frames."""
    return parse_config(
        {
            "name": "sheets",
            "shapes": [{"name": "s", "sweep": {"component": 0, "start": -1.0, "stop": 1.0, "count": 8}}],
            "chain": 4,
            "sequences": [{"clip": "wave", "end": 1.0}],
            "splits": {"test": {"shapes": ["s-003"], "sequences": ["wave"]}},
        }
    )
