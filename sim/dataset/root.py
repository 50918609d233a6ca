"""Where a dataset lies: a local folder, or a place in an object store. Files are whole or not there."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Hashable
from contextlib import AbstractContextManager
from pathlib import Path

from muslin.garments.errors import InputError


class StoreError(InputError, OSError):
    """A store that did not answer as it should, time after time: it says nothing of what lies there."""


class Root(ABC):
    """The files of one dataset, by names relative to it with `/` between folders.

    Two roots of one place are equal, and a root can be sent to another process. A file that is not there
    raises FileNotFoundError; anything else that hinders an access is an OSError.
    """

    @abstractmethod
    def __str__(self) -> str:
        """The place, as a user gives it."""

    @abstractmethod
    def exists(self, name: str) -> bool:
        """Whether there is such a file."""

    @abstractmethod
    def names(self, folder: str = "") -> list[str]:
        """Names of what lies in a folder, sorted; none if there is no such folder. Unfinished files are left
        out."""

    @abstractmethod
    def size(self, name: str) -> int:
        """Bytes of a file."""

    @abstractmethod
    def read(self, name: str, start: int = 0, stop: int | None = None) -> bytes:
        """Bytes start to stop of a file; a negative start counts from its end."""

    @abstractmethod
    def write(self, name: str, data: bytes) -> None:
        """Replace a file in one step: readers see the old bytes or the new ones, never a part."""

    @abstractmethod
    def create(self, name: str, data: bytes) -> bool:
        """Write a file where none is. False if one is there already; that one is kept."""

    @abstractmethod
    def move(self, name: str, to: str) -> None:
        """Move a file to a name that is free."""

    @abstractmethod
    def remove(self, name: str) -> None:
        """Remove a file, if it is there."""

    @abstractmethod
    def stamp(self, name: str) -> Hashable:
        """Differs when another file lies there; None if none does."""

    @abstractmethod
    def prepare(self) -> None:
        """Make the place if it is not there. Raises InputError if that cannot be."""

    @abstractmethod
    def clean(self) -> None:
        """Remove what killed writers left unfinished. The caller holds the lock."""

    @abstractmethod
    def lock(self) -> AbstractContextManager[None]:
        """Be the only one that holds it, for as long as the block runs.

        A holder that died does not hold it. Raises InputError if another process holds it.
        """

    def place(self, name: str) -> str:
        """A file as messages name it."""
        return f"{self}/{name}"


def open_root(place: str | Path | Root) -> Root:
    """The root of a folder's path, or of a URL that fsspec knows ("s3://bucket/name")."""
    if isinstance(place, Root):
        return place
    if isinstance(place, str) and "://" in place:
        from muslin.sim.dataset.remote_root import RemoteRoot

        return RemoteRoot(place.rstrip("/"))
    from muslin.sim.dataset.local_root import LocalRoot

    return LocalRoot(Path(place))
