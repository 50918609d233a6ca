"""What the engine costs over bare simulation: `muslin generate` beside processes that only simulate."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.isolated import ONE_THREAD
from benchmarks.spread import Spread, paired_ratio
from benchmarks.workers import DATASET, MUSLIN_COMMAND


@dataclass(frozen=True)
class Overhead:
    """Wall seconds of each round, bare and with the engine, and the spread of the second over the first."""

    samples: int
    bare: tuple[float, ...]
    engine: tuple[float, ...]
    ratio: Spread


def measure_overhead(
    chains: int, chain: int, edge_length: float, rounds: int, out: Path, tell: Callable[[str], None]
) -> Overhead:
    """Make the same drapes by two bare processes and by `muslin generate --workers 2`, turn by turn.

    The bare ones share out the chains beforehand, store nothing and check nothing but what the simulator does
    itself. Both begin with kernels in the cache and end when the last process has ended.
    """
    out.mkdir(parents=True, exist_ok=True)
    config = out / "engine.toml"
    samples = chains * chain
    config.write_text(DATASET.format(chain=chain, edge_length=edge_length, samples=samples), "utf-8")
    dataset = out / "dataset"
    bare = [[sys.executable, "-m", "benchmarks.engine", str(config), str(k), "2"] for k in range(2)]
    engine = [[str(MUSLIN_COMMAND), "generate", str(config), "--out", str(dataset), "--workers", "2"]]
    engine[0].append("--no-picture")
    seconds: dict[str, list[float]] = {"bare": [], "engine": []}
    for number in range(1, rounds + 1):
        for name, commands in (("bare", bare), ("engine", engine)):
            shutil.rmtree(dataset, ignore_errors=True)
            seconds[name].append(_together(commands, out / f"{name}.log"))
            tell(f"round {number} of {rounds}, {name}: {seconds[name][-1]:.1f} s")
    ratio = paired_ratio(seconds["engine"], seconds["bare"])
    return Overhead(samples, tuple(seconds["bare"]), tuple(seconds["engine"]), ratio)


def _together(commands: Sequence[Sequence[str]], log: Path) -> float:
    """Wall seconds until all commands, begun at once, have ended. RuntimeError if one fails."""
    alone = os.environ | ONE_THREAD
    with log.open("w", encoding="utf-8") as stream:
        begun = time.perf_counter()
        running = [subprocess.Popen(c, env=alone, stdout=stream, stderr=stream) for c in commands]
        codes = [process.wait() for process in running]
        seconds = time.perf_counter() - begun
    if any(codes):
        raise RuntimeError(f"{commands}: exit codes {codes}; see {log}")
    return seconds


def simulate_share(config: Path, share: int, shares: int) -> None:
    """Simulate every `shares`-th chain of a dataset, from the `share`-th, and keep nothing."""
    from muslin.sim.dataset.config import load_config
    from muslin.sim.dataset.plan import plan
    from muslin.sim.run import simulate_chain
    from muslin.sim.scene import parse_scene

    for chain in plan(load_config(config)).chains[share::shares]:
        for sample in simulate_chain([parse_scene(job.scene) for job in chain.jobs]):
            print(sample.num_vertices, flush=True)


if __name__ == "__main__":
    simulate_share(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
