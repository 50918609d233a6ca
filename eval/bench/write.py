"""What a benchmark leaves in a folder: results.json, tables and figures for papers, the page."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from muslin.eval.bench.curves import long_points, plot_dict
from muslin.eval.bench.draw import plot_png, plot_svg_file
from muslin.eval.bench.findings import Findings
from muslin.eval.bench.outcome import Outcome
from muslin.eval.bench.tables import Cell, Duel, Filled, duel_dict, interval_text, long_rows
from muslin.eval.page import write_atomically

FORMAT, FORMAT_VERSION = "muslin benchmark", 1
PLACES = ("x", "mean", "low", "high", "samples", "of")


def write_outcome(outcome: Outcome, found: Findings, folder: Path) -> list[Path]:
    """Write results.json, tables/*.md and *.csv, figures/*.svg, *.png and *.csv; returns what was written."""
    files: dict[Path, bytes] = {folder / "results.json": results_json(outcome, found)}
    for name, table in zip(_file_names([table.title for table in found.tables]), found.tables, strict=True):
        files[folder / "tables" / f"{name}.md"] = markdown(table).encode()
        files[folder / "tables" / f"{name}.csv"] = csv_bytes(long_rows(table))
    if found.duels:
        files[folder / "tables" / "paired.md"] = duels_markdown(found.duels).encode()
        files[folder / "tables" / "paired.csv"] = csv_bytes([duel_dict(duel) for duel in found.duels])
    for name, plot in zip(_file_names([plot.title for plot in found.plots]), found.plots, strict=True):
        files[folder / "figures" / f"{name}.svg"] = plot_svg_file(plot)
        files[folder / "figures" / f"{name}.png"] = plot_png(plot)
        files[folder / "figures" / f"{name}.csv"] = csv_bytes(long_points(plot))
    for path, data in files.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, data)
    return list(files)


def results_json(outcome: Outcome, found: Findings) -> bytes:
    """Everything that was found, each sample's figures of each method too."""
    values = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "protocol": outcome.protocol.model_dump(mode="json"),
        "origin": outcome.origin,
        "dataset": str(outcome.truth),
        "seconds": round(outcome.seconds, 3),
        "methods": {name: _method(outcome, name) for name in outcome.methods},
        "groups": {
            name: {"samples": ids, "compared": outcome.common(ids)} for name, ids in outcome.groups.items()
        },
        "tables": [{"title": table.title, "cells": long_rows(table)} for table in found.tables],
        "paired": [duel_dict(duel) for duel in found.duels],
        "figures": [plot_dict(plot) for plot in found.plots],
        "samples": [_sample(outcome, i) for i in outcome.entries],
    }
    return (json.dumps(values, indent=1, allow_nan=False) + "\n").encode()


def _method(outcome: Outcome, name: str) -> dict[str, Any]:
    method = outcome.methods[name]
    return {
        "path": str(method.path),
        "scored": sum(outcome.score(name, i) is not None for i in outcome.entries),
        "missing": outcome.missing(name),
        "refused": outcome.refused(name),
        "cost": None if method.cost is None else asdict(method.cost),
    }


def _sample(outcome: Outcome, sample: str) -> dict[str, Any]:
    found = {name: score for name in outcome.methods if (score := outcome.score(name, sample)) is not None}
    beta = next((list(score.beta) for score in found.values()), [])
    return {
        "id": sample,
        "labels": outcome.entries[sample].labels,
        "beta": beta,
        "figures": {name: score.figures for name, score in found.items()},
        "frames": {name: score.frames for name, score in found.items()},
        "notes": {name: list(score.notes) for name, score in found.items() if score.notes},
    }


def markdown(table: Filled) -> str:
    """A table as Markdown; how many samples each mean is over stands in a column, or where they differ in the
    cells."""
    heads = [", ".join(column) for column in table.columns]
    uniform = all(len({cell.count for cell in cells}) == 1 for cells in table.cells)
    lines = [[*table.row_names, *heads, *(["samples"] if uniform else [])]]
    for row, cells in zip(table.rows, table.cells, strict=True):
        texts = [cell_text(cell, uniform) for cell in cells]
        lines.append([*row, *texts, *([cells[0].count] if uniform else [])])
    return f"### {table.title}\n\n{_markdown(lines, len(table.row_names))}"


def cell_text(cell: Cell, uniform: bool) -> str:
    """A cell, with its number of samples where cells of a row differ in it."""
    return cell.text if uniform or cell.interval is None else f"{cell.text} (n = {cell.count})"


DUEL_HEADS = [
    "",
    "group",
    "metric",
    "difference of means",
    "samples",
    "first better",
    "second better",
    "equal",
]


def duel_row(duel: Duel) -> list[str]:
    """A paired comparison for people."""
    found = duel.found
    return [
        f"{duel.first} − {duel.second}",
        duel.group,
        duel.metric,
        interval_text(found.difference) + (" *" if found.decided else ""),
        str(found.difference.n),
        str(found.first),
        str(found.second),
        str(found.equal),
    ]


def duels_markdown(against: Sequence[Duel]) -> str:
    """Paired comparisons as Markdown."""
    rows = _markdown([DUEL_HEADS, *map(duel_row, against)], 3)
    return f"### Methods against each other, sample by sample\n\n{rows}\n\\* the interval leaves out zero\n"


def _markdown(rows: Sequence[Sequence[str]], left: int) -> str:
    """Lines of a table whose first row is its head and whose first columns are text."""
    head, *body = [[text.replace("|", "\\|") for text in row] for row in rows]
    rule = [":--" if k < left else "--:" for k in range(len(head))]
    return "".join(f"| {' | '.join(row)} |\n" for row in (head, rule, *body))


def csv_bytes(rows: Sequence[dict[str, Any]]) -> bytes:
    """Dicts of the same keys as CSV; None is an empty field."""
    stream = io.StringIO()
    writer = csv.DictWriter(stream, fieldnames=list(rows[0]) if rows else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue().encode()


def _file_names(titles: Sequence[str]) -> list[str]:
    """A name for each title, of letters, digits and hyphens; equal ones get numbers."""
    names: list[str] = []
    for title in titles:
        name = re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")[:80] or "untitled"
        tries = [name, *(f"{name}-{k}" for k in range(2, len(titles) + 2))]
        names.append(next(one for one in tries if one not in names))
    return names
