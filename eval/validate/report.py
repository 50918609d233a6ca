"""What the validation suite found, as one HTML page that needs nothing else, with its plots as PNG beside
it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from muslin.eval.page import column, duration, number, render_page, tile, write_atomically
from muslin.eval.validate.case import Row
from muslin.eval.validate.plots import plot_png, plot_svg
from muslin.eval.validate.runner import Finding, rows_of

COLUMNS = [
    column("row", text=True),
    column("measured"),
    column("known"),
    column("deviation"),
    column("bar"),
    column("unit", text=True),
    column("", text=True),
]


def validation_report(findings: Sequence[Finding], small: bool) -> str:
    """HTML: totals, then for each case its rows and plots."""
    rows = [row for finding in findings for row in rows_of(finding)]
    failed = sum(not row.passed for row in rows)
    return render_page(
        "validation.html.j2",
        title="muslin: validation",
        lead="The simulator against known solutions" + (", small size." if small else "."),
        tiles=[
            tile("cases", str(len(findings))),
            tile("rows", str(len(rows))),
            tile("rows that fail", str(failed), "bad" if failed else "good"),
            tile("computing time", duration(sum(finding.seconds for finding in findings))),
        ],
        columns=COLUMNS,
        cases=[_case(finding) for finding in findings],
    )


def write_report(folder: Path, findings: Sequence[Finding], small: bool) -> Path:
    """Write validation.html and one PNG a plot into a folder; returns the page's place. Raises InputError."""
    page = folder / "validation.html"
    write_atomically(page, validation_report(findings, small).encode())
    for finding in findings:
        for k, plot in enumerate(finding.outcome.plots):
            write_atomically(folder / f"{finding.name}-{k + 1}.png", plot_png(plot))
    return page


def _case(finding: Finding) -> dict[str, object]:
    return {
        "title": finding.title,
        "lead": f"muslin validate --case {finding.name}; {duration(finding.seconds)}.",
        "error": finding.error,
        "rows": [_cells(row) for row in rows_of(finding)],
        "plots": [{"svg": plot_svg(plot), "caption": plot.caption} for plot in finding.outcome.plots],
    }


def _cells(row: Row) -> list[str]:
    relative = row.kind == "relative"
    return [
        row.name,
        number(row.measured, 5),
        number(row.expected, 5),
        f"{100.0 * row.deviation:.2g} %" if relative else f"{row.deviation:.2g}",
        f"{100.0 * row.bar:g} %" if relative else f"{row.bar:g}",
        "" if row.unit == "1" else row.unit,
        "passes" if row.passed else "FAILS",
    ]
