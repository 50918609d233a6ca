"""Everything that a benchmark shows, computed once: drawing thousands of resamples takes its time."""

from __future__ import annotations

from dataclasses import dataclass

from muslin.eval.bench.curves import Plot, plots
from muslin.eval.bench.outcome import Outcome
from muslin.eval.bench.tables import Duel, Filled, duels, fill


@dataclass(frozen=True)
class Findings:
    """Tables and plots in the order of the protocol, and every two methods against each other."""

    tables: list[Filled]
    plots: list[Plot]
    duels: list[Duel]


def findings(outcome: Outcome) -> Findings:
    """Raises InputError for a figure that cannot be drawn."""
    protocol = outcome.protocol
    return Findings(
        [fill(outcome, table) for table in protocol.tables],
        [plot for figure in protocol.figures for plot in plots(outcome, figure)],
        duels(outcome),
    )
