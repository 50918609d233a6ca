"""A dataset in an object store, or in any place that fsspec knows."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeVar

import fsspec
from fsspec.core import url_to_fs

from muslin.garments.errors import InputError
from muslin.sim.dataset.lease import hold_lease
from muslin.sim.dataset.root import Root, StoreError
from muslin.sim.dataset.schema import LOCK

Found = TypeVar("Found")

WAITS_S = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 60.0)
"""Pauses between tries of an access that fails; the clients of stores try some times of their own at each."""
_FIRST_WAITS_S = WAITS_S[:2]
"""As long as this process has had no answer yet: an address that is wrong is told soon."""
_answered: set[str] = set()


@dataclass(frozen=True)
class RemoteRoot(Root):
    """Objects appear whole and at once, as stores promise; `create` asks the store to refuse what is there
    (If-None-Match), so that of two writers one is told.

    url   such as "s3://bucket/name"; keys and endpoints come from the environment or fsspec's configuration
    """

    url: str

    def __str__(self) -> str:
        return self.url

    def exists(self, name: str) -> bool:
        return self.stamp(name) is not None  # `isfile` of fsspec takes a store that fails for an absent file

    def names(self, folder: str = "") -> list[str]:
        def listed(fs: Any, path: str) -> list[str]:
            try:
                found = fs.ls(path, detail=False)
            except FileNotFoundError:
                return []
            inside = [entry.rstrip("/").removeprefix(path.rstrip("/") + "/") for entry in found]
            return sorted(entry for entry in inside if entry and "/" not in entry and entry[0] != ".")

        return self._try(listed, folder)

    def size(self, name: str) -> int:
        return int(self._try(lambda fs, path: fs.size(path), name))

    def read(self, name: str, start: int = 0, stop: int | None = None) -> bytes:
        part: dict[str, int | None] = {} if start == 0 and stop is None else {"start": start, "end": stop}
        return self._try(lambda fs, path: fs.cat_file(path, **part), name)

    def write(self, name: str, data: bytes) -> None:
        self._try(lambda fs, path: fs.pipe_file(path, data), name)

    def create(self, name: str, data: bytes) -> bool:
        try:
            self._try(lambda fs, path: fs.pipe_file(path, data, mode="create"), name)
        except FileExistsError:  # also where a try before this one came through, but its answer was lost
            return False
        return True

    def move(self, name: str, to: str) -> None:
        self._try(lambda fs, path: fs.copy(path, self._path(fs, to)), name)
        self.remove(name)

    def remove(self, name: str) -> None:
        def gone(fs: Any, path: str) -> None:
            try:
                fs.rm_file(path)
            except FileNotFoundError:
                return

        self._try(gone, name)

    def stamp(self, name: str) -> Hashable:
        def seen(fs: Any, path: str) -> Hashable:
            try:
                found = fs.info(path)
            except FileNotFoundError:
                return None
            return str(found.get("ETag") or found.get("mtime") or found.get("created")), found["size"]

        return self._try(seen, name)

    def prepare(self) -> None:
        """A store has no folders; one that cannot be reached, or lacks the bucket, is told here."""

        def reach(fs: Any, path: str) -> None:
            bucket = path.split("/", 1)[0]
            if bucket:
                fs.info(bucket)

        try:
            self._try(reach, "")
        except StoreError:
            raise
        except OSError as error:
            raise InputError(
                f"{self}: cannot be used ({error}); make the bucket, or check address and keys"
            ) from error

    def clean(self) -> None:
        """What a killed writer left unfinished was never there."""

    @contextmanager
    def lock(self) -> Iterator[None]:
        with hold_lease(self, LOCK):
            yield

    def _path(self, fs: Any, name: str) -> str:
        return str(fs._strip_protocol(f"{self.url}/{name}" if name else self.url))

    def _try(self, access: Callable[[Any, str], Found], name: str) -> Found:
        """access(file system, path of `name`), again where the store fails."""
        try:
            fs = _file_system(self.url)
        except (ImportError, ValueError) as error:
            known = ", ".join(sorted(fsspec.available_protocols()))
            raise InputError(f"{self}: no store of this kind ({error}); fsspec knows {known}") from error
        path = self._path(fs, name)
        waits = WAITS_S if self.url in _answered else _FIRST_WAITS_S
        for wait in (*waits, None):
            try:
                found = access(fs, path)
            except (FileNotFoundError, FileExistsError, PermissionError, NotImplementedError):
                _answered.add(self.url)
                raise
            except Exception as error:  # clients of stores raise errors of their own kinds
                if wait is None:
                    raise StoreError(
                        f"{self.place(name)}: the store failed {len(waits) + 1} times "
                        f"({type(error).__name__}: {error})"
                    ) from error
            else:
                _answered.add(self.url)
                return found
            time.sleep(wait)
        raise AssertionError


@lru_cache
def _file_system(url: str) -> Any:
    """One a process; without a cache of listings, which others change."""
    return url_to_fs(url, use_listings_cache=False)[0]
