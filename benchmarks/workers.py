"""`muslin generate` with one worker on one core and two on two; and the memory that making a sample takes."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from benchmarks.garment import SCENE
from benchmarks.isolated import run
from benchmarks.spread import Spread, paired_ratio

MUSLIN_COMMAND = Path(sys.executable).with_name("muslin")

DATASET = """\
name = "workers"
kind = "drape"
chain = {chain}
[scene]
fabric = "gray-interlock"
garment = {{ edge_length = {edge_length} }}
body = {{ model = "female" }}
[[designs]]
name = "tshirt"
preset = "tshirt"
[[shapes]]
sweep = {{ component = 0, start = -1.0, stop = 1.0, count = {samples} }}
"""


@dataclass(frozen=True)
class Scaling:
    """Samples an hour of one and of two workers, a value a round, and the spread of two over one."""

    one: tuple[float, ...]
    two: tuple[float, ...]
    gain: Spread


def measure_workers(
    samples: int,
    edge_length: float,
    rounds: int,
    out: Path,
    cores: tuple[int, int],
    tell: Callable[[str], None],
) -> Scaling:
    """Make the same drapes with one worker and with two, turn by turn."""
    out.mkdir(parents=True, exist_ok=True)
    config = out / "workers.toml"
    config.write_text(DATASET.format(chain=1, edge_length=edge_length, samples=samples), encoding="utf-8")
    hourly: dict[int, list[float]] = {1: [], 2: []}
    for number in range(1, rounds + 1):
        for workers, made in hourly.items():
            folder = out / f"dataset_{workers}"
            shutil.rmtree(folder, ignore_errors=True)
            command: list[str | Path] = [
                MUSLIN_COMMAND,
                "generate",
                config,
                "--out",
                folder,
                "--workers",
                str(workers),
            ]
            used = run(command, set(cores[:workers]), out / f"generate_{workers}.log")
            made.append(3600.0 * samples / used.wall_seconds)
            tell(f"round {number} of {rounds}, {workers} at work: {made[-1]:.0f} samples an hour")
    return Scaling(tuple(hourly[1]), tuple(hourly[2]), paired_ratio(hourly[2], hourly[1]))


def peak_memory(seconds: float, out: Path, core: int) -> int:
    """Most bytes held while making one certified sequence of so many seconds, from dressing to disk."""
    shutil.rmtree(out / "memory", ignore_errors=True)
    command: list[str | Path] = [MUSLIN_COMMAND, "simulate", SCENE, "--out", out / "memory"]
    command += ["--set", f"motion.end={seconds}", "--set", "expect={}"]
    return run(command, {core}, out / "memory.log").peak_bytes
