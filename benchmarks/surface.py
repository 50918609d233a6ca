"""Certified surface distances beside PyMeshLab's sampled ones, to the same accuracy of the mean."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.contenders.catalogue import Contender
from benchmarks.isolated import run
from benchmarks.spread import paired_ratio, spread
from benchmarks.surfaces.exchange import RECORD_FILE, SAMPLES_FILE, Pair

ACCURACY = 1e-3
MUSLIN = Contender(
    "muslin",
    "with_muslin",
    None,
    "libigl",
    "Hausdorff bounds at most 0.1% apart; points until the standard error of the mean is at most 0.1% of it. "
    "From arrays to figures, trees included.",
)
PYMESHLAB = Contender(
    "PyMeshLab",
    "with_pymeshlab",
    "meshes",
    "pymeshlab",
    "`get_hausdorff_distance` both ways, `maxdist` 100%. Its points are independent, so n a side give the "
    "mean a standard error of sqrt((var_ab + var_ba) / (4 n)); n is what makes that 0.1%, with the variances "
    "of the distance that muslin found. Its largest distance is that of those points and of all "
    "vertices; nothing tells it how far that is from the true one.",
)


@dataclass
class Result:
    """Seconds of each pair, a value a round, and the figures of the last round."""

    seconds: dict[str, list[float]] = field(default_factory=dict)
    figures: dict[str, dict[str, float]] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)


def compare(
    pairs: dict[str, Pair],
    environments: Path,
    out: Path,
    rounds: int,
    core: int,
    tell: Callable[[str], None],
) -> dict[str, Result]:
    """Both packages on all pairs, turn by turn on one core; results by the names of the packages."""
    folder = out / "pairs"
    shutil.rmtree(folder, ignore_errors=True)
    for name, pair in pairs.items():
        pair.save(folder / f"{name}.npz")
    results = {one.name: Result() for one in (MUSLIN, PYMESHLAB)}
    for number in range(1, rounds + 1):
        for one in (MUSLIN, PYMESHLAB):
            command: list[str | Path] = [
                one.interpreter(environments),
                "-m",
                f"benchmarks.surfaces.{one.module}",
            ]
            run([*command, folder, out / one.module], {core}, out / f"{one.module}.log")
            record = json.loads((out / one.module / RECORD_FILE).read_text(encoding="utf-8"))
            result = results[one.name]
            for name, seconds in record["seconds"].items():
                result.seconds.setdefault(name, []).append(seconds)
            result.figures, result.versions = record["figures"], record["versions"]
            tell(f"round {number} of {rounds}: {one.name}, {sum(record['seconds'].values()):.1f} CPU s")
            if one is MUSLIN:
                counts = {name: samples_for(figures) for name, figures in result.figures.items()}
                (folder / SAMPLES_FILE).write_text(json.dumps(counts), encoding="utf-8")
    return results


def samples_for(figures: dict[str, float]) -> int:
    """Independent points a side with which the standard error of the mean is `ACCURACY` of it."""
    return round(figures["variance"] / (ACCURACY * figures["mean"]) ** 2)


def table(results: dict[str, Result]) -> str:
    """The results in markdown, a pair a line, then how each package was asked."""
    head = (
        "Hausdorff, mm: between",
        "mean, mm",
        "its standard error, %",
        "muslin, CPU s",
        "PyMeshLab: points a side",
        "its mean, mm",
        "its largest, below the true one by at least",
        "PyMeshLab, CPU s",
        "over muslin",
    )
    lines = [f"| pair | {' | '.join(head)} |", "| --- |" + " --- |" * len(head)]
    ours, theirs = results[MUSLIN.name], results[PYMESHLAB.name]
    for name, found in ours.figures.items():
        other = theirs.figures[name]
        cells = [
            f"{1e3 * found['lower']:.4f} and {1e3 * found['upper']:.4f}",
            f"{1e3 * found['mean']:.5f}",
            f"{100.0 * found['mean_error'] / found['mean']:.3f}",
            spread(ours.seconds[name]).text(1),
            f"{other['samples']:,.0f}",
            f"{1e3 * other['mean']:.5f}",
            f"{100.0 * max(0.0, 1.0 - other['lower'] / found['lower']):.2f}%",
            spread(theirs.seconds[name]).text(1),
            paired_ratio(theirs.seconds[name], ours.seconds[name]).text(1),
        ]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    lines.append("")
    for one in (MUSLIN, PYMESHLAB):
        lines += one.footnote(results[one.name].versions, None)
    return "\n".join(lines) + "\n"
