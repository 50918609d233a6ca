"""`index.parquet`: one row a sample, so that tables and splits need not open every group."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from muslin.garments.errors import InputError
from muslin.sim.dataset import store
from muslin.sim.dataset.header import Header
from muslin.sim.dataset.root import Root
from muslin.sim.dataset.schema import INDEX

COLUMNS = pa.schema(
    [
        ("id", pa.string()),
        ("kind", pa.string()),
        ("split", pa.string()),
        ("garment", pa.string()),
        ("design", pa.string()),
        ("shape", pa.string()),
        ("sequence", pa.string()),
        ("topology", pa.string()),
        ("fabric", pa.string()),
        ("body", pa.string()),
        ("frames", pa.int64()),
        ("fps", pa.float64()),
        ("vertices", pa.int64()),
        ("seed", pa.int64()),
        ("cloth_cloth_intersections", pa.int64()),
        ("cloth_body_intersections", pa.int64()),
        ("masked_body_faces_max", pa.int64()),
        ("min_distance_m", pa.float64()),
        ("force_residual", pa.float64()),
        ("largest_strain", pa.float64()),
        ("seconds", pa.float64()),
        ("bytes", pa.int64()),
        ("geometry_sha256", pa.string()),
    ]
)

TOPOLOGIES = pa.field("topologies", pa.int64())
"""A column that only the index of a dataset with a remeshed sequence has: distinct meshes of each sample."""

_FROM_CERTIFICATE = (
    "cloth_cloth_intersections",
    "cloth_body_intersections",
    "masked_body_faces_max",
    "min_distance_m",
    "force_residual",
    "largest_strain",
    "seconds",
)


def read_row(root: Root, sample_id: str) -> dict[str, Any]:
    """The row of a sample, read from its file. Raises InputError if that is damaged."""
    meta, checksums = store.read_meta(root, sample_id)
    return row_of(meta, checksums, store.stored_bytes(root, sample_id))


def row_of(meta: Mapping[str, Any], checksums: Mapping[str, str], size: int) -> dict[str, Any]:
    """The row of a sample of which `meta` and checksums are known; its split is the header's to say."""
    labels, certificate = meta["labels"], meta["certificate"]
    values = {
        "id": meta["id"],
        "kind": meta["kind"],
        "split": "",
        "garment": meta["garment"]["name"],
        "design": labels.get("design", meta["garment"]["name"]),
        "shape": labels.get("shape", ""),
        "sequence": labels.get("sequence", ""),
        "topology": labels.get("topology", ""),
        "fabric": meta["fabric"],
        "body": (meta["body"] or {}).get("model", ""),
        "frames": meta["frames"],
        "fps": meta["fps"],
        "vertices": meta["vertices"],
        "topologies": meta.get("topologies", 1),
        "seed": meta["seed"],
        "bytes": size,
        "geometry_sha256": store.geometry_digest(checksums),
    }
    return values | {key: certificate[key] for key in _FROM_CERTIFICATE}


def write_index(
    root: Root, header: Header, known: Mapping[str, dict[str, Any]] | None = None
) -> tuple[dict[str, Any], ...]:
    """Write the rows of all samples that are there, in plan order, replacing the index in one step; return
    them.

    known   {id: row} of samples that need not be read
    """
    ids = in_plan_order(header, store.stored_ids(root))
    rows = _rows(root, header, ids, known or {})
    remeshed = any(entry["topologies"] > 1 for entry in rows)
    table = pa.Table.from_pylist(rows, schema=COLUMNS.append(TOPOLOGIES) if remeshed else COLUMNS)
    sink = io.BytesIO()
    pq.write_table(table, sink)
    root.write(INDEX, sink.getvalue())
    return rows


def read_index(root: Root, header: Header) -> tuple[dict[str, Any], ...]:
    """Rows of all samples, in plan order.

    Rows that the index lacks (a run was killed before it wrote them) are read from the samples; a row whose
    sample is gone is kept, so that the loss is seen. Raises InputError if the index or a sample is damaged.
    """
    known = stored_rows(root)
    ids = in_plan_order(header, {*known, *store.stored_ids(root)})
    return _rows(root, header, ids, known)


def _rows(
    root: Root, header: Header, ids: Iterable[str], known: Mapping[str, dict[str, Any]]
) -> tuple[dict[str, Any], ...]:
    found = (known[sample_id] if sample_id in known else read_row(root, sample_id) for sample_id in ids)
    return tuple(entry | {"split": header.splits.get(entry["id"], "")} for entry in found)


def stored_rows(root: Root) -> dict[str, dict[str, Any]]:
    """{id: row} of the index file; empty without a file. Raises InputError if it is damaged."""
    try:
        data = root.read(INDEX)
    except FileNotFoundError:
        return {}
    path = root.place(INDEX)
    try:
        table = pq.read_table(io.BytesIO(data))
    except (pa.ArrowException, OSError) as error:
        raise InputError(f"{path}: not readable ({error}); {_REBUILD}") from error
    if table.schema.names not in (COLUMNS.names, COLUMNS.append(TOPOLOGIES).names):
        raise InputError(f"{path}: columns are not those of an index; {_REBUILD}")
    rows = ({TOPOLOGIES.name: 1} | entry for entry in table.to_pylist())
    return {entry["id"]: entry for entry in rows}


_REBUILD = "delete it, it is rebuilt from the samples"


def in_plan_order(header: Header, ids: Iterable[str]) -> list[str]:
    """Planned ids in the order of the plan, then any others sorted."""
    present = set(ids)
    planned = [sample_id for sample_id in header.splits if sample_id in present]
    return planned + sorted(present - header.splits.keys())
