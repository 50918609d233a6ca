"""How well a prediction meets the truth, as one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from muslin.eval.compare import Comparison, PairScore
from muslin.eval.metrics.surface_sampling import point_to_surface
from muslin.eval.page import column, number, picture_source, render_page, tile
from muslin.eval.plots import Line, line_plot
from muslin.eval.read.pairing import paired
from muslin.eval.read.track import Track
from muslin.sim.view.camera import frame_camera
from muslin.sim.view.heatmap import colours, with_bar
from muslin.sim.view.layer import OBSTACLE, SKIN, Layer
from muslin.sim.view.lighting import DRAFT
from muslin.sim.view.picture import AZIMUTH, ELEVATION, facing
from muslin.sim.view.render import render

HEAT_MAPS = 3
HEAT_SIZE = (390, 520)
FIGURES = ("mean", "rms", "median", "p95", "max")


def comparison_report(comparison: Comparison) -> str:
    """HTML of a comparison: figures, plots over frames and over beta, heat maps of the worst pairs."""
    figures = comparison.figures
    return render_page(
        "comparison.html.j2",
        title="muslin: comparison",
        prediction=comparison.prediction,
        truth=comparison.truth,
        tiles=_tiles(comparison),
        notes=comparison.notes + _unmatched(comparison),
        columns=[column("figure", text=True), *(column(name) for name in FIGURES)],
        rows=_rows(figures),
        plots=_frame_plots(comparison.pairs) + _beta_plots(comparison.pairs),
        heat_maps=_heat_maps(comparison),
        pair_columns=[
            column("sample", text=True),
            column("design", text=True),
            column("shape / motion", text=True),
            column("frames"),
            column("vertex mean, mm"),
            column("vertex max, mm"),
            column("velocity, mm/s"),
            column("surface mean, mm"),
            column("Hausdorff, mm"),
            column("inside, %"),
        ],
        pair_rows=[_pair_row(pair) for pair in comparison.pairs],
    )


def _tiles(comparison: Comparison) -> list[dict[str, str]]:
    figures = comparison.figures
    tiles = [tile("samples", str(len(comparison.pairs))), tile("frames", str(comparison.frames))]
    if figures["vertex_error_mm"] is not None:
        tiles.append(tile("mean vertex error", f"{number(figures['vertex_error_mm']['mean'])} mm"))
    if figures["velocity_error_mm_s"] is not None:
        tiles.append(tile("mean velocity error", f"{number(figures['velocity_error_mm_s']['mean'])} mm/s"))
    tiles.append(tile("mean surface distance", f"{number(figures['mean_surface_distance_mm'])} mm"))
    tiles.append(tile("Hausdorff distance, worst frame", f"{number(figures['hausdorff_mm'])} mm"))
    if figures["penetration"] is not None:
        ratio = figures["penetration"]["ratio"]
        tiles.append(tile("vertices inside the body", f"{number(100 * ratio)} %", "bad" if ratio else "good"))
    return tiles


def _unmatched(comparison: Comparison) -> list[str]:
    sides = (("prediction", comparison.unmatched_prediction), ("truth", comparison.unmatched_truth))
    return [f"{len(ids)} samples only in the {side}: {', '.join(ids[:8])}" for side, ids in sides if ids]


def _rows(figures: dict[str, Any]) -> list[list[str]]:
    rows = []
    for label, key in (
        ("vertex error, mm", "vertex_error_mm"),
        ("vertex error by area, mm", "vertex_error_area_weighted_mm"),
        ("velocity error, mm/s", "velocity_error_mm_s"),
    ):
        values = figures[key] or dict.fromkeys(FIGURES)
        rows.append([label, *(number(values[name]) for name in FIGURES)])
    blank = "–"
    rows.append(
        [
            "surface distance, mm",
            number(figures["mean_surface_distance_mm"]),
            number(figures["rms_surface_distance_mm"]),
            blank,
            blank,
            f"{number(figures['hausdorff_mm'])} (at most {number(figures['hausdorff_upper_mm'])})",
        ]
    )
    for label, key in (
        ("depth inside the body, mm", "penetration"),
        ("the truth's own depth, mm", "truth_penetration"),
    ):
        values = figures[key] or {"depth_mean_mm": None, "depth_max_mm": None}
        rows.append(
            [label, number(values["depth_mean_mm"]), blank, blank, blank, number(values["depth_max_mm"])]
        )
    return rows


def _name(pair: PairScore) -> str:
    parts = [pair.labels.get(key, "") for key in ("design", "shape", "sequence")]
    return " · ".join(part for part in parts if part) or pair.prediction


def _frame_plots(pairs: Sequence[PairScore]) -> list[dict[str, str]]:
    moving = [pair for pair in pairs if pair.num_frames > 1][:6]
    plots = []
    for caption, unit, attribute in (
        ("Mean vertex error over time", "mm", "vertex_mean"),
        ("Mean velocity error over time", "mm/s", "velocity_mean"),
        ("Hausdorff distance over time", "mm", "hausdorff"),
        ("Vertices inside the body over time", "share", "penetration_ratio"),
    ):
        lines: dict[str, Line] = {}
        for pair in moving:
            values = getattr(pair.frames, attribute)
            if values is None:
                continue
            frames = pair.frames.surface_frames if attribute == "hausdorff" else range(len(values))
            rate = pair.fps or 1.0
            lines[_name(pair)] = ([frame / rate for frame in frames], values)
        if lines:
            axis = "time, s" if moving[0].fps else "frame"
            plots.append({"svg": line_plot(lines, axis, unit), "caption": caption})
    return plots


def _beta_plots(pairs: Sequence[PairScore]) -> list[dict[str, str]]:
    """Errors of drapes against the shape coefficient that varies most, one line a design."""
    still = [pair for pair in pairs if pair.num_frames == 1 and pair.beta]
    if len({tuple(pair.beta) for pair in still}) < 2:
        return []
    size = max(len(pair.beta) for pair in still)
    betas = np.array([pair.beta + [0.0] * (size - len(pair.beta)) for pair in still])
    component = int(np.ptp(betas, axis=0).argmax())
    plots = []
    for caption, key in (
        ("Hausdorff distance", "hausdorff_mm"),
        ("Mean surface distance", "mean_surface_distance_mm"),
    ):
        designs: dict[str, list[tuple[float, float]]] = {}
        for pair, beta in zip(still, betas, strict=True):
            name = pair.labels.get("design", "") or "garment"
            designs.setdefault(name, []).append((float(beta[component]), pair.figures[key]))
        lines: dict[str, Line] = {}
        for name, points in designs.items():
            x, y = zip(*sorted(points), strict=True)
            lines[name] = (x, y)
        svg = line_plot(lines, f"shape coefficient {component}, standard deviations", "mm", points=True)
        plots.append({"svg": svg, "caption": f"{caption} over body shape"})
    return plots


def _heat_maps(comparison: Comparison) -> list[dict[str, str]]:
    worst = sorted(comparison.pairs, key=lambda pair: -pair.figures["hausdorff_mm"])[:HEAT_MAPS]
    predictions, truths = comparison.subjects
    entries = []
    for pair in worst:
        frame = pair.frames.surface_frames[int(np.argmax(pair.frames.hausdorff))]
        both = paired(predictions.load(pair.prediction), truths.load(pair.truth))
        entries.append(
            {
                "picture": picture_source(heat_map(both.prediction, both.truth, frame)),
                "caption": f"{_name(pair)}, frame {frame}: distance to the truth's surface, mm",
            }
        )
    return entries


def heat_map(prediction: Track, truth: Track, frame: int) -> np.ndarray:
    """Picture of the predicted surface on the true body, coloured by the distance to the true surface."""
    positions = prediction.positions[frame].astype(np.float64)
    distance = 1000.0 * point_to_surface(positions, truth.positions[frame], truth.faces[frame])
    high = max(float(np.quantile(distance, 0.99)), 1e-3)
    layers = []
    azimuth = AZIMUTH
    sample, body = truth.sample, truth.body
    if body is not None:
        skin = SKIN if sample is not None and sample.body is not None else OBSTACLE
        layers.append(Layer(body.vertices(frame), body.faces, np.array(skin)))
    if sample is not None:
        azimuth += facing(sample, frame)
    shades = colours(distance, 0.0, high)
    layers.append(Layer(positions, prediction.faces[frame], shades, sheet=True, gloss=0.0, flat_light=True))
    points = np.concatenate([layer.vertices for layer in layers])
    camera = frame_camera(points, *HEAT_SIZE, azimuth, ELEVATION)
    image = render(layers, camera, HEAT_SIZE, DRAFT, float(points[:, 1].min()))
    return with_bar(image, 0.0, high, "mm")


def _pair_row(pair: PairScore) -> list[str]:
    figures = pair.figures
    vertex, velocity = figures["vertex_error_mm"], figures["velocity_error_mm_s"]
    inside = figures["penetration"]
    return [
        pair.truth,
        pair.labels.get("design", ""),
        pair.labels.get("sequence", "") or pair.labels.get("shape", ""),
        str(pair.num_frames),
        number(vertex and vertex["mean"]),
        number(vertex and vertex["max"]),
        number(velocity and velocity["mean"]),
        number(figures["mean_surface_distance_mm"]),
        number(figures["hausdorff_mm"]),
        number(inside and 100 * inside["ratio"]),
    ]
