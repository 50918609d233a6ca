"""A figure measured several times: its median, and how far it spreads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Spread:
    """Median, smallest and largest of some measurements."""

    median: float
    low: float
    high: float

    def text(self, digits: int = 2) -> str:
        """`median (low to high)`, or the one figure if they look the same."""
        shown = [f"{value:.{digits}f}" for value in (self.median, self.low, self.high)]
        return shown[0] if shown[1] == shown[2] else f"{shown[0]} ({shown[1]} to {shown[2]})"


def spread(values: Sequence[float]) -> Spread:
    """Spread of one or more measurements; ValueError without any."""
    if not values:
        raise ValueError("no measurements: run at least one round")
    return Spread(float(np.median(values)), float(min(values)), float(max(values)))


def paired_ratio(values: Sequence[float], reference: Sequence[float]) -> Spread:
    """Spread of value over reference, round by round.

    Rounds alternate, so what slows the machine for a while slows both of a pair.
    """
    if len(values) != len(reference):
        raise ValueError(f"{len(values)} rounds against {len(reference)}: give as many of both")
    return spread([value / base for value, base in zip(values, reference, strict=True)])


def exponent(sizes: Sequence[float], costs: Sequence[float]) -> float:
    """p of the power law cost = a size^p that fits best, by least squares of the logarithms."""
    if len(set(sizes)) < 2:
        raise ValueError(f"sizes = {list(sizes)}: an exponent needs two or more different ones")
    return float(np.polyfit(np.log(sizes), np.log(costs), 1)[0])
