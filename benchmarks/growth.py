"""How cost grows with the number of cloth vertices: the same walk in ever finer cloth, the body as it is."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.contenders.catalogue import MUSLIN
from benchmarks.contenders.record import FRAMES_FILE, RECORD_FILE
from benchmarks.isolated import run
from benchmarks.judge import Verdict, judge
from benchmarks.setting import DT, load_setting
from benchmarks.spread import exponent

REFERENCE_EDGE, REFERENCE_VERTICES = 0.0142, 4176
"""Edge length, metres, at which the t-shirt of the scene has so many vertices."""


@dataclass(frozen=True)
class Growth:
    """`vertices` of each cloth, CPU seconds per simulated second, verdicts, and p of rate = a vertices^p."""

    vertices: tuple[int, ...]
    rates: tuple[float, ...]
    verdicts: tuple[Verdict, ...]
    exponent: float


def measure_growth(
    sizes: Sequence[int], frames: int, out: Path, core: int, tell: Callable[[str], None]
) -> Growth:
    """Walk each size for `frames` frames; settings already made in `out` are used again."""
    vertices, rates, verdicts = [], [], []
    for size in sizes:
        file = out / f"setting_{size}.npz"
        if not file.exists() or load_setting(file).frames < frames:
            tell(f"{size} vertices: dressing")
            edge = edge_length(size)
            command = [sys.executable, "-m", "benchmarks", "setting", "--setting", str(file)]
            command += ["--frames", str(frames), "--edge-length", f"{edge:.5f}"]
            run(command, {core}, out / f"setting_{size}.log")
        tell(f"{size} vertices: walking")
        folder = out / f"walk_{size}"
        command = [sys.executable, "-m", f"benchmarks.contenders.{MUSLIN.module}", str(file), str(folder)]
        run([*command, "--frames", str(frames)], {core}, out / f"walk_{size}.log")
        setting = load_setting(file, frames)
        record = json.loads((folder / RECORD_FILE).read_text(encoding="utf-8"))
        vertices.append(len(setting.positions))
        rates.append(sum(record["seconds"]) / (frames * DT))
        verdicts.append(judge(setting, np.load(folder / FRAMES_FILE)))
        tell(f"  {vertices[-1]} vertices: {rates[-1]:.2f} CPU s per simulated second")
    return Growth(tuple(vertices), tuple(rates), tuple(verdicts), exponent(vertices, rates))


def edge_length(vertices: int) -> float:
    """Edge length, metres, that gives the t-shirt about so many vertices."""
    return REFERENCE_EDGE * float(np.sqrt(REFERENCE_VERTICES / vertices))
