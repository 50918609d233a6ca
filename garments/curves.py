"""Plane curves that bound panels: straight lines and cubic Bezier curves, sampled by arc length."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

Point = tuple[float, float]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
_PIECES = (
    32  # sub-intervals of a Bezier curve; with 12-point Gauss quadrature exact to rounding unless near a cusp
)
_NEWTON_STEPS = 8


@dataclass(frozen=True)
class Line:
    """Straight curve x(t) = (1 - t) start + t end, t in [0, 1]. Points in metres."""

    start: Point
    end: Point

    @property
    def control_points(self) -> NDArray[np.float64]:
        """(2, 2) start and end, metres."""
        return np.array([self.start, self.end], dtype=np.float64)

    @cached_property
    def length(self) -> float:
        """Arc length, metres."""
        return float(np.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]))

    def at(self, t: ArrayLike) -> NDArray[np.float64]:
        """Points (..., 2) at curve parameters t (...)."""
        t = np.asarray(t, dtype=np.float64)[..., None]
        return (1.0 - t) * np.asarray(self.start) + t * np.asarray(self.end)

    def at_fraction(self, fraction: ArrayLike) -> NDArray[np.float64]:
        """Points (..., 2) that lie at the given fractions (...) of the arc length."""
        return self.at(fraction)

    @property
    def signed_area(self) -> float:
        """Integral of (x dy - y dx) / 2 along the curve, square metres (Green's theorem)."""
        return 0.5 * (self.start[0] * self.end[1] - self.end[0] * self.start[1])

    def mirrored(self) -> Line:
        """The curve reflected in x = 0 and run backwards, so that a CCW boundary stays CCW."""
        return Line(_reflect(self.end), _reflect(self.start))


@dataclass(frozen=True)
class CubicBezier:
    """Cubic Bezier curve x(t) = sum_i B_i^3(t) P_i with P = (start, control_1, control_2, end), metres."""

    start: Point
    control_1: Point
    control_2: Point
    end: Point

    @cached_property
    def control_points(self) -> NDArray[np.float64]:
        """(4, 2) start, the two control points and end, metres."""
        return np.array([self.start, self.control_1, self.control_2, self.end], dtype=np.float64)

    def at(self, t: ArrayLike) -> NDArray[np.float64]:
        """Points (..., 2) at curve parameters t (...)."""
        t = np.asarray(t, dtype=np.float64)[..., None]
        p, s = self.control_points, 1.0 - np.asarray(t)
        return s**3 * p[0] + 3 * s**2 * t * p[1] + 3 * s * t**2 * p[2] + t**3 * p[3]

    def derivative(self, t: ArrayLike) -> NDArray[np.float64]:
        """dx/dt (..., 2) at curve parameters t (...)."""
        t = np.asarray(t, dtype=np.float64)[..., None]
        d, s = 3.0 * np.diff(self.control_points, axis=0), 1.0 - np.asarray(t)
        return s**2 * d[0] + 2 * s * t * d[1] + t**2 * d[2]

    def _arc(self, a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
        """Arc length between parameters a and b (elementwise), by Gauss-Legendre quadrature of |dx/dt|."""
        half = 0.5 * (b - a)
        t = half[..., None] * _NODES + 0.5 * (a + b)[..., None]
        return half * (np.linalg.norm(self.derivative(t), axis=-1) @ _WEIGHTS)

    @cached_property
    def _table(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        knots = np.linspace(0.0, 1.0, _PIECES + 1)
        return knots, np.concatenate([[0.0], np.cumsum(self._arc(knots[:-1], knots[1:]))])

    @cached_property
    def length(self) -> float:
        """Arc length, metres."""
        return float(self._table[1][-1])

    def at_fraction(self, fraction: ArrayLike) -> NDArray[np.float64]:
        """Points (..., 2) that lie at the given fractions (...) of the arc length.

        Solves s(t) = fraction * length for t by Newton's method, ds/dt = |dx/dt|.
        """
        fraction = np.asarray(fraction, dtype=np.float64)
        knots, lengths = self._table
        target = fraction * lengths[-1]
        piece = np.clip(np.searchsorted(lengths, target, side="right") - 1, 0, _PIECES - 1)
        low, high = knots[piece], knots[piece + 1]
        span = lengths[piece + 1] - lengths[piece]
        t = low + (high - low) * (target - lengths[piece]) / np.where(span > 0.0, span, 1.0)
        for _ in range(_NEWTON_STEPS):
            speed = np.linalg.norm(self.derivative(t), axis=-1)
            excess = lengths[piece] + self._arc(low, t) - target
            t = np.clip(t - np.where(speed > 0.0, excess / np.where(speed > 0.0, speed, 1.0), 0.0), low, high)
        points = self.at(t)
        points[fraction == 0.0], points[fraction == 1.0] = self.start, self.end
        return points

    @property
    def signed_area(self) -> float:
        """Integral of (x dy - y dx) / 2 along the curve, square metres; exact, a polynomial of degree 5."""
        t = 0.5 * (_NODES + 1.0)
        x, dx = self.at(t), self.derivative(t)
        return float(0.25 * ((x[:, 0] * dx[:, 1] - x[:, 1] * dx[:, 0]) @ _WEIGHTS))

    def mirrored(self) -> CubicBezier:
        """The curve reflected in x = 0 and run backwards, so that a CCW boundary stays CCW."""
        return CubicBezier(*(_reflect(p) for p in (self.end, self.control_2, self.control_1, self.start)))


Curve = Line | CubicBezier


def _reflect(point: Point) -> Point:
    return (-point[0], point[1])
