"""How well a prediction meets the truth, as one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from markupsafe import Markup

from muslin.eval.compare import Comparison, PairScore
from muslin.eval.metrics.surface_sampling import point_to_surface
from muslin.eval.page import column, number, picture_source, render_page, tile
from muslin.eval.plots import Line, line_plot
from muslin.eval.read.pairing import Pair, paired
from muslin.eval.read.track import Track
from muslin.eval.side_by_side import side_by_side
from muslin.eval.viewer.page import viewer
from muslin.sim.view.camera import frame_camera
from muslin.sim.view.heatmap import colours, with_bar
from muslin.sim.view.layer import OBSTACLE, SKIN, Layer
from muslin.sim.view.lighting import DRAFT
from muslin.sim.view.picture import AZIMUTH, ELEVATION, facing
from muslin.sim.view.render import render

HEAT_MAPS = 3
HEAT_SIZE = (390, 520)
SHOWN = 6_000_000  # vertices times frames in the player: some 20 MB of page
STATISTICS = ("mean", "rms", "median", "p95", "max")
DISTRIBUTIONS = {
    "vertex_error_mm": ("vertex error, mm", 1.0),
    "vertex_error_area_weighted_mm": ("vertex error by area, mm", 1.0),
    "velocity_error_mm_s": ("velocity error, mm/s", 1.0),
    "acceleration_error_m_s2": ("acceleration error, m/s²", 1.0),
    "jerk_error_m_s3": ("jerk error, m/s³", 1.0),
    "normal_error_deg": ("angle of normals, °", 1.0),
    "dihedral_error_deg": ("error of dihedral angles, °", 1.0),
    "edge_length_error": ("error of edge lengths, %", 100.0),
    "area_error": ("error of areas, %", 100.0),
}
"""Label and factor of the figures that have all of `STATISTICS`, by name."""
BESIDE = (
    ("jitter (mean jerk), m/s³", "jitter_m_s3.prediction", "jitter_m_s3.truth", 1.0),
    ("mean curvature, rms, 1/m", "curvature_1_m.prediction_rms", "curvature_1_m.truth_rms", 1.0),
    (
        "largest strain, 99% of the area below, %",
        "strain.prediction.major.p99",
        "strain.truth.major.p99",
        100.0,
    ),
    (
        "smallest strain, 1% of the area below, %",
        "strain.prediction.minor.p1",
        "strain.truth.minor.p1",
        100.0,
    ),
    ("vertices inside the body, %", "penetration.ratio", "truth_penetration.ratio", 100.0),
    ("area inside the body, %", "penetration.area_ratio", "truth_penetration.area_ratio", 100.0),
    (
        "mean depth of vertices inside, mm",
        "penetration.depth_mean_mm",
        "truth_penetration.depth_mean_mm",
        1.0,
    ),
    (
        "largest depth, mm",
        "penetration.surface_depth_max_mm",
        "truth_penetration.surface_depth_max_mm",
        1.0,
    ),
    (
        "pairs of triangles crossing the body, a frame",
        "body_intersections.pairs_mean",
        "truth_body_intersections.pairs_mean",
        1.0,
    ),
    (
        "contour with the body, a frame, m",
        "body_intersections.contour_mean_m",
        "truth_body_intersections.contour_mean_m",
        1.0,
    ),
    (
        "pairs of triangles of the cloth crossing, a frame",
        "self_intersections.pairs_mean",
        "truth_self_intersections.pairs_mean",
        1.0,
    ),
    (
        "their contour, a frame, m",
        "self_intersections.contour_mean_m",
        "truth_self_intersections.contour_mean_m",
        1.0,
    ),
    ("elastic and gravitational energy, J", "energy_j.prediction.total", "energy_j.truth.total", 1.0),
)
"""Label, prediction and truth as dotted paths, and factor of figures that both sides have by themselves."""


def comparison_report(comparison: Comparison) -> str:
    """HTML of a comparison: figures, plots over frames and over beta, the worst pairs seen and played."""
    figures = comparison.figures
    worst = [(pair, _loaded(comparison, pair)) for pair in _worst(comparison)]
    return render_page(
        "comparison.html.j2",
        title="muslin: comparison",
        prediction=comparison.prediction,
        truth=comparison.truth,
        tiles=_tiles(comparison),
        notes=comparison.notes + _unmatched(comparison),
        columns=[column("figure", text=True), *(column(name) for name in STATISTICS)],
        rows=_rows(figures),
        both_columns=[column("figure", text=True), column("prediction"), column("truth")],
        both_rows=_both_rows(figures),
        band_columns=[column(name) for name in ("wavelength, m", "prediction, 1/m", "truth, 1/m", "kept, %")],
        band_rows=_band_rows(figures),
        plots=_frame_plots(comparison.pairs) + _beta_plots(comparison.pairs),
        heat_maps=_heat_maps(worst),
        viewer=_viewer(worst),
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
            column("wrinkles kept, %"),
            column("inside, %"),
            column("pairs crossing"),
        ],
        pair_rows=[_pair_row(pair) for pair in comparison.pairs],
    )


def figure(figures: Any, path: str, factor: float = 1.0) -> float | None:
    """A figure by its dotted path, times a factor; None where there is none."""
    for name in path.split("."):
        figures = None if figures is None else figures.get(name)
    return None if figures is None else factor * figures


def _tiles(comparison: Comparison) -> list[dict[str, str]]:
    tiles = [tile("samples", str(len(comparison.pairs))), tile("frames", str(comparison.frames))]
    for label, path, unit, factor in (
        ("mean vertex error", "vertex_error_mm.mean", "mm", 1.0),
        ("mean velocity error", "velocity_error_mm_s.mean", "mm/s", 1.0),
        ("mean surface distance", "mean_surface_distance_mm", "mm", 1.0),
        ("Hausdorff distance, worst frame", "hausdorff_mm", "mm", 1.0),
        ("of wrinkles kept", "spectrum.wrinkles_kept", "%", 100.0),
    ):
        value = figure(comparison.figures, path, factor)
        if value is not None:
            tiles.append(tile(label, f"{number(value)} {unit}"))
    inside = figure(comparison.figures, "penetration.ratio", 100.0)
    if inside is not None:
        tiles.append(tile("vertices inside the body", f"{number(inside)} %", "bad" if inside else "good"))
    return tiles


def _unmatched(comparison: Comparison) -> list[str]:
    sides = (("prediction", comparison.unmatched_prediction), ("truth", comparison.unmatched_truth))
    return [f"{len(ids)} samples only in the {side}: {', '.join(ids[:8])}" for side, ids in sides if ids]


def _rows(figures: dict[str, Any]) -> list[list[str]]:
    rows = []
    for key, (label, factor) in DISTRIBUTIONS.items():
        rows.append([label, *(number(figure(figures, f"{key}.{name}", factor)) for name in STATISTICS)])
    if figures.get("hausdorff_mm") is not None:
        bounds = f"{number(figures['hausdorff_mm'])} (at most {number(figures['hausdorff_upper_mm'])})"
        means = (number(figures[f"{name}_surface_distance_mm"]) for name in ("mean", "rms"))
        rows.append(["surface distance, mm", *means, number(None), number(None), bounds])
    return rows


def _both_rows(figures: dict[str, Any]) -> list[list[str]]:
    rows = [
        [label, number(figure(figures, prediction, factor)), number(figure(figures, truth, factor))]
        for label, prediction, truth, factor in BESIDE
    ]
    return [row for row in rows if row[1:] != [number(None)] * 2]


def _band_rows(figures: dict[str, Any]) -> list[list[str]]:
    """Curvature by wavelength."""
    spectrum = figures.get("spectrum")
    if spectrum is None:
        return []
    edges = spectrum["band_edges"]
    names = [f"above {edges[0]:g}", *(f"{b:g} to {a:g}" for a, b in pairwise(edges)), f"below {edges[-1]:g}"]
    rows = zip(names, spectrum["prediction"], spectrum["truth"], spectrum["kept"], strict=True)
    return [
        [name, number(prediction), number(truth), number(None if kept is None else 100.0 * kept)]
        for name, prediction, truth, kept in rows
    ]


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
            values = pair.frames.get(attribute)
            if values is None:
                continue
            sparse = pair.frames["surface_frames"] if attribute == "hausdorff" else None
            # The first velocity is that of frame 1.
            frames = sparse or range(pair.num_frames - len(values), pair.num_frames)
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
            if pair.figures.get(key) is not None:
                designs.setdefault(name, []).append((float(beta[component]), pair.figures[key]))
        lines: dict[str, Line] = {}
        for name, points in designs.items():
            x, y = zip(*sorted(points), strict=True)
            lines[name] = (x, y)
        svg = line_plot(lines, f"shape coefficient {component}, standard deviations", "mm", points=True)
        plots.append({"svg": svg, "caption": f"{caption} over body shape"})
    return plots


def _worst(comparison: Comparison) -> list[PairScore]:
    """By the first of these figures that there is."""
    for path in ("hausdorff_mm", "vertex_error_mm.max", "normal_error_deg.mean"):
        known = [pair for pair in comparison.pairs if figure(pair.figures, path) is not None]
        if known:
            return sorted(known, key=lambda pair: -(figure(pair.figures, path) or 0.0))[:HEAT_MAPS]
    return comparison.pairs[:HEAT_MAPS]


def _loaded(comparison: Comparison, pair: PairScore) -> Pair:
    predictions, truths = comparison.subjects
    return paired(predictions.load(pair.prediction), truths.load(pair.truth))


def _heat_maps(worst: Sequence[tuple[PairScore, Pair]]) -> list[dict[str, str]]:
    entries = []
    for pair, both in worst:
        frame = _worst_frame(pair)
        entries.append(
            {
                "picture": picture_source(heat_map(both.prediction, both.truth, frame)),
                "caption": f"{_name(pair)}, frame {frame}: distance to the truth's surface, mm",
            }
        )
    return entries


def _worst_frame(pair: PairScore) -> int:
    for name in ("hausdorff", "vertex_max"):
        values = pair.frames.get(name)
        if values:
            frames = pair.frames.get("surface_frames") if name == "hausdorff" else None
            worst = int(np.argmax(values))
            return frames[worst] if frames else worst
    return 0


def _viewer(worst: Sequence[tuple[PairScore, Pair]]) -> Markup:
    scenes = [side_by_side(_name(pair), both.truth, {"prediction": both.prediction}) for pair, both in worst]
    return viewer(scenes, budget=SHOWN)


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
    def shown(path: str, factor: float = 1.0) -> str:
        return number(figure(pair.figures, path, factor))

    return [
        pair.truth,
        pair.labels.get("design", ""),
        pair.labels.get("sequence", "") or pair.labels.get("shape", ""),
        str(pair.num_frames),
        shown("vertex_error_mm.mean"),
        shown("vertex_error_mm.max"),
        shown("velocity_error_mm_s.mean"),
        shown("mean_surface_distance_mm"),
        shown("hausdorff_mm"),
        shown("spectrum.wrinkles_kept", 100.0),
        shown("penetration.ratio", 100.0),
        _sum(pair.figures, ("body_intersections.pairs_mean", "self_intersections.pairs_mean")),
    ]


def _sum(figures: dict[str, Any], paths: Sequence[str]) -> str:
    values = [figure(figures, path) for path in paths]
    known = [value for value in values if value is not None]
    return number(sum(known) if known else None)
