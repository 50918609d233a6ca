"""Samples to zarr groups and back: lossless, checked by sha256, committed whole or not at all."""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import zarr

from muslin.garments.errors import InputError
from muslin.sim.dataset import durable
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.cloth_arrays import cloth_arrays, cloth_of
from muslin.sim.dataset.codecs import create_array, numcodecs_unremarked
from muslin.sim.dataset.header import digest
from muslin.sim.dataset.remeshed import RemeshedSequence
from muslin.sim.dataset.sample import BodyTrack, Sample
from muslin.sim.dataset.schema import (
    ARRAYS,
    PARTIAL,
    REMESHED_ARRAYS,
    REMESHED_SAMPLE_VERSION,
    SAMPLE_VERSION,
    SAMPLES,
    SUFFIX,
    ArraySpec,
)

REMEDY = "run `muslin repair` to make the sample again, or restore it from a copy"


def sample_path(root: Path, sample_id: str) -> Path:
    return root / SAMPLES / f"{sample_id}{SUFFIX}"


def stored_ids(root: Path) -> list[str]:
    """Ids of the samples that are there, sorted."""
    folder = root / SAMPLES
    if not folder.is_dir():
        return []
    return sorted(p.name.removesuffix(SUFFIX) for p in folder.iterdir() if p.name.endswith(SUFFIX))


def clean_partial(root: Path) -> None:
    """Remove what a killed writer left half-written."""
    for entry in (root / PARTIAL).iterdir():
        shutil.rmtree(entry)
    for file in root.glob(".*.tmp"):
        file.unlink()


def write_sample(root: Path, sample: Sample) -> bool:
    """Commit a sample under its id. False if a sample of that id was there already; that one is kept.

    Raises InputError if the sample's arrays cannot be (see `Sample.validate`).
    """
    sample.validate()
    for garment in sample.garments:
        garment.validate()
    specs = ARRAYS | REMESHED_ARRAYS if isinstance(sample, RemeshedSequence) else ARRAYS
    arrays = _arrays(sample, specs)
    meta = _meta(sample)
    checksums = {name: _sha256(array) for name, array in arrays.items()}
    partial = root / PARTIAL / f"{sample.id}-{os.getpid()}{SUFFIX}"
    group = zarr.create_group(
        zarr.storage.LocalStore(partial),
        attributes={"meta": meta, "meta_sha256": digest(meta), "sha256": checksums},
    )
    for name, array in arrays.items():
        create_array(group, name, array, specs[name])
    return durable.commit_directory(partial, sample_path(root, sample.id))


def read_meta(root: Path, sample_id: str) -> tuple[dict[str, Any], dict[str, str]]:
    """What a sample says of itself apart from arrays, and the sha256 of each array.

    Raises InputError if the sample is missing, damaged or of a newer schema.
    """
    path = sample_path(root, sample_id)
    if not path.is_dir():
        raise InputError(f"{path}: the sample is missing; run `muslin generate` again to make it")
    attributes = dict(_open(path).attrs)
    meta, checksums = attributes.get("meta"), attributes.get("sha256")
    if not isinstance(meta, dict) or not isinstance(checksums, dict):
        raise InputError(f"{path}/zarr.json: not the attributes of a sample; {REMEDY}")
    if meta.get("schema_version", 0) > REMESHED_SAMPLE_VERSION:
        raise InputError(
            f"{path}: schema_version = {meta['schema_version']} is newer than {REMESHED_SAMPLE_VERSION}, the "
            "newest that  this program reads; update muslin (pip install -U muslin)"
        )
    if attributes.get("meta_sha256") != digest(meta):
        raise InputError(f"{path}/zarr.json: attributes do not match their checksum; {REMEDY}")
    return meta, checksums


def read_sample(root: Path, sample_id: str) -> Sample:
    """A sample with all its arrays, each checked against its sha256. Raises InputError as `read_meta`."""
    meta, checksums = read_meta(root, sample_id)
    path = sample_path(root, sample_id)
    group = _open(path)
    arrays = {name: _read_array(group, path, name, checksum) for name, checksum in checksums.items()}
    try:
        sample = _assemble(meta, arrays)
    except (KeyError, TypeError) as error:
        raise InputError(f"{path}: the sample lacks {error}; {REMEDY}") from error
    except InputError as error:
        raise InputError(f"{path}: {error}; {REMEDY}") from error
    if sample.id != sample_id:
        raise InputError(f"{path}: holds sample {sample.id!r}; rename the folder to {sample.id}{SUFFIX}")
    return sample.validate()


