"""What a dataset holds, as one HTML file that needs nothing else."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from muslin.eval.gallery import Progress, Shot, draw
from muslin.eval.page import bytes_source, column, duration, number, picture_source, render_page, tile
from muslin.eval.plots import bar_plot
from muslin.garments import catalogue
from muslin.garments.drawing import draw_pattern
from muslin.garments.errors import InputError
from muslin.sim.dataset import store
from muslin.sim.dataset.info import DatasetInfo, info
from muslin.sim.dataset.reader import Dataset, open_dataset
from muslin.sim.view.movie import gif_bytes
from muslin.sim.view.sheet import contact_sheet

MOST_DRAPES = 24
MOST_SEQUENCES = 4
MOVIE_FRAMES = 40
SHEET_FRAMES = 8

Row = Mapping[str, Any]

COLUMNS = [
    column("sample", text=True),
    column("design", text=True),
    column("shape / motion", text=True),
    column("fabric", text=True),
    column("frames"),
    column("vertices"),
    column("cloth–cloth"),
    column("cloth–body"),
    column("smallest gap, mm"),
    column("masked faces"),
    column("residual / weight"),
    column("largest stretch, %"),
    column("time, s"),
]


def dataset_report(
    path: str | Path,
    *,
    verification: Mapping[str, Any] | None = None,
    most_drapes: int = MOST_DRAPES,
    most_sequences: int = MOST_SEQUENCES,
    workers: int | None = None,
    progress: Progress | None = None,
) -> str:
    """HTML of a dataset: pictures of drapes and sequences, patterns, certificates, computing time.

    verification   what `muslin verify --json` wrote, to be told beside the certificates
    Raises InputError if the folder is no dataset or holds no sample.
    """
    dataset = open_dataset(path)
    if not len(dataset):
        raise InputError(f"{path}: the dataset holds no sample; run `muslin generate` first")
    facts = info(path)
    drapes = [row for row in dataset.rows if row["kind"] == "drape"][:most_drapes]
    moving = [row for row in dataset.rows if row["kind"] == "sequence"][:most_sequences]
    frames = {row["id"]: _spread(row["frames"], MOVIE_FRAMES) for row in moving}
    shots = [Shot(dataset.root, row["id"]) for row in drapes]
    for row in moving:
        chosen = tuple(frames[row["id"]])
        shots += [Shot(dataset.root, row["id"], frame, chosen) for frame in chosen]
    pictures = iter(draw(shots, workers, progress))
    return render_page(
        "dataset.html.j2",
        title=f"muslin: {facts.name}",
        name=facts.name,
        lead=_lead(facts),
        tiles=_tiles(facts, verification),
        drapes=[{"picture": picture_source(next(pictures)), "caption": _caption(row)} for row in drapes],
        sequences=[_sequence(row, frames[row["id"]], pictures) for row in moving],
        left_out=_left_out(facts, len(drapes), len(moving)),
        patterns=_patterns(dataset),
        columns=COLUMNS,
        rows=[_certificate(row) for row in dataset.rows],
        timing=_timing(dataset),
        timing_caption=f"Seconds of computing a frame, one core a sample; {duration(facts.seconds)} in all.",
        config=json.dumps({"config": dataset.header.config, "versions": facts.versions}, indent=1),
    )


def _spread(count: int, most: int) -> list[int]:
    step = -(-count // most)
    return list(range(0, count, step))


def _lead(facts: DatasetInfo) -> str:
    parts = [f"{n} {word if n != 1 else word[:-1]}" for n, word in (
        (facts.drapes, "drapes"),
        (facts.sequences_made, "sequences"),
        (len(facts.designs), "designs"),
        (len(facts.shapes), "shapes"),
    ) if n]  # fmt: skip
    fabrics, bodies = ", ".join(facts.fabrics) or "none", ", ".join(facts.bodies) or "none"
    return f"{', '.join(parts)}; fabric: {fabrics}; body: {bodies}."


def _tiles(facts: DatasetInfo, verification: Mapping[str, Any] | None) -> list[dict[str, str]]:
    low, high = facts.vertices
    tiles = [
        tile("samples", str(facts.samples)),
        tile("frames", str(facts.frames)),
        tile("cloth vertices", f"{low:,}" if low == high else f"{low:,} – {high:,}"),
        tile("computing time", duration(facts.seconds)),
        tile("on disk", f"{facts.bytes / 1e6:.1f} MB"),
    ]
    gap = facts.certificates.get("min_distance_m")
    if gap is not None:
        tiles.append(tile("smallest gap", f"{1000 * gap:.3g} mm"))
    if verification is not None:
        counted = verification["cloth_cloth_intersections"] + verification["cloth_body_intersections"]
        failed = len(verification["failed"])
        tiles.append(tile("intersections, checked again", str(counted), "bad" if counted else "good"))
        tiles.append(tile("samples that fail", str(failed), "bad" if failed else "good"))
    else:
        counted_ = [facts.certificates.get(f"cloth_{other}_intersections") for other in ("cloth", "body")]
        known = [value for value in counted_ if value is not None]
        if known:
            total = int(sum(known))
            tiles.append(tile("intersections, worst certificate", str(total), "bad" if total else "good"))
    return tiles


def _caption(row: Row) -> str:
    return (
        " · ".join(str(row[key]) for key in ("design", "shape", "sequence", "fabric") if row[key])
        or row["id"]
    )


def _sequence(row: Row, frames: list[int], pictures: Any) -> dict[str, str]:
    images = [next(pictures) for _ in frames]
    step = frames[1] - frames[0] if len(frames) > 1 else 1
    fps = row["fps"]
    some = _spread(len(images), SHEET_FRAMES)
    captions = [f"{frames[i] / fps:.2f} s" for i in some]
    return {
        "movie": bytes_source(gif_bytes(images, fps / step), "image/gif"),
        "caption": f"{_caption(row)}: {row['frames']} frames at {fps:g} per second",
        "sheet": picture_source(contact_sheet([images[i] for i in some], 4, captions)),
        "sheet_caption": f"{row['seconds'] / row['frames']:.2f} s of computing a frame",
    }


def _left_out(facts: DatasetInfo, drapes: int, sequences: int) -> str:
    rest = [f"{n} more {word}" for n, word in (
        (facts.drapes - drapes, "drapes"), (facts.sequences_made - sequences, "sequences")
    ) if n]  # fmt: skip
    return f"Not pictured: {' and '.join(rest)}." if rest else ""


def _patterns(dataset: Dataset) -> list[dict[str, str]]:
    """A drawing of the pattern of each design that the catalogue knows."""
    drawings: dict[str, dict[str, str]] = {}
    for row in dataset.rows:
        garment = store.read_meta(dataset.root, row["id"])[0]["garment"]
        name = row["design"] or garment["name"]
        if name in drawings or garment["name"] not in catalogue.names() or len(drawings) >= 6:
            continue
        design = catalogue.get(garment["name"])
        stream = io.BytesIO()
        draw_pattern(design.pattern(**garment["parameters"])).savefig(stream, format="png", dpi=90)
        lengths = ", ".join(
            f"{key.replace('_', ' ')} {100 * v:.0f} cm" for key, v in garment["parameters"].items()
        )
        drawings[name] = {
            "picture": bytes_source(stream.getvalue(), "image/png"),
            "caption": f"{name}: {lengths}",
        }
    return list(drawings.values())


def _certificate(row: Row) -> list[str]:
    scaled = {"min_distance_m": 1000.0, "largest_strain": 100.0}
    figures = {
        key: None if row[key] is None else row[key] * scaled.get(key, 1.0)
        for key in ("min_distance_m", "force_residual", "largest_strain", "seconds")
    }
    whole = ("cloth_cloth_intersections", "cloth_body_intersections")
    return [
        row["id"],
        row["design"],
        row["sequence"] or row["shape"],
        row["fabric"],
        str(row["frames"]),
        f"{row['vertices']:,}",
        *("–" if row[key] is None else str(row[key]) for key in whole),
        number(figures["min_distance_m"]),
        str(row["masked_body_faces_max"]),
        number(figures["force_residual"], 2),
        number(figures["largest_strain"], 2),
        number(figures["seconds"]),
    ]


def _timing(dataset: Dataset) -> str:
    rows = [row for row in dataset.rows if row["seconds"]][:40]
    if not rows:
        return ""
    return bar_plot(
        [_caption(row) for row in rows], [row["seconds"] / row["frames"] for row in rows], "s a frame"
    )
