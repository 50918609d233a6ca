"""Runs cases one after the other and writes what they found."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from muslin.eval.page import write_atomically
from muslin.eval.validate.case import Outcome, Row
from muslin.eval.validate.catalogue import CASES
from muslin.eval.validate.load import LoadedCase
from muslin.sim.device import open_device
from muslin.sim.solve.errors import SimulationError


@dataclass(frozen=True)
class Finding:
    """A case, what it found and the seconds it took; `error` where it could not be simulated to its end."""

    name: str
    title: str
    outcome: Outcome
    seconds: float
    error: str = ""

    @property
    def passed(self) -> bool:
        """Whether it ran to its end, has rows, and all of them pass."""
        return not self.error and bool(self.outcome.rows) and all(row.passed for row in self.outcome.rows)


def run_cases(
    cases: Sequence[LoadedCase], progress: Callable[[float, int, str], None] | None = None
) -> Iterator[Finding]:
    """Run cases in order. One that the simulator cannot go on with is a failure, not the end of the
    others."""
    open_device("cpu")
    for done, case in enumerate(cases):
        if progress is not None:
            progress(done, len(cases), case.name)
        started = time.perf_counter()
        try:
            outcome, error = CASES[case.name].run(case.table), ""
        except SimulationError as stop:
            outcome, error = Outcome(), " ".join(str(stop).split())
        seconds = time.perf_counter() - started
        yield Finding(case.name, case.table.title, outcome, seconds, error)


def rows_of(finding: Finding) -> list[Row]:
    """The rows; a case that did not run to its end has one that fails."""
    if finding.error:
        return [*finding.outcome.rows, Row(f"{finding.name}: runs to its end", 0.0, 1.0, 0.0, "absolute")]
    return finding.outcome.rows


def write_json(path: Path, findings: Sequence[Finding], small: bool) -> None:
    """Write {"rows": [...]} with versions and times beside it. Raises InputError where it cannot be
    written."""
    result = {
        "rows": [{"case": finding.name, **row.as_dict()} for finding in findings for row in rows_of(finding)],
        "small": small,
        "seconds": {finding.name: finding.seconds for finding in findings},
        "errors": {finding.name: finding.error for finding in findings if finding.error},
        "versions": {name: version(name) for name in ("muslin", "warp-lang", "numpy", "scipy", "ipctk")},
    }
    write_atomically(path, json.dumps(result, indent=1).encode())
