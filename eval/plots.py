"""Line plots as SVG that take the colour of the page's text, so that they read in light and dark."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

INK = "#010203"  # stands for the page's own text colour
COLOURS = ("#3f83c2", "#d2693c", "#3f9a68", "#a56cc1", "#c59a2b", "#5aa7ad")
STYLE: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "muslin",
    "font.family": "sans-serif",
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
}

Line = tuple[Sequence[float], Sequence[float]]


def line_plot(lines: Mapping[str, Line], x_label: str, y_label: str, points: bool = False) -> str:
    """SVG of named lines (x, y); with `points` every value gets a dot. The y axis starts at zero."""

    def draw() -> Figure:
        figure = Figure(figsize=(5.4, 3.1), layout="constrained")
        axes = figure.add_subplot()
        for (name, (x, y)), colour in zip(lines.items(), COLOURS * (1 + len(lines) // 6), strict=False):
            axes.plot(x, y, color=colour, label=name, marker="o" if points else None, markersize=4, lw=1.6)
        highest = max((max(y) for _, y in lines.values()), default=0.0)
        axes.set_ylim(0.0, 1.1 * highest or 1.0)
        axes.set_xlabel(x_label)
        axes.set_ylabel(y_label)
        axes.grid(alpha=0.15, color=INK)
        if 1 < len(lines) <= 12:
            axes.legend(fontsize=8)
        return figure

    return page_svg(draw)


def bar_plot(names: Sequence[str], values: Sequence[float], x_label: str) -> str:
    """SVG of horizontal bars, the first on top."""

    def draw() -> Figure:
        figure = Figure(figsize=(5.4, 0.7 + 0.26 * len(names)), layout="constrained")
        axes = figure.add_subplot()
        axes.barh(range(len(names)), values, color=COLOURS[0], height=0.7)
        axes.set_yticks(range(len(names)), names, fontsize=8)
        axes.invert_yaxis()
        axes.set_xlabel(x_label)
        return figure

    return page_svg(draw)


def page_svg(draw: Callable[[], Figure]) -> str:
    """SVG for a page: without size or background, in the colour of its text. What is drawn has `STYLE`."""
    return inline_svg(_svg(draw)).replace(INK, "currentColor")


def file_svg(draw: Callable[[], Figure]) -> bytes:
    """SVG for a file of its own, black on nothing."""
    return _svg(draw).replace(INK, "#000000").encode()


def file_png(draw: Callable[[], Figure], title: str) -> bytes:
    """PNG on white, with a title."""
    stream = io.BytesIO()
    with mpl.rc_context(STYLE):
        figure = draw()
        figure.suptitle(title, fontsize=10)
        FigureCanvasAgg(figure).print_png(stream)
    return stream.getvalue()


def _svg(draw: Callable[[], Figure]) -> str:
    stream = io.StringIO()
    with mpl.rc_context(STYLE):
        FigureCanvasSVG(draw()).print_svg(stream, metadata={"Date": None})
    return stream.getvalue()


def inline_svg(text: str) -> str:
    """A standalone SVG document made fit for HTML: no prologue, no fixed size, transparent."""
    body = text[text.index("<svg") :]
    head, rest = body.split(">", 1)
    head = re.sub(r'\s(width|height)="[^"]*"', "", head)
    rest = re.sub(r'(<g id="patch_1">\s*<path [^>]*style=")fill: #ffffff', r"\1fill: none", rest, count=1)
    return f"{head}>{rest}"
