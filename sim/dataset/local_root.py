"""A dataset in a local folder, or one that the system mounts like it."""

from __future__ import annotations

import errno
import os
from collections.abc import Hashable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from muslin.garments.errors import InputError
from muslin.sim.dataset import durable
from muslin.sim.dataset.root import Root
from muslin.sim.dataset.schema import LOCK, PARTIAL


@dataclass(frozen=True)
class LocalRoot(Root):
    """Files survive a crash of the machine as soon as a write returns."""

    path: Path

    def __str__(self) -> str:
        return str(self.path)

    def exists(self, name: str) -> bool:
        return (self.path / name).is_file()

    def names(self, folder: str = "") -> list[str]:
        try:
            return sorted(entry.name for entry in os.scandir(self.path / folder) if entry.name[0] != ".")
        except FileNotFoundError:
            return []
        except NotADirectoryError as error:
            raise InputError(
                f"{self.path / folder}: is a file, or would lie in one; choose another place"
            ) from error

    def size(self, name: str) -> int:
        return (self.path / name).stat().st_size

    def read(self, name: str, start: int = 0, stop: int | None = None) -> bytes:
        with (self.path / name).open("rb") as stream:
            stream.seek(start, os.SEEK_SET if start >= 0 else os.SEEK_END)
            return stream.read(-1 if stop is None else stop - start)

    def write(self, name: str, data: bytes) -> None:
        self._make_folder(name)
        os.replace(self._unfinished(name, data), self.path / name)
        durable.sync((self.path / name).parent)

    def create(self, name: str, data: bytes) -> bool:
        final = self.path / name
        if final.exists():
            return False
        self._make_folder(name)
        partial = self._unfinished(name, data)
        try:
            os.link(partial, final)
        except FileExistsError:
            return False
        except OSError as error:  # no hard links here: then two writers are told apart by the lock alone
            if error.errno not in (errno.EPERM, errno.ENOTSUP, errno.ENOSYS):
                raise
            os.replace(partial, final)
            return True
        finally:
            partial.unlink(missing_ok=True)
            durable.sync(final.parent)
        return True

    def move(self, name: str, to: str) -> None:
        self._make_folder(to)
        durable.move(self.path / name, self.path / to)

    def remove(self, name: str) -> None:
        (self.path / name).unlink(missing_ok=True)

    def stamp(self, name: str) -> Hashable:
        try:
            status = (self.path / name).stat()
        except FileNotFoundError:
            return None
        return status.st_ino, status.st_mtime_ns, status.st_size

    def prepare(self) -> None:
        durable.make_folder(self.path / PARTIAL)

    def clean(self) -> None:
        for entry in (self.path / PARTIAL).iterdir():
            entry.unlink()

    @contextmanager
    def lock(self) -> Iterator[None]:
        with durable.exclusive(self.path / LOCK):
            yield

    def _make_folder(self, name: str) -> None:
        durable.make_folder((self.path / name).parent)

    def _unfinished(self, name: str, data: bytes) -> Path:
        durable.make_folder(self.path / PARTIAL)
        partial = self.path / PARTIAL / f"{name.replace('/', '-')}.{os.getpid()}"
        try:
            durable.write_through(partial, data)
        except OSError:
            partial.unlink(missing_ok=True)  # a full disk is not to be kept full by what nobody can use
            raise
        return partial
