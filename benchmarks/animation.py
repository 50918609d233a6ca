"""Frames a second of networks of animated garments, beside the simulator's."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np
import torch

from benchmarks.spread import Spread, paired_ratio
from muslin.learn.wrinkles.clips import told_of
from muslin.learn.wrinkles.model import SHIPPED, WrinkleModel, load_wrinkles
from muslin.learn.wrinkles.network import SIZES, NetworkConfig, WrinkleNetwork
from muslin.learn.wrinkles.predict import push_out_frames
from muslin.learn.wrinkles.process import Drawing
from muslin.sim.body_motion import body_track
from muslin.sim.run import simulate
from muslin.sim.scene import load_scene
from muslin.sim.setting import cut_garment

Result = TypeVar("Result")
WALK = Path(__file__).parents[1] / "scenes/tshirt_walk.toml"
FRAMES = 30
SHORT = 6
"""Frames of the simulation whose time is taken off, for putting on the garment."""


@dataclass(frozen=True)
class Animation:
    """Seconds a frame of one sequence, a value a round: of what is told, of the maps, of positions, of
    pushing out, and of the simulation; how many times all of the first three go into the last."""

    vertices: int
    drawing: str
    told: tuple[float, ...]
    maps: tuple[float, ...]
    positions: tuple[float, ...]
    push_out: tuple[float, ...]
    simulated: tuple[float, ...]
    times_faster: Spread | None

    @property
    def frames_a_second(self) -> tuple[float, ...]:
        return tuple(1.0 / sum(parts) for parts in zip(self.told, self.maps, self.positions, strict=True))


def measure_animation(
    model: Path | None,
    network: str,
    drawing: Drawing,
    device: str,
    threads: int,
    rounds: int,
    simulated: bool,
) -> Animation:
    """A tee of the scene `tshirt_walk`, frame by frame, turn by turn with the simulator on one core; network:
    one of SIZES, untrained, in place of the model's own, for its speed."""
    torch.set_num_threads(threads)
    own = load_wrinkles(model or SHIPPED)
    if network:
        old = own.network.config
        sized = NetworkConfig(
            old.design, old.size, old.conditions, old.fields, old.previous, **SIZES[network]  # type: ignore[arg-type]
        )  # fmt: skip
        own = WrinkleModel(own.world, own.templates, own.condition, own.process, WrinkleNetwork(sized))
    own.drawing = drawing.of(own.process.kind)
    own.network.to(device).eval()
    scene = load_scene(WALK, [f"motion.end={(FRAMES - 1) / 30}"])
    track, mesh = body_track(scene), cut_garment(scene)
    garment = own.garments.of(mesh)
    bodies = own.garments.body.vertices(track.beta, track.poses, track.translations)
    faces = own.garments.body.faces.astype(np.int64)
    fabric = own.world.fabrics[0]
    parts: dict[str, list[float]] = {
        name: [] for name in ("told", "maps", "positions", "push_out", "simulated")
    }
    own.maps([told_of(garment, track, fabric, own.condition, own.world.fps)])
    for _ in range(rounds):
        told = _timed(parts["told"], partial(told_of, garment, track, fabric, own.condition, own.world.fps))
        (maps,) = _timed(parts["maps"], partial(own.maps, [told]))
        found = _timed(parts["positions"], partial(garment.positions, maps, track))
        _timed(parts["push_out"], partial(push_out_frames, mesh, found, bodies, faces))
        if simulated:
            parts["simulated"].append(_simulated_frame())
    learned = [sum(one) for one in zip(parts["told"], parts["maps"], parts["positions"], strict=True)]
    faster = paired_ratio(parts["simulated"], learned) if simulated else None
    named = f"{own.drawing.sampler}, {own.drawing.steps} steps"
    seconds = {name: tuple(own) for name, own in parts.items()}
    return Animation(mesh.num_vertices, named, times_faster=faster, **seconds)


def _timed(seconds: list[float], work: Callable[[], Result]) -> Result:
    begun = time.perf_counter()
    found = work()
    seconds.append((time.perf_counter() - begun) / FRAMES)
    return found


def _simulated_frame() -> float:
    """Seconds of a simulated frame, those of dressing taken off."""
    seconds = []
    for frames in (SHORT, FRAMES):
        scene = load_scene(WALK, [f"motion.end={(frames - 1) / 30}"])
        begun = time.perf_counter()
        simulate(scene)
        seconds.append(time.perf_counter() - begun)
    return (seconds[1] - seconds[0]) / (FRAMES - SHORT)
