"""Export of a whole dataset: sample by sample, each there whole or not at all, going on where it stopped.

OUT/export.json          layout, dataset, terms of what went into it
OUT/manifest.csv         one row a sample: id, split, folder, labels, files, bytes
OUT/samples/ID/          the files of a sample, as its layout says, and meta.json
OUT/.partial/            the sample that is being written
"""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from muslin.garments.errors import InputError
from muslin.sim.dataset import durable
from muslin.sim.dataset.layouts.catalogue import LAYOUTS
from muslin.sim.dataset.layouts.layout import Layout
from muslin.sim.dataset.licences import Source, sources_of
from muslin.sim.dataset.reader import Dataset
from muslin.sim.dataset.sample import Sample
from muslin.sim.dataset.selection import select

FORMAT = "muslin export"
HEADER, MANIFEST, SAMPLES, META = "export.json", "manifest.csv", "samples", "meta.json"
PARTIAL, LOCK = ".partial", ".lock"
_LABELS = (
    "kind",
    "design",
    "shape",
    "sequence",
    "fabric",
    "frames",
    "fps",
    "vertices",
    "seed",
    "geometry_sha256",
)


@dataclass(frozen=True)
class Exported:
    """Samples written now, and those that were there before."""

    written: tuple[str, ...]
    kept: tuple[str, ...]


def export_layout(
    path: Dataset | str | Path,
    out: str | Path,
    layout: str,
    *,
    split: str | None = None,
    where: Mapping[str, Any] | None = None,
    ids: Iterable[str] | None = None,
    body: bool = True,
    progress: Callable[[float, int, str], None] | None = None,
) -> Exported:
    """Write samples in a layout of `catalogue.LAYOUTS`; selection as in `selection.select`.

    Samples that `out` holds already are kept, so an export that was interrupted is finished by the same call,
    and one of another selection is added to.

    Raises InputError for what `select` does, an unknown layout, samples that it cannot hold, a folder that
    holds anything else, and a sample there that was exported from other geometry; and if another process
    exports to the same folder.
    """
    if layout not in LAYOUTS:
        raise InputError(f"layout {layout!r}: must be one of {', '.join(LAYOUTS)}")
    form = LAYOUTS[layout]
    dataset = select(path)
    chosen = select(dataset, split, where, ids)
    for row in chosen.rows:
        if row["topologies"] > 1 and not form.any_topology:
            raise InputError(
                f"layout {layout}: the topology of sample {row['id']} changes over time, and this layout has "
                "one topology a sample; leave such samples out (--where topologies=1), or use layout obj"
            )
    root = Path(out)
    _check_folder(root, layout, body)
    durable.make_folder(root)
    with durable.exclusive(root / LOCK):
        _write_header(root, dataset, layout, body)
        durable.make_folder(root / SAMPLES)
        written, kept = [], []
        for done, row in enumerate(chosen.rows, start=1):
            folder = root / SAMPLES / row["id"]
            if folder.is_dir():
                _check_same(folder, row)
                kept.append(row["id"])
            else:
                _write_sample(dataset[row["id"]], row, root, form, body)
                written.append(row["id"])
            if progress is not None:
                progress(done, len(chosen), row["id"])
        facts = _all_facts(root, dataset)
        form.finish(dataset, facts, root)
        durable.write_file(root / MANIFEST, _manifest(facts).encode())
        _write_header(root, dataset, layout, body, facts)
    return Exported(tuple(written), tuple(kept))


def _check_folder(root: Path, layout: str, body: bool) -> None:
    if root.is_file():
        raise InputError(f"{root}: is a file; give a folder for the export")
    there = sorted(p.name for p in root.iterdir() if not p.name.startswith(".")) if root.is_dir() else []
    if not there:
        return
    try:
        header = json.loads((root / HEADER).read_bytes())
    except (OSError, ValueError) as error:
        raise InputError(
            f"{root}: not empty ({', '.join(there[:3])} …) and no export; give a new folder"
        ) from error
    asked = {"format": FORMAT, "layout": layout, "body": body}
    for key, value in asked.items():
        if header.get(key) != value:
            raise InputError(
                f"{root}: holds an export with {key} = {header.get(key)!r}, not {value!r}; "
                "give another folder"
            )


def _check_same(folder: Path, row: Mapping[str, Any]) -> None:
    meta = _meta(folder)
    if meta["geometry_sha256"] != row["geometry_sha256"]:
        raise InputError(
            f"{folder}: was exported from another geometry of this sample; remove it, or export to a new "
            "folder"
        )


def _write_sample(sample: Sample, row: Mapping[str, Any], root: Path, form: Layout, body: bool) -> None:
    partial = root / PARTIAL / sample.id
    shutil.rmtree(root / PARTIAL, ignore_errors=True)
    partial.mkdir(parents=True)
    more = form.write(sample, partial, root, body)
    files = sorted(partial.iterdir())
    meta = {
        "id": sample.id,
        "split": row["split"],
        **{key: row[key] for key in _LABELS},
        "garment_parameters": sample.garments[0].parameters,
        "body": row["body"] and Path(row["body"]).name,
        "certificate": sample.certificate.to_dict(),
        "sources": [asdict(source) for source in _sources(sample)],
        "files": len(files) + 1,
        "bytes": sum(file.stat().st_size for file in files),
    }
    (partial / META).write_text(json.dumps(meta | more, indent=1) + "\n", encoding="utf-8")
    for file in partial.iterdir():
        durable.sync(file)
    os.replace(partial, root / SAMPLES / sample.id)
    durable.sync(root / SAMPLES)
    (root / PARTIAL).rmdir()


def _sources(sample: Sample) -> list[Source]:
    return sources_of(sample.scene, sample.body.model if sample.body else None, sample.fabric)


def _all_facts(root: Path, dataset: Dataset) -> list[dict[str, Any]]:
    """meta.json of every exported sample, in the order of the dataset."""
    return [
        _meta(root / SAMPLES / sample_id)
        for sample_id in dataset.ids
        if (root / SAMPLES / sample_id).is_dir()
    ]


def _meta(folder: Path) -> dict[str, Any]:
    try:
        meta: dict[str, Any] = json.loads((folder / META).read_bytes())
    except (OSError, ValueError) as error:
        raise InputError(
            f"{folder / META}: not readable ({error}); remove the folder and export again"
        ) from error
    return meta


def _manifest(facts: Iterable[Mapping[str, Any]]) -> str:
    table = io.StringIO()
    rows = csv.writer(table, lineterminator="\n")
    rows.writerow(["id", "split", "folder", *_LABELS, "body", "files", "bytes"])
    for meta in facts:
        columns = [meta[key] for key in (*_LABELS, "body", "files", "bytes")]
        rows.writerow([meta["id"], meta["split"], f"{SAMPLES}/{meta['id']}", *columns])
    return table.getvalue()


def _write_header(
    root: Path, dataset: Dataset, layout: str, body: bool, facts: Iterable[Mapping[str, Any]] | None = None
) -> None:
    """Before (without `facts`) and after the samples."""
    told = [json.dumps(source, sort_keys=True) for meta in facts or () for source in meta["sources"]]
    header = {
        "format": FORMAT,
        "layout": layout,
        "body": body,
        "complete": facts is not None,
        "dataset": dataset.header.config.get("name", ""),
        "config_sha256": dataset.header.config_hash,
        "versions": dataset.header.versions,
        "licence": "the maker of the dataset chooses its licence; these are the terms of what went into it",
        "sources": [json.loads(source) for source in sorted(set(told))],
    }
    durable.write_file(root / HEADER, (json.dumps(header, indent=1) + "\n").encode())
