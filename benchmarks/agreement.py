"""Surface distances of muslin against those of its peers, with closed forms where there is one."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from benchmarks.contenders.catalogue import Contender
from benchmarks.isolated import run
from benchmarks.surfaces.exchange import RECORD_FILE, Pair, fixed_points
from muslin.eval.metrics.hausdorff import HausdorffBounds, hausdorff
from muslin.eval.metrics.point_sets import chamfer, vertex_hausdorff
from muslin.eval.metrics.surface_sampling import point_to_surface, surface_distance

PEERS = Contender("peers", "peers", "meshes", "pymeshlab", "")
MOST_DIGITS = 15
TOLERANCE = 1e-5


@dataclass(frozen=True)
class Row:
    """A figure of a peer beside muslin's: its `value`, and the interval that muslin says holds the true one,
    metres. `same`: whether both mean to measure the same."""

    pair: str
    peer: str
    value: float
    low: float
    high: float
    same: bool

    @property
    def digits(self) -> float:
        """-log10 of how far the value is from the interval, relative to the interval's upper end; 0 to
        15."""
        off = max(self.low - self.value, self.value - self.high, 0.0)
        if off == 0.0:
            return MOST_DIGITS
        return min(MOST_DIGITS, max(0.0, float(-np.log10(off / max(self.high, 1e-300)))))


def closed_forms() -> dict[str, Pair]:
    """The quad of two splits, a square lifted 5 mm, spheres of radius 1 and 1.02."""
    quad = np.array([[0, 0, 0], [1, 0, 0.2], [1, 1, 0], [0, 1, 0.2]], dtype=np.float64)
    one, other = (np.array(f, dtype=np.int32) for f in ([[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]))
    flat = quad * [1, 1, 0]
    ball = trimesh.creation.icosphere(4)
    faces = np.array(ball.faces, dtype=np.int32)
    return {
        "quad": Pair(quad, one, quad, other),
        "lifted square": Pair(flat, one, flat + np.array([0, 0, 0.005]), other),
        "spheres": Pair(np.array(ball.vertices), faces, 1.02 * np.array(ball.vertices), faces),
    }


def compare(pairs: dict[str, Pair], environments: Path, out: Path, tell: Callable[[str], None]) -> list[Row]:
    """Every figure of every peer on every pair."""
    folder = out / "pairs"
    shutil.rmtree(folder, ignore_errors=True)
    for name, pair in pairs.items():
        pair.save(folder / f"{name}.npz")
    command: list[str | Path] = [PEERS.interpreter(environments), "-m", "benchmarks.surfaces.peers"]
    run([*command, folder, out / "peers"], {0}, out / "peers.log")
    record = json.loads((out / "peers" / RECORD_FILE).read_text(encoding="utf-8"))
    tell(", ".join(f"{name} {version}" for name, version in record["versions"].items()))
    return [row for name, pair in pairs.items() for row in _rows(name, pair, record["figures"][name])]


def _rows(name: str, pair: Pair, found: dict[str, float]) -> Iterator[Row]:
    sides = pair.vertices_a, pair.faces_a, pair.vertices_b, pair.faces_b
    points = point_to_surface(fixed_points(pair), pair.vertices_b, pair.faces_b)
    bounds = hausdorff(*sides, relative=TOLERANCE, absolute=0.0)
    surface = surface_distance(*sides, relative=1e-3, max_samples=500_000)
    sets = chamfer(pair.vertices_a, pair.vertices_b)
    vertices = max(vertex_hausdorff(*sides))
    mean = HausdorffBounds(surface.mean - 3 * surface.mean_error, surface.mean + 3 * surface.mean_error)
    for peer, value in found.items():
        if "points," in peer:
            true = float(points.max() if peer.endswith("largest") else points.mean())
            yield Row(name, peer, value, true, true, True)
        elif "chamfer" in peer:
            yield Row(name, peer, value, sets.sum_plain, sets.sum_plain, True)
        elif peer == "libigl: hausdorff":
            yield Row(name, f"{peer}, against vertex_hausdorff", value, vertices, vertices, True)
            yield Row(name, f"{peer}, against the surfaces'", value, bounds.lower, bounds.upper, False)
        elif "hausdorff" in peer:
            yield Row(name, f"{peer}, against point sets'", value, sets.largest, sets.largest, True)
            yield Row(name, f"{peer}, against the surfaces'", value, bounds.lower, bounds.upper, False)
        else:
            true_one = mean if peer.endswith("mean") else bounds
            yield Row(name, peer, value, true_one.lower, true_one.upper, "face samples" in peer[:24])


def table(rows: list[Row]) -> str:
    """The figures in markdown, millimetres."""
    lines = [
        "| pair | peer, figure | peer, mm | muslin, mm | digits of agreement |",
        "| --- |" + " --- |" * 4,
    ]
    for row in rows:
        ours = f"{1e3 * row.low:.7g}"
        if 1e3 * row.high - 1e3 * row.low > 1e-7 * 1e3 * row.high:
            ours += f" to {1e3 * row.high:.7g}"
        digits = f"{row.digits:.1f}"
        if not row.same and row.digits < 2.0:
            digits = f"**{digits}**"
        lines.append(f"| {row.pair} | {row.peer} | {1e3 * row.value:.7g} | {ours} | {digits} |")
    return "\n".join(lines) + "\n"
