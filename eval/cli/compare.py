"""`muslin eval`: a prediction against the truth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from muslin.eval.cli.options import make_parent


def evaluate(
    prediction: Annotated[Path, typer.Argument(metavar="PREDICTION", help="What is scored.")],
    truth: Annotated[Path, typer.Argument(metavar="TRUTH", help="What it is scored against.")],
    json_file: Annotated[
        Path | None,
        typer.Option("--json", metavar="FILE", help="Write all figures there, replacing the last."),
    ] = None,
    html_file: Annotated[
        Path | None, typer.Option("--html", metavar="FILE", help="Write a report there, replacing the last.")
    ] = None,
    fps: Annotated[
        float | None, typer.Option("--fps", help="Frames per second of files that do not say.")
    ] = None,
    body: Annotated[
        Path | None,
        typer.Option("--body", metavar="FILE", help="What TRUTH lies on, if it has no body; metres."),
    ] = None,
    faces: Annotated[
        Path | None,
        typer.Option("--faces", metavar="FILE", help="A mesh with the faces, for files that have none."),
    ] = None,
    scale: Annotated[
        float | None, typer.Option("--scale", help="Metres a unit of PREDICTION's files, e.g. 0.01 for cm.")
    ] = None,
    truth_scale: Annotated[
        float | None, typer.Option("--truth-scale", help="Metres a unit of TRUTH's files.")
    ] = None,
    up: Annotated[
        Literal["y", "z"] | None, typer.Option("--up", help="The axis that is up in PREDICTION's files.")
    ] = None,
    vertices_correspond: Annotated[
        bool,
        typer.Option(
            "--vertices-correspond",
            help="Vertex k is the same point on both sides, although the triangles differ.",
        ),
    ] = False,
    surface_frames: Annotated[
        int, typer.Option("--surface-frames", min=1, help="Most frames of a sequence with surface distances.")
    ] = 24,
    metrics: Annotated[
        list[str] | None,
        typer.Option(
            "--metrics",
            metavar="NAME",
            help="Families of metrics, repeatable: standard, all, vertex, motion, surface, normals, folds, "
            "curvature, spectrum, panel-spectrum, strain, change, body-contact, self-contact, definitions, "
            "energy.",
        ),
    ] = None,
    baseline: Annotated[
        Path | None,
        typer.Option("--baseline", metavar="FILE", help="Exit with 1 if a figure is worse than in there."),
    ] = None,
    tolerance: Annotated[
        list[str] | None,
        typer.Option(
            "--tolerance",
            metavar="PATH=REL",
            help="How much worse, as a share; without PATH= of every error, by default 0.01. Repeatable.",
        ),
    ] = None,
    new_baseline: Annotated[
        Path | None,
        typer.Option("--write-baseline", metavar="FILE", help="Write a baseline there, replacing the last."),
    ] = None,
) -> None:
    """Score a prediction: errors of vertices, motion, surfaces and wrinkles; strain, penetration, crossings.

    Either side is a dataset, one sample (DIR/samples/ID.zarr.zip), a file (.obj .ply .glb .stl .off .npy
    .npz .pkl .pc2 .pc16 .usd .abc), a folder of meshes, or a folder with a file or a folder a sample, named
    as it; their topology may change from frame to frame. Vertices without faces take those of the other side
    if the counts agree. Meshes of different topology get vertex and velocity errors if both tell panel space
    and are of one pattern, else surface distances only.

    \b
    Examples:
      muslin eval out/prediction out/demo --json eval.json --html eval.html
      muslin eval frames_a/ frames_b/ --fps 30
      muslin eval rollout.pkl out/demo/samples/walk.zarr.zip --fps 30
      muslin eval predictions/ out/demo --scale 0.01 --up z
      muslin eval mine.npy theirs/Tshirt.pc16 --body body.npz
      muslin eval out/prediction out/demo --baseline base.json --tolerance vertex_error_mm.mean=0.02
    """
    from muslin.eval.cli.progress import progress_bar
    from muslin.eval.compare import compare
    from muslin.eval.page import write_atomically
    from muslin.eval.read.options import ReadOptions
    from muslin.eval.regression import (
        measured,
        parse_tolerances,
        read_baseline,
        regressions,
        write_baseline,
    )

    limits = parse_tolerances(tolerance or [])
    before = None if baseline is None else read_baseline(baseline)
    for file in (json_file, html_file, new_baseline):
        if file is not None:
            make_parent(file)
    with progress_bar("eval") as update:
        result = compare(
            prediction,
            truth,
            metrics=metrics or ["standard"],
            surface_frames=surface_frames,
            progress=update,
            prediction_options=ReadOptions(fps, scale, up, faces),
            truth_options=ReadOptions(fps, truth_scale, None, faces, body),
            vertices_correspond=vertices_correspond,
        )
    if json_file is not None:
        write_atomically(json_file, result.to_json().encode())
    if html_file is not None:
        from muslin.eval.comparison_report import comparison_report

        write_atomically(html_file, comparison_report(result).encode())
    for line in _summary(result.to_dict()):
        typer.echo(line)
    found = measured(result.to_dict()) if baseline or new_baseline else None
    worse = regressions(before, found, limits) if before and found else []
    if worse:
        for row in worse:
            typer.echo(f"  {row}", err=True)
        typer.echo(f"muslin: {len(worse)} figures are worse than in {baseline}", err=True)
        raise typer.Exit(1)
    if new_baseline is not None and found is not None:
        write_baseline(new_baseline, found)


def _summary(figures: dict) -> list[str]:
    lines = [f"{figures['samples']} samples, {figures['frames']} frames"]
    for label, key, unit in (
        ("vertex error", "vertex_error_mm", "mm"),
        ("velocity error", "velocity_error_mm_s", "mm/s"),
        ("angle of normals", "normal_error_deg", "degrees"),
    ):
        if figures.get(key) is not None:
            values = "  ".join(f"{name} {figures[key][name]:.4g}" for name in ("mean", "rms", "p95", "max"))
            lines.append(f"{label:18} {values} {unit}")
    if figures.get("hausdorff_mm") is not None:
        lines.append(f"{'surface distance':18} mean {figures['mean_surface_distance_mm']:.4g} mm")
        upper = figures["hausdorff_upper_mm"]
        lines.append(f"{'Hausdorff':18} {figures['hausdorff_mm']:.4g} mm (at most {upper:.4g})")
    kept = (figures.get("spectrum") or {}).get("wrinkles_kept")
    if kept is not None:
        lines.append(f"{'wrinkles kept':18} {100 * kept:.3g} %")
    inside = figures.get("penetration")
    if inside is not None:
        lines.append(
            f"{'inside the body':18} {100 * inside['ratio']:.3g} % of vertices, "
            f"{100 * inside['area_ratio']:.3g} % of the area, at most {inside['surface_depth_max_mm']:.3g} mm"
        )
    for label, key in (
        ("crossing the body", "body_intersections"),
        ("crossing itself", "self_intersections"),
    ):
        found = figures.get(key)
        if found is not None:
            lines.append(f"{label:18} {found['pairs_mean']:.4g} pairs of triangles a frame")
    return lines + [f"note: {note}" for note in figures["notes"]]
