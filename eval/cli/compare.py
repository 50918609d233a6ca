"""`muslin eval`: a prediction against the truth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

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
        float | None, typer.Option("--fps", help="Frames per second of folders of mesh files.")
    ] = None,
    surface_frames: Annotated[
        int, typer.Option("--surface-frames", min=1, help="Most frames of a sequence with surface distances.")
    ] = 24,
) -> None:
    """Score a prediction: vertex, velocity and surface errors, and how much is inside the body.

    Either side is a dataset, one sample (DIR/samples/ID.zarr), a mesh file (.obj, .ply, .glb, .stl, .off) or
    a folder of mesh files; their topology may change from frame to frame. Meshes of different topology get
    vertex and velocity errors if both tell panel space and are of one pattern, else surface distances only.

    \b
    Examples:
      muslin eval out/prediction out/demo --json eval.json --html eval.html
      muslin eval mine.obj theirs.obj
      muslin eval frames_a/ frames_b/ --fps 30
    """
    from muslin.eval.cli.progress import progress_bar
    from muslin.eval.compare import compare
    from muslin.eval.page import write_atomically

    for file in (json_file, html_file):
        if file is not None:
            make_parent(file)
    with progress_bar("eval") as update:
        result = compare(prediction, truth, fps=fps, surface_frames=surface_frames, progress=update)
    if json_file is not None:
        write_atomically(json_file, result.to_json().encode())
    if html_file is not None:
        from muslin.eval.comparison_report import comparison_report

        write_atomically(html_file, comparison_report(result).encode())
    for line in _summary(result.to_dict()):
        typer.echo(line)


def _summary(figures: dict) -> list[str]:
    lines = [f"{figures['samples']} samples, {figures['frames']} frames"]
    for label, key, unit in (
        ("vertex error", "vertex_error_mm", "mm"),
        ("velocity error", "velocity_error_mm_s", "mm/s"),
    ):
        if figures[key] is not None:
            values = "  ".join(f"{name} {figures[key][name]:.4g}" for name in ("mean", "rms", "p95", "max"))
            lines.append(f"{label:18} {values} {unit}")
    lines.append(f"{'surface distance':18} mean {figures['mean_surface_distance_mm']:.4g} mm")
    lines.append(
        f"{'Hausdorff':18} {figures['hausdorff_mm']:.4g} mm (at most {figures['hausdorff_upper_mm']:.4g})"
    )
    if figures["penetration"] is not None:
        inside = figures["penetration"]
        lines.append(
            f"{'inside the body':18} {100 * inside['ratio']:.3g} %, at most {inside['depth_max_mm']:.3g} mm"
        )
    return lines + [f"note: {note}" for note in figures["notes"]]