def read_array(root: Path, sample_id: str, name: str) -> np.ndarray:
    """One checked array of a sample (names in `schema.ARRAYS`), without reading the others."""
    _, checksums = read_meta(root, sample_id)
    path = sample_path(root, sample_id)
    if name not in checksums:
        raise InputError(f"{path}: has no array {name!r}; it has {', '.join(sorted(checksums))}")
    return _read_array(_open(path), path, name, checksums[name])


def geometry_digest(checksums: Mapping[str, str]) -> str:
    """One sha256 (hex) of all arrays of a sample: equal exactly where the geometry is bit-identical."""
    return digest(dict(checksums))


def stored_bytes(root: Path, sample_id: str) -> int:
    """Size of a sample on disk, bytes."""
    return sum(p.stat().st_size for p in sample_path(root, sample_id).rglob("*") if p.is_file())


def _arrays(sample: Sample, specs: Mapping[str, ArraySpec]) -> dict[str, np.ndarray]:
    arrays: dict[str, np.ndarray | None] = {**cloth_arrays(sample)}
    if sample.body is not None:
        arrays |= {name: getattr(sample.body, name) for name in ("beta", "poses", "translations")}
    arrays["obstacle_vertices"] = sample.obstacle_vertices
    arrays["obstacle_faces"] = sample.obstacle_faces
    if sample.masked_faces:
        arrays["masked_counts"] = np.array([len(indices) for indices in sample.masked_faces], dtype=np.int32)
        arrays["masked_indices"] = np.concatenate(sample.masked_faces).astype(np.int32)
    return {
        name: np.ascontiguousarray(array, dtype=np.dtype(specs[name].dtype).newbyteorder("<"))
        for name, array in arrays.items()
        if array is not None
    }


def _meta(sample: Sample) -> dict[str, Any]:
    body = None if sample.body is None else {"model": sample.body.model, "digest": sample.body.digest}
    garment = sample.frame_garment(0)
    remeshed = isinstance(sample, RemeshedSequence)
    meta = {
        "schema_version": REMESHED_SAMPLE_VERSION if remeshed else SAMPLE_VERSION,
        "id": sample.id,
        "kind": sample.kind,
        "fps": sample.fps,
        "frames": sample.num_frames,
        "vertices": sample.num_vertices,
        "garment": {
            "name": garment.name,
            "panel_names": list(garment.panel_names),
            "parameters": {key: float(value) for key, value in garment.parameters.items()},
        },
        "body": body,
        "fabric": sample.fabric,
        "seed": sample.seed,
        "labels": {key: value for key, value in sample.labels.items() if key != "split"},
        "scene": sample.scene,
        "certificate": sample.certificate.to_dict(),
    }
    return meta | {"topologies": len(sample.garments)} if remeshed else meta


def _assemble(meta: dict[str, Any], arrays: dict[str, np.ndarray]) -> Sample:
    body = None
    if meta["body"] is not None:
        track = {name: arrays[name] for name in ("beta", "poses", "translations")}
        body = BodyTrack(model=meta["body"]["model"], digest=meta["body"]["digest"], **track)
    masked: tuple[np.ndarray, ...] = ()
    if "masked_counts" in arrays:
        masked = tuple(np.split(arrays["masked_indices"], np.cumsum(arrays["masked_counts"])[:-1]))
    cloth = cloth_of(meta["garment"], arrays)
    form = RemeshedSequence if "topologies" in cloth else Sample
    return form(
        **cloth,
        id=meta["id"],
        kind=meta["kind"],
        certificate=Certificate.from_dict(meta["certificate"]),
        fps=meta["fps"],
        body=body,
        obstacle_vertices=arrays.get("obstacle_vertices"),
        obstacle_faces=arrays.get("obstacle_faces"),
        masked_faces=masked,
        fabric=meta["fabric"],
        scene=meta["scene"],
        seed=meta["seed"],
        labels=meta["labels"],
    )


def _read_array(group: zarr.Group, path: Path, name: str, checksum: str) -> np.ndarray:
    try:
        with numcodecs_unremarked():
            array = np.asarray(group[name][...])  # type: ignore[index]
    except (OSError, ValueError, KeyError, TypeError, RuntimeError) as error:
        raise InputError(f"{path}/{name}: not readable ({error}); {REMEDY}") from error
    if _sha256(array) != checksum:
        raise InputError(f"{path}/{name}: bytes do not match their sha256; {REMEDY}")
    return array


def _open(path: Path) -> zarr.Group:
    try:
        return zarr.open_group(zarr.storage.LocalStore(path, read_only=True), mode="r", zarr_format=3)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}/zarr.json: not readable ({error}); {REMEDY}") from error


def _sha256(array: np.ndarray) -> str:
    head = f"{array.dtype.newbyteorder('<').str}{array.shape}".encode()
    return hashlib.sha256(head + np.ascontiguousarray(array).tobytes()).hexdigest()
