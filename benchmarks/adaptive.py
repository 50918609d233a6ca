"""Accuracy for cost: drapes in uniform and in adaptively remeshed cloth, against a far finer uniform one.

A strip hangs over a bar: bent around it, straight below. Where it bends, edges have to be short.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from muslin.eval.metrics.surface_sampling import surface_distance
from muslin.eval.plots import COLOURS
from muslin.sim.run import simulate
from muslin.sim.scene import parse_scene

REFERENCE_EDGE = 0.004
UNIFORM_EDGES = (0.04, 0.028, 0.02, 0.014, 0.01)
REFINE_ANGLES = (0.8, 0.6, 0.4, 0.3, 0.2)
SIZE_MAX = 0.1

SCENE: dict[str, Any] = {
    "name": "bar",
    "fabric": "gray-interlock",
    "garment": {
        "design": "sheet",
        "parameters": {"width": 0.2, "length": 0.8},
        "position": [0.0, 0.0225, 0.0],
    },
    "colliders": [
        {
            "shape": "cylinder",
            "radius": 0.02,
            "height": 0.4,
            "rotation": [0.0, 0.0, 0.5 * np.pi],
            "sections": 96,
        }
    ],
    "solver": {"settle_tolerance": 1e-5, "settle_steps": 400},
}


@dataclass(frozen=True)
class Drape:
    """One drape: its `kind`, what it was made with (an edge length, m, or refine_angle, rad), vertices, CPU
    seconds, and the mean distance of its surface from the reference's, metres."""

    kind: str
    given: float
    vertices: int
    seconds: float
    error: float


def measure(rounds: int, tell: Callable[[str], None]) -> list[Drape]:
    """Drapes of both kinds, alternating; seconds are the least of the rounds."""
    tell(f"reference: edges of {REFERENCE_EDGE * 1e3:g} mm")
    truth = _drape({"edge_length": REFERENCE_EDGE}, None)
    found: dict[tuple[str, float], Drape] = {}
    for _ in range(rounds):
        for edge, angle in zip(UNIFORM_EDGES, REFINE_ANGLES, strict=True):
            remesh = {"refine_angle": angle, "size_min": 0.002, "size_max": SIZE_MAX, "aspect_min": 0.1}
            for kind, given, garment, table in (
                ("uniform", edge, {"edge_length": edge}, None),
                ("remeshed", angle, {"edge_length": 0.05}, remesh),
            ):
                positions, faces, seconds = _drape(garment, table)
                error = surface_distance(positions, faces, truth[0], truth[1]).mean
                last = found.get((kind, given))
                best = seconds if last is None else min(seconds, last.seconds)
                found[kind, given] = Drape(kind, given, len(positions), best, error)
                tell(f"{kind} {given:g}: {len(positions)} vertices, {error * 1e3:.3f} mm, {seconds:.1f} s")
    return list(found.values())


def _drape(
    garment: dict[str, Any], remesh: dict[str, Any] | None
) -> tuple[NDArray[np.float64], NDArray[np.int32], float]:
    values = SCENE | {"garment": SCENE["garment"] | garment}
    if remesh is not None:
        values["remesh"] = remesh
    started = time.process_time()
    sample = simulate(parse_scene(values))
    seconds = time.process_time() - started
    return sample.positions[0].astype(np.float64), sample.garment.faces, seconds


def saving(drapes: Sequence[Drape], of: str) -> dict[float, float]:
    """For every uniform drape whose error lies among the remeshed ones': its `vertices` or `seconds` over
    what remeshing needs for the same error, read off the line through the remeshed drapes in logarithms."""
    adaptive = sorted((d for d in drapes if d.kind == "remeshed"), key=lambda d: d.error)
    errors, costs = (np.log([getattr(d, key) for d in adaptive]) for key in ("error", of))
    return {
        drape.given: float(getattr(drape, of) / np.exp(np.interp(np.log(drape.error), errors, costs)))
        for drape in drapes
        if drape.kind == "uniform" and errors[0] <= np.log(drape.error) <= errors[-1]
    }


def table(drapes: Sequence[Drape]) -> str:
    """The drapes as a Markdown table, uniform ones with what they cost over remeshed ones of their error."""
    vertices, seconds = saving(drapes, "vertices"), saving(drapes, "seconds")
    lines = [
        "| mesh | vertices | mean distance, mm | CPU s | vertices over remeshed | CPU s over remeshed |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for drape in sorted(drapes, key=lambda d: (d.kind, d.vertices)):
        unit = "edges of {:g} mm" if drape.kind == "uniform" else "refine_angle {:g}"
        given = unit.format(drape.given * (1e3 if drape.kind == "uniform" else 1.0))
        ratios = [
            f"{ratio[drape.given]:.1f}" if drape.kind == "uniform" and drape.given in ratio else ""
            for ratio in (vertices, seconds)
        ]
        cells = [f"{drape.kind}, {given}", str(drape.vertices), f"{drape.error * 1e3:.3f}"]
        lines.append("| " + " | ".join([*cells, f"{drape.seconds:.1f}", *ratios]) + " |")
    return "\n".join(lines) + "\n"


def plot(drapes: Sequence[Drape], path: Path) -> None:
    """Error against vertices, both axes logarithmic, as PNG."""
    figure = Figure(figsize=(6.0, 3.6), dpi=120, layout="constrained")
    axes = figure.add_subplot()
    for kind, colour in (("uniform", COLOURS[0]), ("remeshed", COLOURS[1])):
        chosen = sorted((d for d in drapes if d.kind == kind), key=lambda d: d.vertices)
        axes.loglog(
            [d.vertices for d in chosen], [d.error * 1e3 for d in chosen], "o-", color=colour, label=kind
        )
    axes.set_xlabel("vertices")
    axes.set_ylabel("mean distance to the reference, mm")
    axes.legend(frameon=False)
    axes.grid(alpha=0.3, which="both")
    figure.savefig(path)
