"""Tables of a benchmark: means over samples with intervals, and methods against each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

from muslin.eval.bench.outcome import Outcome
from muslin.eval.bench.protocol import GROUP, METHOD, METRIC, Table
from muslin.eval.metrics.bootstrap import Interval, Paired
from muslin.eval.page import number

BLANK = "–"


@dataclass(frozen=True)
class Cell:
    """A mean over the samples that all methods have; None where there is none.

    of   samples that the protocol names here: those that are lacking may have been hard ones
    """

    interval: Interval | None
    of: int

    @property
    def text(self) -> str:
        """Mean and interval, for people."""
        return BLANK if self.interval is None else interval_text(self.interval)

    @property
    def count(self) -> str:
        n = 0 if self.interval is None else self.interval.n
        return str(n) if n == self.of else f"{n} of {self.of}"


@dataclass(frozen=True)
class Filled:
    """A table with its values.

    row_names, column_names   what tells rows, and columns, apart
    rows, columns             values of them, as they are shown
    cells                     a row: a cell a column
    """

    title: str
    row_names: list[str]
    column_names: list[str]
    rows: list[tuple[str, ...]]
    columns: list[tuple[str, ...]]
    cells: list[list[Cell]]


@dataclass(frozen=True)
class Duel:
    """Two methods on the common samples of a group."""

    first: str
    second: str
    group: str
    metric: str
    found: Paired


def fill(outcome: Outcome, table: Table) -> Filled:
    """The means of a table. Rows and columns without a sample are left out."""
    values = {name: _values(outcome, table, name) for name in (*table.rows, *table.columns)}
    rows = [dict(zip(table.rows, key, strict=True)) for key in product(*(values[n] for n in table.rows))]
    columns = [
        dict(zip(table.columns, key, strict=True)) for key in product(*(values[n] for n in table.columns))
    ]
    rows = [row for row in rows if any(_ids(outcome, table, row | column) for column in columns)]
    columns = [column for column in columns if any(_ids(outcome, table, row | column) for row in rows)]
    return Filled(
        table.title,
        table.rows,
        table.columns,
        [tuple(shown(outcome, name, value) for name, value in row.items()) for row in rows],
        [tuple(shown(outcome, name, value) for name, value in column.items()) for column in columns],
        [[_cell(outcome, table, row | column) for column in columns] for row in rows],
    )


def duels(outcome: Outcome) -> list[Duel]:
    """Every two methods, in every group and metric that both have samples of."""
    found = []
    for first, second in combinations(outcome.methods, 2):
        for group, metric in product(outcome.protocol.groups, outcome.protocol.metrics):
            result = outcome.paired(first, second, outcome.groups[group.name], metric.figure)
            if result is not None:
                name = f"{metric.title}, off 1" if metric.better == "one" else metric.heading
                found.append(Duel(first, second, group.label, name, result))
    return found


def shown(outcome: Outcome, name: str, value: str) -> str:
    """What a method, group, metric or label's value is called in tables and figures."""
    if name == GROUP:
        return next(group.label for group in outcome.protocol.groups if group.name == value)
    if name == METRIC:
        return outcome.protocol.metric(value).heading
    return value or BLANK


def label_values(outcome: Outcome, ids: Sequence[str], label: str) -> list[str]:
    """Values of a label among samples, in the dataset's order."""
    return list(dict.fromkeys(outcome.entries[i].labels.get(label, "") for i in ids))


def interval_text(interval: Interval) -> str:
    """ "mean [low, high]" for people."""
    if interval.low is None:
        return number(interval.mean)
    return f"{number(interval.mean)} [{number(interval.low)}, {number(interval.high)}]"


def _values(outcome: Outcome, table: Table, name: str) -> list[str]:
    if name == METHOD:
        return list(outcome.methods)
    if name == GROUP:
        return list(table.groups or outcome.groups)
    if name == METRIC:
        return list(table.metrics)
    return label_values(outcome, outcome.chosen(table.groups), name)


def _ids(outcome: Outcome, table: Table, place: dict[str, str]) -> list[str]:
    groups = [place[GROUP]] if GROUP in place else table.groups
    labels = {key: value for key, value in place.items() if key not in (METHOD, GROUP, METRIC)}
    return outcome.chosen(groups, labels)


def _cell(outcome: Outcome, table: Table, place: dict[str, str]) -> Cell:
    ids = _ids(outcome, table, place)
    figure = place.get(METRIC, table.metrics[0])
    return Cell(outcome.mean(place[METHOD], ids, figure) if ids else None, len(ids))


def long_rows(filled: Filled) -> list[dict[str, Any]]:
    """One dict a cell: what its row and column are, mean, low, high, samples, samples named."""
    return [
        dict(zip(filled.row_names, row, strict=True))
        | dict(zip(filled.column_names, column, strict=True))
        | {
            "mean": cell.interval and cell.interval.mean,
            "low": cell.interval and cell.interval.low,
            "high": cell.interval and cell.interval.high,
            "samples": cell.interval.n if cell.interval else 0,
            "of": cell.of,
        }
        for row, cells in zip(filled.rows, filled.cells, strict=True)
        for column, cell in zip(filled.columns, cells, strict=True)
    ]


def duel_dict(duel: Duel) -> dict[str, Any]:
    """JSON values of a paired comparison."""
    found = duel.found
    return {
        "first": duel.first,
        "second": duel.second,
        "group": duel.group,
        "metric": duel.metric,
        "difference": found.difference.mean,
        "low": found.difference.low,
        "high": found.difference.high,
        "samples": found.difference.n,
        "first_better": found.first,
        "second_better": found.second,
        "equal": found.equal,
    }
