"""Pictures of patterns: panels with their names, edge lengths and seams."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.garments.layout import arrange
from muslin.garments.mesh import GarmentMesh
from muslin.garments.panels import Panel
from muslin.garments.pattern import Pattern
from muslin.garments.seams import EdgeRef

FORMATS = (".png", ".svg")
GAP = 0.09  # metres between panels, room for the labels
CHARACTER_WIDTH = 0.0064  # metres on paper of a label's character
_CENTRED: dict[str, Any] = {"ha": "center", "va": "center", "rotation_mode": "anchor"}
_CLOTH, _INK, _FREE = "#f4efe6", "#2b2b2b", "#8a8a8a"
_SEAM_COLOURS = (
    "#c0392b", "#2471a3", "#1e8449", "#b9770e", "#7d3c98",
    "#148f77", "#d35400", "#34495e", "#a93268", "#6e7b0b",
)  # fmt: skip


def draw_pattern(pattern: Pattern, mesh: GarmentMesh | None = None) -> Figure:
    """Figure of all panels to one scale; the two edges of a seam share a colour and a number.

    Each edge is labelled with its name and length in centimetres; hems and other free edges are grey, the
    arrow is the grain. With a mesh of the pattern its triangles are drawn too.
    """
    pattern.validate()
    outlines = [panel.outline() for panel in pattern.panels]
    offsets, size = arrange([np.ptp(outline, axis=0) for outline in outlines], GAP)
    shift = {
        panel.name: offset - outline.min(axis=0)
        for panel, outline, offset in zip(pattern.panels, outlines, offsets, strict=True)
    }
    figure = Figure(figsize=tuple(np.maximum(size + 2 * GAP, 0.3) * 10.0))
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_xlim(-GAP, size[0] + GAP)
    axes.set_ylim(-GAP, size[1] + GAP)

    seam_of = {}
    for number, seam in enumerate(pattern.seams, start=1):
        seam_of[seam.first] = seam_of[seam.second] = number
    for index, panel in enumerate(pattern.panels):
        _draw_panel(axes, panel, shift[panel.name], seam_of)
        if mesh is not None:
            faces = mesh.panel_faces[mesh.face_panel == index]
            points = mesh.panel_vertices + shift[panel.name]
            axes.triplot(points[:, 0], points[:, 1], faces, color=_FREE, linewidth=0.3, zorder=1.5)
    return figure


def save_drawing(pattern: Pattern, path: Path | str, mesh: GarmentMesh | None = None) -> None:
    """Write the picture of the pattern to a .png or .svg file; InputError for another suffix."""
    path = Path(path)
    if path.suffix.lower() not in FORMATS:
        raise InputError(f"{path}: cannot draw to '{path.suffix}'; allowed: {', '.join(FORMATS)}")
    # A fixed salt and no date: the same pattern gives the same bytes.
    metadata = {"Date": None} if path.suffix.lower() == ".svg" else None
    with rc_context({"svg.hashsalt": "muslin"}):
        draw_pattern(pattern, mesh).savefig(path, dpi=150, facecolor="white", metadata=metadata)


def _draw_panel(axes: Axes, panel: Panel, shift: NDArray[np.float64], seam_of: Mapping[EdgeRef, int]) -> None:
    outline = panel.outline() + shift
    axes.fill(outline[:, 0], outline[:, 1], color=_CLOTH, zorder=1)
    centre = 0.5 * (outline.min(axis=0) + outline.max(axis=0))
    height = float(np.ptp(outline[:, 1]))
    axes.annotate(
        "",
        (centre[0], centre[1] + 0.14 * height),
        (centre[0], centre[1] - 0.14 * height),
        arrowprops={"arrowstyle": "->", "color": _FREE, "linewidth": 1.0},
    )
    axes.text(
        centre[0] + 0.012, centre[1], panel.name.replace("_", " "), fontsize=15, va="center", color=_INK,
        zorder=4, bbox={"facecolor": _CLOTH, "edgecolor": "none", "pad": 1.5},
    )  # fmt: skip
    for edge in panel.edges:
        number = seam_of.get(EdgeRef(panel.name, edge.name))
        colour = _FREE if number is None else _SEAM_COLOURS[(number - 1) % len(_SEAM_COLOURS)]
        line = edge.curve.at_fraction(np.linspace(0.0, 1.0, 49)) + shift
        axes.plot(line[:, 0], line[:, 1], color=colour, linewidth=2.2, solid_capstyle="round", zorder=2)
        tangent = line[25] - line[23]
        tangent /= np.linalg.norm(tangent)
        outward = np.array([tangent[1], -tangent[0]])
        label = f"{edge.name.replace('_', ' ')}  {100.0 * edge.curve.length:.1f} cm"
        # Where the edge curves outward past the label's baseline, the label moves beyond it.
        beside = np.abs((line - line[24]) @ tangent) < 0.5 * len(label) * CHARACTER_WIDTH
        bulge = ((line - line[24]) @ outward)[beside].max()
        x, y = line[24] + (bulge + 0.014) * outward
        angle = (float(np.degrees(np.arctan2(tangent[1], tangent[0]))) + 90.0) % 180.0 - 90.0
        axes.text(x, y, label, color=colour, rotation=angle, fontsize=8, zorder=4, **_CENTRED)
        if number is not None:
            x, y = line[24] - 0.022 * outward
            bubble = {"boxstyle": "circle,pad=0.25", "color": colour}
            axes.text(x, y, str(number), color="white", fontsize=9, zorder=4, bbox=bubble, **_CENTRED)
