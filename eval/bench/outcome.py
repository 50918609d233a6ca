"""What a benchmark found: scores of every method, and the samples on which methods may be compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from muslin.eval.bench.methods import Method
from muslin.eval.bench.protocol import Protocol
from muslin.eval.bench.score import Score, figure_value
from muslin.eval.bench.select import Entry
from muslin.eval.metrics.bootstrap import Interval, Paired, mean_interval, paired


@dataclass(frozen=True, eq=False)
class Outcome:
    """Scores of methods on the samples of a protocol.

    entries   {id: sample} of every sample that is scored, in the dataset's order
    groups    {name: ids of its samples}
    scores    {(method, id): score}, without those that a method has no prediction of
    origin    versions and hashes
    """

    protocol: Protocol
    truth: Path
    entries: dict[str, Entry]
    groups: dict[str, list[str]]
    methods: dict[str, Method]
    scores: dict[tuple[str, str], Score]
    origin: dict[str, Any]
    seconds: float

    def missing(self, method: str) -> list[str]:
        """Samples of which the method has no prediction."""
        return [i for i in self.entries if (method, i) not in self.scores]

    def refused(self, method: str) -> dict[str, str]:
        """{id: why} of predictions that cannot be scored."""
        found = ((i, self.scores.get((method, i))) for i in self.entries)
        return {i: score.refused for i, score in found if score is not None and score.refused}

    def score(self, method: str, sample: str) -> Score | None:
        """The score of a prediction; None where it is missing or refused."""
        found = self.scores.get((method, sample))
        return None if found is None or found.refused else found

    def value(self, method: str, sample: str, figure: str) -> float | None:
        """A figure of a prediction; None where it is missing, refused, or has no such figure."""
        found = self.score(method, sample)
        return None if found is None else figure_value(found.figures, figure)

    def chosen(self, groups: Sequence[str] = (), labels: dict[str, str] | None = None) -> list[str]:
        """Ids of the samples of some groups (all without a name) with these labels."""
        inside = {i for name in groups or self.groups for i in self.groups[name]}
        wanted = labels or {}
        return [
            i
            for i, entry in self.entries.items()
            if i in inside and all(entry.labels.get(key, "") == value for key, value in wanted.items())
        ]

    def common(self, ids: Sequence[str], figure: str | None = None) -> list[str]:
        """Those of the samples that every method has a score of, with the figure if one is named."""
        if figure is None:
            return [i for i in ids if all(self.score(method, i) for method in self.methods)]
        return [i for i in ids if all(self.value(method, i, figure) is not None for method in self.methods)]

    def values(self, method: str, ids: Sequence[str], figure: str) -> list[float]:
        """The figure of each sample; all must have it."""
        found = [self.value(method, i, figure) for i in ids]
        return [value for value in found if value is not None]

    def mean(self, method: str, ids: Sequence[str], figure: str) -> Interval | None:
        """Mean over those of the samples that every method has the figure of; None if there is none."""
        same = self.common(ids, figure)
        if not same:
            return None
        return mean_interval(self.values(method, same, figure), self.clusters(same), **self._options())

    def paired(self, first: str, second: str, ids: Sequence[str], figure: str) -> Paired | None:
        """Two methods on the samples that every method has the figure of; None if there is none.

        Of a metric that is best at one, it is the distances from one that are compared.
        """
        same, metric = self.common(ids, figure), self.protocol.metric(figure)
        if not same:
            return None
        a, b = self.values(first, same, figure), self.values(second, same, figure)
        if metric.better == "one":
            a, b = [metric.loss(value) for value in a], [metric.loss(value) for value in b]
        lower = metric.better != "higher"
        return paired(a, b, self.clusters(same), lower_is_better=lower, **self._options())

    def clusters(self, ids: Sequence[str]) -> list[str] | None:
        """What is drawn together in the bootstrap; None draws sample by sample."""
        label = self.protocol.bootstrap.cluster
        return None if label is None else [self.entries[i].identity(label) for i in ids]

    def _options(self) -> dict[str, Any]:
        return self.protocol.bootstrap.model_dump(include={"confidence", "resamples", "seed"})
