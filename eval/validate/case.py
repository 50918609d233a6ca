"""What a case of the validation suite is made of: parameters, rows with bars, curves to draw."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from pydantic import Field

from muslin.sim.tables import Table

Count = Annotated[int, Field(ge=1)]


class CaseTable(Table):
    """Parameters of a case, as its file in scenes/validation/ holds them; SI units, bars without a unit are
    shares of the expected value."""

    title: str
    seed: Annotated[int, Field(ge=0)] = 0


@dataclass(frozen=True)
class Row:
    """One figure against the one it should be.

    `bar`: the deviation allowed, as a share of |expected| (`kind` "relative") or in `unit` ("absolute").
    """

    name: str
    measured: float
    expected: float
    bar: float
    kind: Literal["relative", "absolute"] = "relative"
    unit: str = "1"

    @property
    def deviation(self) -> float:
        """|measured - expected|, divided by |expected| where the bar is relative."""
        difference = abs(self.measured - self.expected)
        return difference / abs(self.expected) if self.kind == "relative" else difference

    @property
    def passed(self) -> bool:
        """Whether the deviation is within the bar; never where a figure is not a number."""
        return bool(self.deviation <= self.bar)

    def as_dict(self) -> dict[str, Any]:
        """The row as JSON holds it."""
        return {
            "name": self.name,
            "measured": float(self.measured),
            "expected": float(self.expected),
            "bar": float(self.bar),
            "passed": self.passed,
            "kind": self.kind,
            "unit": self.unit,
        }


@dataclass(frozen=True)
class Series:
    """A curve of known values ("line") or simulated ones ("points")."""

    name: str
    x: Sequence[float]
    y: Sequence[float]
    style: Literal["line", "points"] = "line"


@dataclass(frozen=True)
class Plot:
    """Curves in one pair of axes; `same_scale` where both are lengths in space."""

    caption: str
    x_label: str
    y_label: str
    series: Sequence[Series]
    log_x: bool = False
    log_y: bool = False
    same_scale: bool = False


@dataclass
class Outcome:
    """What a case found."""

    rows: list[Row] = field(default_factory=list)
    plots: list[Plot] = field(default_factory=list)


@dataclass(frozen=True)
class Case:
    """A case: the model of its file and the function that simulates and measures."""

    table: type[CaseTable]
    run: Callable[[Any], Outcome]
