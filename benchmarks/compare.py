"""All contenders on one setting, in alternating rounds, judged alike."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.contenders.catalogue import MUSLIN, Contender
from benchmarks.contenders.record import FRAMES_FILE, RECORD_FILE
from benchmarks.isolated import run
from benchmarks.judge import Verdict, judge
from benchmarks.setting import DT, load_setting
from benchmarks.spread import paired_ratio, spread

MEBIBYTE = 2**20


@dataclass
class Result:
    """What one contender did, a value a round: `rates` CPU seconds per simulated second; `peaks` bytes.

    `frame_peaks`: CPU seconds of the slowest frame. `verdict` is of the last round. `failure`: why it did not
    get through the setting, and then it is run no more.
    """

    contender: Contender
    rates: list[float] = field(default_factory=list)
    frame_peaks: list[float] = field(default_factory=list)
    peaks: list[int] = field(default_factory=list)
    versions: dict[str, str] = field(default_factory=dict)
    options: dict[str, object] = field(default_factory=dict)
    verdict: Verdict | None = None
    failure: str | None = None


def compare(
    setting_file: Path,
    contenders: Iterable[Contender],
    environments: Path,
    out: Path,
    frames: int | None,
    rounds: int,
    core: int,
    tell: Callable[[str], None],
) -> list[Result]:
    """Run every contender once a round, on one core; results in the order of `contenders`.

    RuntimeError if muslin, which the others are measured by, does not get through; a peer's failure is noted.
    """
    results = [Result(contender) for contender in contenders]
    setting = load_setting(setting_file, frames)
    for number in range(1, rounds + 1):
        for result in results:
            if result.failure is not None:
                continue
            name = result.contender.module
            folder = out / name
            command: list[str | Path] = [
                result.contender.interpreter(environments),
                "-m",
                f"benchmarks.contenders.{name}",
            ]
            command += [str(setting_file), str(folder), "--frames", str(setting.frames)]
            tell(f"round {number} of {rounds}: {result.contender.name}")
            try:
                used = run(command, {core}, out / f"{name}.log")
            except RuntimeError as error:
                if result.contender is MUSLIN:
                    raise
                result.failure = str(error)
                tell(f"  {error}")
                continue
            record = json.loads((folder / RECORD_FILE).read_text(encoding="utf-8"))
            result.rates.append(sum(record["seconds"]) / (len(record["seconds"]) * DT))
            result.frame_peaks.append(max(record["seconds"]))
            result.peaks.append(used.peak_bytes)
            result.versions, result.options = record["versions"], record["options"]
            tell(f"  {result.rates[-1]:.2f} CPU s per simulated second")
    for result in results:
        if result.failure is not None:
            continue
        result.verdict = judge(setting, np.load(out / result.contender.module / FRAMES_FILE))
    return results


def table(results: list[Result]) -> str:
    """The results in markdown, then what differs from contender to contender."""
    base = next(result for result in results if result.contender is MUSLIN).rates
    head = (
        "CPU s per simulated s",
        "over muslin",
        "slowest frame, s",
        "peak MiB",
        "frames that intersect",
        "intersections (cloth, body)",
        "largest stretch",
    )
    lines = [f"| | {' | '.join(head)} |", "| --- |" + " --- |" * len(head)]
    for result in results:
        verdict = result.verdict
        if verdict is None:
            lines.append(f"| {result.contender.name} | failed |" + " |" * (len(head) - 1))
            continue
        broken = f", {verdict.broken} not finite" if verdict.broken else ""
        cells = (
            spread(result.rates).text(),
            paired_ratio(result.rates, base).text(),
            spread(result.frame_peaks).text(),
            f"{max(result.peaks) / MEBIBYTE:.0f}",
            f"{verdict.intersecting} of {verdict.frames}{broken}",
            f"{verdict.cloth_cloth}, {verdict.cloth_body}",
            f"{verdict.largest_stretch:.2f}",
        )
        lines.append(f"| {result.contender.name} | {' | '.join(cells)} |")
    lines.append("")
    for result in results:
        lines += result.contender.footnote(result.versions, result.failure)
    return "\n".join(lines) + "\n"


def as_json(results: list[Result]) -> list[dict[str, object]]:
    """The results as plain values."""
    return [asdict(result) for result in results]
