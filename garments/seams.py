"""Seams: pairs of panel edges that are sewn together."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class EdgeRef:
    """An edge of a panel, by names."""

    panel: str
    edge: str

    def __str__(self) -> str:
        return f"{self.panel}.{self.edge}"


@dataclass(frozen=True)
class Seam:
    """Two panel edges of equal length, sewn together, equal arc length to equal arc length.

    Both panels are drawn counter-clockwise as seen from outside, so the two edges run in opposite directions:
    the point at fraction s of `first` meets the point at fraction 1 - s of `second`.
    """

    first: EdgeRef
    second: EdgeRef
