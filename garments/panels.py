"""Panels: flat pieces of cloth bounded by a closed loop of named curves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from muslin.garments.curves import CubicBezier, Curve
from muslin.garments.errors import InputError

CLOSURE_TOLERANCE = 1e-9  # metres between the end of an edge and the start of the next
_OUTLINE_POINTS = 24  # points a curved edge in the self-crossing test and in pictures


@dataclass(frozen=True)
class PanelEdge:
    """A named piece of a panel's boundary."""

    name: str
    curve: Curve


@dataclass(frozen=True)
class Panel:
    """A flat piece of cloth, drawn as seen from outside the garment, warp (grain) along +y, metres.

    edges: the boundary as a closed loop, counter-clockwise; each edge starts where the one before it ends.
    """

    name: str
    edges: tuple[PanelEdge, ...]

    def edge(self, name: str) -> PanelEdge:
        """The edge of that name; InputError if the panel has none."""
        for edge in self.edges:
            if edge.name == name:
                return edge
        names = ", ".join(e.name for e in self.edges)
        raise InputError(f"panel '{self.name}' has no edge '{name}'; its edges are: {names}")

    @property
    def area(self) -> float:
        """Area, square metres; positive for a counter-clockwise boundary (Green's theorem)."""
        return sum(edge.curve.signed_area for edge in self.edges)

    def outline(self) -> NDArray[np.float64]:
        """Polygon (N, 2) that follows the boundary, metres; the first point is not repeated."""
        parts = []
        for edge in self.edges:
            count = _OUTLINE_POINTS if isinstance(edge.curve, CubicBezier) else 1
            parts.append(edge.curve.at(np.arange(count) / count))
        return np.concatenate(parts)

    def validate(self) -> None:
        """InputError unless the boundary is finite, closed, counter-clockwise and free of self-crossings."""
        if len(self.edges) < 2:
            raise InputError(f"panel '{self.name}' has {len(self.edges)} edges; a panel needs at least 2")
        names = [edge.name for edge in self.edges]
        repeated = sorted({name for name in names if names.count(name) > 1})
        if repeated:
            raise InputError(f"panel '{self.name}' names edge '{repeated[0]}' twice; edge names must differ")
        for edge, following in zip(self.edges, self.edges[1:] + self.edges[:1], strict=True):
            where = f"panel '{self.name}', edge '{edge.name}'"
            if not np.isfinite(edge.curve.control_points).all():
                raise InputError(
                    f"{where}: a point is NaN or infinite; all coordinates must be finite metres"
                )
            if edge.curve.length <= CLOSURE_TOLERANCE:
                raise InputError(f"{where}: length {edge.curve.length:g} m; it must be greater than zero")
            gap = float(np.hypot(*np.subtract(edge.curve.end, following.curve.start)))
            if not gap <= CLOSURE_TOLERANCE:
                raise InputError(
                    f"{where} ends {gap:g} m from the start of '{following.name}'; "
                    f"the boundary must be closed to {CLOSURE_TOLERANCE:g} m"
                )
        if self.area <= 0.0:
            raise InputError(
                f"panel '{self.name}' has signed area {self.area:g} m^2; list its edges counter-clockwise"
            )
        crossing = _first_crossing(self.outline())
        if crossing is not None:
            raise InputError(
                f"panel '{self.name}' crosses itself near ({crossing[0]:.4f}, {crossing[1]:.4f}) m; "
                "the boundary must be a simple curve"
            )


def _first_crossing(polygon: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Start of the first segment that properly crosses another segment of the closed polygon, or None."""
    a, b = polygon, np.roll(polygon, -1, axis=0)

    def side(p: NDArray[np.float64], q: NDArray[np.float64], r: NDArray[np.float64]) -> NDArray[np.float64]:
        return (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (
            r[..., 0] - p[..., 0]
        )

    i, j = a[:, None], b[:, None]
    crosses = (side(i, j, a[None]) * side(i, j, b[None]) < 0) & (
        side(a[None], b[None], i) * side(a[None], b[None], j) < 0
    )
    hits = np.argwhere(crosses)
    return polygon[hits[0, 0]] if len(hits) else None
