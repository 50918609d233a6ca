"""Figures of a benchmark as SVG and PNG: a colour a method, a dash a group, a band where the mean may lie."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from muslin.eval.bench.curves import Curve, Plot
from muslin.eval.plots import COLOURS, INK, file_png, file_svg, page_svg

DASHES = ("-", "--", ":", "-.")
MARKERS = "os^Dv"
MOST_DOTS = 40  # more points than these are a line without dots


def plot_svg(plot: Plot) -> str:
    """SVG for a page, see `page_svg`."""
    return page_svg(lambda: _figure(plot))


def plot_svg_file(plot: Plot) -> bytes:
    """SVG for a file of its own."""
    return file_svg(lambda: _figure(plot))


def plot_png(plot: Plot) -> bytes:
    """PNG on white, with its title."""
    return file_png(lambda: _figure(plot), plot.title)


def _figure(plot: Plot) -> Figure:
    figure = Figure(figsize=(6.4, 3.6), dpi=120, layout="constrained")
    axes = figure.add_subplot()
    methods = list(dict.fromkeys(curve.method for curve in plot.curves))
    others = list(dict.fromkeys(curve.rest for curve in plot.curves))
    for k, curve in enumerate(plot.curves):
        several = len(methods) > 1
        colour = methods.index(curve.method) if several else others.index(curve.rest)
        dash = others.index(curve.rest) if several else 0
        _draw(axes, plot, curve, k, COLOURS[colour % len(COLOURS)], dash)
    tops = [value for curve in plot.curves for value in (*curve.mean, *curve.high) if value is not None]
    bottoms = [value for curve in plot.curves for value in (*curve.mean, *curve.low) if value is not None]
    axes.set_ylim(1.1 * min(0.0, *bottoms), 1.1 * max(tops) if max(tops) > 0 else 1.0)
    axes.set_xlabel(plot.x_label)
    axes.set_ylabel(plot.y_label)
    axes.grid(alpha=0.15, color=INK)
    if plot.categories is not None:
        axes.set_xticks(range(len(plot.categories)), plot.categories, fontsize=8, rotation=20, ha="right")
        axes.set_xlim(-0.5, len(plot.categories) - 0.5)
    if len(plot.curves) > 1:
        axes.legend(fontsize=8)
    return figure


def _draw(axes: Axes, plot: Plot, curve: Curve, k: int, colour: str, dash: int) -> None:
    name = f"{curve.method}, {curve.rest}" if curve.rest else curve.method
    if plot.categories is not None:
        # Side by side, so that intervals of methods do not cover each other.
        x = [value + 0.5 * ((k + 0.5) / len(plot.curves) - 0.5) for value in curve.x]
        below = [m - (m if low is None else low) for m, low in zip(curve.mean, curve.low, strict=True)]
        above = [(m if high is None else high) - m for m, high in zip(curve.mean, curve.high, strict=True)]
        marker = MARKERS[dash % len(MARKERS)]
        axes.errorbar(x, curve.mean, (below, above), color=colour, label=name, fmt=marker, ms=5, capsize=3)
        return
    style = DASHES[dash % len(DASHES)]
    dot = MARKERS[dash % len(MARKERS)] if len(curve.x) <= MOST_DOTS else None
    axes.plot(curve.x, curve.mean, color=colour, label=name, ls=style, lw=1.6, marker=dot, ms=4)
    # Where samples are too few for an interval, None becomes NaN, which leaves a gap in the band.
    low, high = np.array(curve.low, dtype=np.float64), np.array(curve.high, dtype=np.float64)
    axes.fill_between(curve.x, low, high, color=colour, alpha=0.15, lw=0)
