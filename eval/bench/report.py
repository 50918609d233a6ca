"""A benchmark as one HTML page that needs nothing else."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from muslin.eval.bench.draw import plot_svg
from muslin.eval.bench.findings import Findings
from muslin.eval.bench.outcome import Outcome
from muslin.eval.bench.scenes import scenes
from muslin.eval.bench.tables import BLANK, Filled
from muslin.eval.bench.write import DUEL_HEADS, cell_text, duel_row
from muslin.eval.cost import Cost
from muslin.eval.page import column, duration, number, render_page, tile
from muslin.eval.viewer.page import viewer

NAMED = 12  # most samples that a note names


def bench_report(outcome: Outcome, found: Findings) -> str:
    """HTML: who was scored on how much, tables, figures, methods against each other, a player of samples."""
    protocol = outcome.protocol
    compared, scored = len(outcome.common(list(outcome.entries))), len(outcome.entries)
    shown = scenes(outcome)
    return render_page(
        "bench.html.j2",
        title=f"muslin: {protocol.title}",
        heading=protocol.title,
        source=protocol.source,
        truth=str(outcome.truth),
        tiles=[
            tile("methods", str(len(outcome.methods))),
            tile("samples of the protocol", str(scored)),
            tile("samples compared", str(compared), "" if compared == scored else "bad"),
            tile("computing time", duration(outcome.seconds)),
        ],
        notes=_notes(outcome),
        method_columns=_method_columns(outcome),
        method_rows=[_method_row(outcome, name) for name in outcome.methods],
        tables=[_table(table) for table in found.tables],
        interval=f"{100 * protocol.bootstrap.confidence:g}%",
        plots=[{"svg": plot_svg(plot), "caption": plot.title} for plot in found.plots],
        duel_columns=[column(name, text=k < 3) for k, name in enumerate(DUEL_HEADS)],
        duel_rows=[duel_row(duel) for duel in found.duels],
        viewer=viewer(shown) if shown else None,
        origin=_origin(outcome.origin),
    )


def _costs(outcome: Outcome) -> bool:
    return any(method.cost is not None for method in outcome.methods.values())


def _method_columns(outcome: Outcome) -> list[dict[str, Any]]:
    columns = [column("method", text=True), column("folder", text=True)]
    columns += [column(name) for name in ("scored", "missing", "refused")]
    costs = ("ms a frame", "parameters", "model, MB", "on") if _costs(outcome) else ()
    return columns + [column(name, text=name == "on") for name in costs]


def _method_row(outcome: Outcome, name: str) -> list[str]:
    method, missing, refused = outcome.methods[name], outcome.missing(name), outcome.refused(name)
    scored = len(outcome.entries) - len(missing) - len(refused)
    row = [name, str(method.path), str(scored), str(len(missing)), str(len(refused))]
    if not _costs(outcome):
        return row
    cost = method.cost or Cost()
    megabytes = None if cost.file_bytes is None else cost.file_bytes / 1e6
    parameters = BLANK if cost.parameters is None else f"{cost.parameters:,}"
    return [*row, number(cost.milliseconds_per_frame), parameters, number(megabytes), cost.device or BLANK]


def _notes(outcome: Outcome) -> list[str]:
    notes = []
    for name in outcome.methods:
        if missing := outcome.missing(name):
            notes.append(f"{name} lacks {len(missing)} samples: {_some(missing)}")
        for sample, reason in list(outcome.refused(name).items())[:NAMED]:
            notes.append(f"{name}, {sample}: not scored: {reason}")
    if notes:
        notes.append("every mean and comparison is over the samples that all methods have a score of")
    said = Counter(note for score in outcome.scores.values() for note in score.notes)
    of = len(outcome.scores)
    return notes + [note if n == of else f"{note} ({n} of {of} predictions)" for note, n in said.items()]


def _some(ids: Sequence[str]) -> str:
    return ", ".join(ids[:NAMED]) + (" …" if len(ids) > NAMED else "")


def _table(filled: Filled) -> dict[str, Any]:
    uniform = all(len({cell.count for cell in cells}) == 1 for cells in filled.cells)
    columns = [column(name, text=True) for name in filled.row_names]
    columns += [column(", ".join(names)) for names in filled.columns]
    columns += [column("samples")] if uniform else []
    rows = []
    for row, cells in zip(filled.rows, filled.cells, strict=True):
        texts = [cell_text(cell, uniform) for cell in cells]
        rows.append([*row, *texts, *([cells[0].count] if uniform else [])])
    return {"title": filled.title, "columns": columns, "rows": rows}


def _origin(origin: dict[str, Any]) -> str:
    lines = [f"{name} {version}" for name, version in origin["versions"].items()]
    lines += [f"metrics version {origin['metrics_version']}"]
    lines += [f"dataset {origin['dataset']}", f"protocol {origin['protocol']}"]
    return "\n".join(lines)
