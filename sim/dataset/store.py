"""Samples to zarr groups and back: lossless, checked by sha256, committed whole or not at all."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import zarr

from muslin.garments.errors import InputError
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.cloth_arrays import cloth_arrays, cloth_of
from muslin.sim.dataset.codecs import create_array, numcodecs_unremarked
from muslin.sim.dataset.header import digest
from muslin.sim.dataset.packed import PackedStore, pack
from muslin.sim.dataset.remeshed import RemeshedSequence
from muslin.sim.dataset.root import Root, StoreError
from muslin.sim.dataset.sample import BodyTrack, Sample
from muslin.sim.dataset.schema import (
    ARRAYS,
    REMESHED_ARRAYS,
    REMESHED_SAMPLE_VERSION,
    SAMPLE_VERSION,
    SAMPLES,
    SUFFIX,
    ArraySpec,
)

UNREADABLE = (
    *(OSError, ValueError, LookupError, TypeError),
    *(RuntimeError, ArithmeticError, AttributeError),
)
"""What zarr and its codecs raise over damaged files."""
REMEDY = "run `muslin repair` to make the sample again, or restore it from a copy"


@contextmanager
def damage_told(place: str, what: str = "not readable") -> Iterator[None]:
    """Tell of damage that is found in the block, to what lies at `place`, as an InputError.

    A store that is out of reach is no damage: its StoreError passes.
    """
    try:
        yield
    except StoreError:
        raise
    except UNREADABLE as error:
        raise InputError(f"{place}: {what} ({error}); {REMEDY}") from error


def sample_name(sample_id: str) -> str:
    """Name of a sample's file under the root."""
    return f"{SAMPLES}/{sample_id}{SUFFIX}"


def sample_file(folder: Path, sample_id: str) -> Path:
    """A sample's file in the local folder of a dataset."""
    return folder / sample_name(sample_id)


def stored_ids(root: Root) -> list[str]:
    """Ids of the samples that are there, sorted."""
    return [name.removesuffix(SUFFIX) for name in root.names(SAMPLES) if name.endswith(SUFFIX)]


@dataclass(frozen=True)
class Stored:
    """What was committed. new: False if a sample of that id was there already; that one was kept."""

    new: bool
    meta: dict[str, Any]
    checksums: dict[str, str]
    size: int


def write_sample(root: Root, sample: Sample) -> Stored:
    """Commit a sample under its id.

    Raises InputError if the sample's arrays cannot be (see `Sample.validate`).
    """
    sample.validate()
    for garment in sample.garments:
        garment.validate()
    specs = ARRAYS | REMESHED_ARRAYS if isinstance(sample, RemeshedSequence) else ARRAYS
    arrays = _arrays(sample, specs)
    meta = _meta(sample)
    checksums = {name: _sha256(array) for name, array in arrays.items()}
    memory = zarr.storage.MemoryStore()
    group = zarr.create_group(
        memory,
        attributes={"meta": meta, "meta_sha256": digest(meta), "sha256": checksums},
    )
    for name, array in arrays.items():
        create_array(group, name, array, specs[name])
    data = pack(memory)
    return Stored(root.create(sample_name(sample.id), data), meta, checksums, len(data))


def read_meta(root: Root, sample_id: str) -> tuple[dict[str, Any], dict[str, str]]:
    """What a sample says of itself apart from arrays, and the sha256 of each array.

    Raises InputError if the sample is missing, damaged or of a newer schema.
    """
    return meta_of(open_sample(root, sample_id), sample_place(root, sample_id))


def sample_place(root: Root, sample_id: str) -> str:
    """A sample's file as messages name it."""
    return root.place(sample_name(sample_id))


def open_sample(root: Root, sample_id: str) -> zarr.Group:
    """The zarr group of a sample, to be read. Raises InputError if it is missing or no such group."""
    place = sample_place(root, sample_id)
    with damage_told(place):
        try:
            store = PackedStore(root, sample_name(sample_id))
        except FileNotFoundError as error:
            raise InputError(
                f"{place}: the sample is missing; run `muslin generate` again to make it"
            ) from error
    with damage_told(f"{place}/zarr.json"):
        return zarr.open_group(store, mode="r", zarr_format=3)


def meta_of(group: zarr.Group, place: str) -> tuple[dict[str, Any], dict[str, str]]:
    """`read_meta` of a sample that is open."""
    attributes = dict(group.attrs)
    meta, checksums = attributes.get("meta"), attributes.get("sha256")
    if not isinstance(meta, dict) or not isinstance(checksums, dict):
        raise InputError(f"{place}/zarr.json: not the attributes of a sample; {REMEDY}")
    found = meta.get("schema_version")
    if isinstance(found, int) and found > REMESHED_SAMPLE_VERSION:
        raise InputError(
            f"{place}: schema_version = {found} is newer than {REMESHED_SAMPLE_VERSION}, "
            "the newest that this program reads; update muslin (pip install -U muslin)"
        )
    try:
        matches = attributes.get("meta_sha256") == digest(meta)
    except ValueError:  # NaN, which was never written
        matches = False
    if not matches:
        raise InputError(f"{place}/zarr.json: attributes do not match their checksum; {REMEDY}")
    return meta, checksums


def read_sample(root: Root, sample_id: str) -> Sample:
    """A sample with all its arrays, each checked against its sha256. Raises InputError as `read_meta`."""
    group, place = open_sample(root, sample_id), sample_place(root, sample_id)
    meta, checksums = meta_of(group, place)
    arrays = {name: _read_array(group, place, name, checksum) for name, checksum in checksums.items()}
    try:
        sample = _assemble(meta, arrays).validate()
    except InputError as error:
        raise InputError(f"{place}: {error}; {REMEDY}") from error
    except KeyError as error:
        raise InputError(f"{place}: the sample lacks {error}; {REMEDY}") from error
    except UNREADABLE as error:
        raise InputError(f"{place}: not a sample ({error}); {REMEDY}") from error
    if sample.id != sample_id:
        raise InputError(f"{place}: holds sample {sample.id!r}; rename the file to {sample.id}{SUFFIX}")
    return sample


def read_array(root: Root, sample_id: str, name: str) -> np.ndarray:
    """One checked array of a sample (names in `schema.ARRAYS`), without reading the others."""
    group, place = open_sample(root, sample_id), sample_place(root, sample_id)
    _, checksums = meta_of(group, place)
    if name not in checksums:
        raise InputError(f"{place}: has no array {name!r}; it has {', '.join(sorted(checksums))}")
    return _read_array(group, place, name, checksums[name])


def geometry_digest(checksums: Mapping[str, str]) -> str:
    """One sha256 (hex) of all arrays of a sample: equal exactly where the geometry is bit-identical."""
    return digest(dict(checksums))


def stored_bytes(root: Root, sample_id: str) -> int:
    """Size of a sample's file."""
    return root.size(sample_name(sample_id))


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


def _read_array(group: zarr.Group, place: str, name: str, checksum: str) -> np.ndarray:
    with damage_told(f"{place}/{name}"), numcodecs_unremarked():
        array = np.asarray(group[name][...])  # type: ignore[index]
    if _sha256(array) != checksum:
        raise InputError(f"{place}/{name}: bytes do not match their sha256; {REMEDY}")
    return array


def _sha256(array: np.ndarray) -> str:
    head = f"{array.dtype.newbyteorder('<').str}{array.shape}".encode()
    return hashlib.sha256(head + np.ascontiguousarray(array).tobytes()).hexdigest()
