"""Whether figures got worse than they were: a baseline of `muslin eval`, and the rows that fell behind it."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from muslin.eval.page import write_atomically
from muslin.garments.errors import InputError

FORMAT, FORMAT_VERSION = "muslin baseline", 1
TOLERANCE = 0.01
ROUNDING = 1e-6
"""Allowed beside the tolerance, in the figure's unit: what other machines round differently."""

ERRORS = re.compile(r"error|distance|hausdorff|penetration|intersection|inside|depth|contour")
"""Found in the paths of figures of which less is better,"""
NO_ERRORS = re.compile(r"(^|\.)truth|uncertain|coplanar")
"""unless this is found too: figures of the truth alone, and of how sure others are."""
NOT_FIGURES = {"prediction", "truth", "samples", "frames", "notes", "unmatched", "pairs", "origin"}


@dataclass(frozen=True)
class Measured:
    """Figures of a comparison and what they are of.

    figures   {dotted path: number, or None where it does not exist}
    origin    of `muslin.eval.provenance`: versions, metrics_version, dataset
    """

    figures: dict[str, float | None]
    samples: int
    frames: int
    origin: dict[str, Any]

    def to_json(self) -> str:
        values = {
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "origin": self.origin,
            "samples": self.samples,
            "frames": self.frames,
            "figures": self.figures,
        }
        return json.dumps(values, indent=1, allow_nan=False) + "\n"


@dataclass(frozen=True)
class Tolerances:
    """Relative tolerances: by path of a figure, or of a table for all below it; the longest path counts."""

    by_path: Mapping[str, float] = field(default_factory=dict)
    usual: float = TOLERANCE

    def of(self, figure: str) -> float:
        paths = [path for path in self.by_path if _below(figure, path)]
        return self.by_path[max(paths, key=len)] if paths else self.usual

    def name(self, figure: str) -> bool:
        """Whether a path names the figure, or a table that it is in."""
        return any(_below(figure, path) for path in self.by_path)


@dataclass(frozen=True)
class Row:
    """A figure that got worse. now: None if it does not exist any more; allowed: the bound that it broke."""

    figure: str
    baseline: float
    now: float | None
    allowed: float

    def __str__(self) -> str:
        before = f"{self.figure}: baseline {self.baseline:.5g}"
        if self.now is None:
            return f"{before}, now null"
        bound = "at most" if self.now > self.allowed else "at least"
        return f"{before}, now {self.now:.5g}, allowed {bound} {self.allowed:.5g}"


def measured(result: Mapping[str, Any]) -> Measured:
    """What a baseline keeps of `Comparison.to_dict()`."""
    figures = {key: value for key, value in result.items() if key not in NOT_FIGURES}
    return Measured(_flat(figures), result["samples"], result["frames"], result["origin"])


def regressions(baseline: Measured, now: Measured, tolerances: Tolerances | None = None) -> list[Row]:
    """Rows of the figures that got worse.

    An error e (a figure that `ERRORS` describes) may be at most e0 + r |e0| + 1e-6, with e0 of the baseline
    and its tolerance r; any other figure that a tolerance names must stay as near on both sides; the rest is
    not checked. A figure that the baseline has must still exist.

    Raises InputError where the two cannot be compared: another truth, another meaning of the metrics, other
    samples, figures that were not computed this time; and for a tolerance of a figure that there is not.
    """
    limits = tolerances or Tolerances()
    _check_comparable(baseline, now)
    _check_computed(baseline, now)
    for path in limits.by_path:
        if not any(_below(figure, path) for figure in (*baseline.figures, *now.figures)):
            raise InputError(f"tolerance of {path!r}: no such figure; choose from {', '.join(now.figures)}")
    rows = []
    for figure, before in baseline.figures.items():
        error = is_error(figure)
        if before is None or not (error or limits.name(figure)):
            continue
        after, room = now.figures.get(figure), limits.of(figure) * abs(before) + ROUNDING
        if after is None or after > before + room:
            rows.append(Row(figure, before, after, before + room))
        elif not error and after < before - room:
            rows.append(Row(figure, before, after, before - room))
    return rows


def is_error(figure: str) -> bool:
    """Whether less of a figure is better, by its path."""
    return ERRORS.search(figure) is not None and NO_ERRORS.search(figure) is None


def parse_tolerances(given: Sequence[str]) -> Tolerances:
    """Tolerances of entries "PATH=REL", or "REL" for all others. Raises InputError for another form."""
    by_path: dict[str, float] = {}
    usual = TOLERANCE
    for entry in given:
        path, _, text = entry.rpartition("=")
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and value >= 0) or (path == "" and "=" in entry):
            raise InputError(
                f"--tolerance {entry!r}: must be PATH=REL or REL, REL a number from 0, for example "
                "vertex_error_mm.mean=0.02"
            )
        if path:
            by_path[path] = value
        else:
            usual = value
    return Tolerances(by_path, usual)


def write_baseline(path: Path, found: Measured) -> None:
    """Write a baseline, replacing the last. Raises InputError where it cannot be written."""
    write_atomically(path, found.to_json().encode())


def read_baseline(path: Path) -> Measured:
    """Raises InputError for what is no baseline, or one of a newer program."""
    remedy = "write it with `muslin eval … --write-baseline`"
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: not readable as JSON ({error}); {remedy}") from error
    if not isinstance(values, dict) or values.get("format") != FORMAT:
        raise InputError(f"{path}: no baseline, its format must be {FORMAT!r}; {remedy}")
    if values.get("format_version") != FORMAT_VERSION:
        raise InputError(
            f"{path}: format_version = {values.get('format_version')} is not {FORMAT_VERSION}, which this "
            f"program reads; {remedy}"
        )
    try:
        return Measured(
            dict(values["figures"]), int(values["samples"]), int(values["frames"]), dict(values["origin"])
        )
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: lacks a valid {error}; {remedy}") from error


def _check_comparable(baseline: Measured, now: Measured) -> None:
    before, after = baseline.origin.get("metrics_version"), now.origin.get("metrics_version")
    if before != after:
        raise InputError(
            f"the baseline's figures are of metrics version {before}, these of {after}: they mean different "
            "things; write the baseline again"
        )
    if baseline.origin.get("dataset") != now.origin.get("dataset"):
        raise InputError(
            f"the baseline was made with another truth (content {str(baseline.origin.get('dataset'))[:12]}…, "
            f"now {str(now.origin.get('dataset'))[:12]}…); give that truth, or write the baseline again"
        )
    for what in ("samples", "frames"):
        old, new = getattr(baseline, what), getattr(now, what)
        if old != new:
            raise InputError(
                f"the baseline is of {old} {what}, this comparison of {new}: means over different sets; "
                "predict the same samples, or write the baseline again"
            )


def _check_computed(baseline: Measured, now: Measured) -> None:
    """A figure that does not exist is null, or its table is; one that is not there was not asked for."""
    for figure in baseline.figures:
        if not any(_below(figure, path) or _below(path, figure) for path in now.figures):
            raise InputError(
                f"the baseline has {figure}, which was not computed now; give the --metrics that it was made "
                "with, or write the baseline again"
            )


def _below(figure: str, path: str) -> bool:
    return figure == path or figure.startswith(f"{path}.")


def _flat(values: Mapping[str, Any], prefix: str = "") -> dict[str, float | None]:
    found: dict[str, float | None] = {}
    for name, value in values.items():
        if isinstance(value, Mapping):
            found |= _flat(value, f"{prefix}{name}.")
        elif value is None:
            found[prefix + name] = None
        elif isinstance(value, int | float) and not isinstance(value, bool):
            found[prefix + name] = float(value)
    return found
