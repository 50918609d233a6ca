"""`muslin.json`: what a dataset says of itself, and whether a folder may be written to."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from muslin.garments.errors import InputError
from muslin.sim.dataset.root import Root
from muslin.sim.dataset.schema import CARD, FORMAT, HEADER, PICTURE, PROGRESS, SAMPLES, SCHEMA_VERSION


def canonical(value: Any) -> bytes:
    """JSON with sorted keys and no blanks: the same bytes for the same value."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def digest(value: Any) -> str:
    """sha256 (hex) of the canonical JSON of a value."""
    return hashlib.sha256(canonical(value)).hexdigest()


def installed_versions() -> dict[str, str]:
    """Versions of what the geometry of a sample depends on."""
    versions = {"python": platform.python_version()}
    for package in ("muslin", "numpy", "scipy", "warp-lang", "ipctk", "zarr"):
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            versions[package] = "not installed"
    return versions


@dataclass(frozen=True)
class Header:
    """config: what the dataset was made from; splits: {sample id: split} of every planned sample, in plan
    order."""

    config: dict[str, Any]
    splits: dict[str, str]
    solver_digest: str = ""
    versions: dict[str, str] = field(default_factory=installed_versions)
    format: str = FORMAT
    schema_version: int = SCHEMA_VERSION

    @property
    def config_hash(self) -> str:
        return digest(self.config)

    def write(self, root: Root) -> None:
        root.write(HEADER, (json.dumps(asdict(self), indent=1) + "\n").encode())


def read_header(root: Root) -> Header:
    """The header of a dataset.

    Raises InputError if the folder is no dataset, its header is damaged, or its schema is newer than this
    program.
    """
    path = root.place(HEADER)
    try:
        values = json.loads(root.read(HEADER))
    except (FileNotFoundError, NotADirectoryError) as error:
        raise InputError(
            f"{root}: no muslin dataset here ({HEADER} is missing); give the folder of a dataset"
        ) from error
    except ValueError as error:
        raise InputError(f"{path}: not readable as JSON ({error}); {_RESTORE}") from error
    if not isinstance(values, dict) or values.get("format") != FORMAT:
        raise InputError(f"{path}: format must be {FORMAT!r}; give the folder of a dataset")
    found = values.get("schema_version")
    if not isinstance(found, int):
        raise InputError(f"{path}: schema_version = {found!r} is not a whole number; {_RESTORE}")
    if found > SCHEMA_VERSION:
        raise InputError(
            f"{path}: schema_version = {found} is newer than {SCHEMA_VERSION}, the newest that this "
            "program reads; update muslin (pip install -U muslin)"
        )
    if found < SCHEMA_VERSION:
        raise InputError(
            f"{path}: schema_version = {found} is older than {SCHEMA_VERSION}, the oldest that this program "
            "reads; generate the dataset again, or read it with the muslin that made it"
        )
    try:
        return Header(**values)
    except TypeError as error:
        raise InputError(f"{path}: {error}; {_RESTORE}") from error


def prepare_root(root: Root, header: Header) -> Header | None:
    """Make a place ready to hold the samples of a header; return the header that was there before, if any.

    Raises InputError, touching nothing, if the place holds anything but a dataset, or a dataset of which
    some planned sample is not planned by the new header: only an extension may go on in the same place.
    """
    before = read_header(root) if root.exists(HEADER) else None
    if before is None:
        strangers = [name for name in root.names() if name not in (CARD, PICTURE, PROGRESS, SAMPLES)]
        if strangers:
            raise InputError(
                f"{root}: not empty ({', '.join(strangers[:3])}…) and no muslin dataset; "
                "give an empty or new folder"
            )
    if before is not None:
        dropped = [sample for sample in before.splits if sample not in header.splits]
        if dropped:
            differs = describe_difference(before.config, header.config) or "the way samples are named"
            raise InputError(
                f"{root}: holds a dataset of another config, {len(dropped)} of whose {len(before.splits)} "
                f"samples the new one has not; differs: {differs}; "
                "write to another folder, or only extend the config"
            )
    root.prepare()
    return before


def describe_difference(before: Mapping[str, Any], after: Mapping[str, Any], most: int = 6) -> str:
    """ "key: old -> new" of every leaf that differs, in one line."""
    old, new = _leaves(before), _leaves(after)
    keys = [key for key in sorted(old.keys() | new.keys()) if old.get(key) != new.get(key)]
    lines = [f"{key}: {old.get(key, 'absent')} -> {new.get(key, 'absent')}" for key in keys[:most]]
    return ", ".join(lines) + (f" and {len(keys) - most} more" if len(keys) > most else "")


def _leaves(value: Any, prefix: str = "") -> dict[str, Any]:
    if isinstance(value, Mapping) and value:
        pairs = [(f"{prefix}.{key}" if prefix else str(key), entry) for key, entry in value.items()]
    elif isinstance(value, list) and any(isinstance(entry, Mapping | list) for entry in value):
        pairs = [(f"{prefix}[{index}]", entry) for index, entry in enumerate(value)]
    else:
        return {prefix: value}
    return {key: leaf for name, entry in pairs for key, leaf in _leaves(entry, name).items()}


_RESTORE = "restore it from a copy, or generate the dataset again in a new folder"
