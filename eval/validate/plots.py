"""Simulated points over known curves, as SVG for the page and as PNG."""

from __future__ import annotations

from matplotlib.figure import Figure

from muslin.eval.plots import COLOURS, INK, file_png, page_svg
from muslin.eval.validate.case import Plot

MARKERS = "osD^vP"


def plot_svg(plot: Plot) -> str:
    """SVG for a page, see `page_svg`."""
    return page_svg(lambda: _figure(plot))


def plot_png(plot: Plot) -> bytes:
    """PNG on white, with its caption as title."""
    return file_png(lambda: _figure(plot), plot.caption)


def _figure(plot: Plot) -> Figure:
    figure = Figure(figsize=(6.4, 4.2), dpi=120, layout="constrained")
    axes = figure.add_subplot()
    curves = [series for series in plot.series if series.style == "line"]
    points = [series for series in plot.series if series.style == "points"]
    for k, series in enumerate(curves):
        axes.plot(series.x, series.y, color=COLOURS[k % len(COLOURS)], lw=1.6, label=series.name)
    # As many points as curves belong to each other in this order; else they go round the colours.
    for k, series in enumerate(points):
        colour = COLOURS[(k * len(curves) // len(points) if curves else k) % len(COLOURS)]
        marker = MARKERS[k % len(MARKERS)]
        axes.plot(
            series.x,
            series.y,
            color=colour,
            label=series.name,
            ls="",
            marker=marker,
            ms=4.5,
            mfc="none",
            mew=1.1,
        )
    axes.set_xscale("log" if plot.log_x else "linear")
    axes.set_yscale("log" if plot.log_y else "linear")
    if plot.same_scale:
        axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(plot.x_label)
    axes.set_ylabel(plot.y_label)
    axes.grid(alpha=0.15, color=INK)
    axes.legend(fontsize=7, ncols=2 if len(plot.series) > 6 else 1)
    return figure
