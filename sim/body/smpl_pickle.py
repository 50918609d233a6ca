"""Reads SMPL's official pickles without executing anything in them.

A pickle is a program: it names functions and calls them. This reader knows a short list of names, maps each
to a plain stand-in that only stores what it is given, and refuses the file at the first other name, before
anything is called.
"""

from __future__ import annotations

import mmap
import pickle
import pickletools
from collections.abc import Collection
from pathlib import Path
from typing import IO, Any, cast

from muslin.garments.errors import InputError
from muslin.sim.body.pickle_stand_ins import ALLOWED, resolve

# What unpickling a damaged file can raise.
DAMAGE = (
    pickle.UnpicklingError, EOFError, ValueError, TypeError, AttributeError, LookupError, OverflowError,
    MemoryError, RecursionError,
)  # fmt: skip

_MEMO = ("PUT", "BINPUT", "LONG_BINPUT", "GET", "BINGET", "LONG_BINGET")


class ForbiddenPickleError(InputError):
    """A pickle that asks for more than arrays."""


class ArrayUnpickler(pickle.Unpickler):
    """Unpickles arrays, dictionaries, lists, numbers and text; refuses every other name."""

    def __init__(self, stream: IO[bytes]) -> None:
        # latin1 maps bytes to text one to one, so Python 2's array buffers survive
        super().__init__(stream, fix_imports=False, encoding="latin1")

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in ALLOWED:
            raise ForbiddenPickleError(
                f"the pickle asks for {module}.{name}, which no SMPL file needs; refused, nothing was run; "
                "get the file from its original source"
            )
        return ALLOWED[module, name]

    def persistent_load(self, pid: Any) -> Any:
        raise ForbiddenPickleError("the pickle refers to objects outside itself; refused, nothing was run")


def check_lengths(stream: IO[bytes]) -> None:
    """Raise ValueError for a string longer than the file and for a memo larger than it.

    The unpickler would allocate both before it finds the file too short.
    """
    with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as content:
        for opcode, argument, place in pickletools.genops(cast("IO[bytes]", content)):
            if opcode.name in _MEMO and argument is not None and int(argument) > len(content):
                raise ValueError(f"memo entry {argument} at byte {place} of {len(content)}")


def unpickle_arrays(stream: IO[bytes], label: str, keys: Collection[str] | None = None) -> Any:
    """What one pickle holds, with chumpy's and scipy's objects turned into numpy arrays.

    Args:
        label: names the file in messages.
        keys: of a dictionary, keep these entries only.

    Raises:
        InputError: a name besides the allowed ones, or a damaged pickle. Nothing is executed.
    """
    try:
        content = ArrayUnpickler(stream).load()
        if keys is not None and isinstance(content, dict):
            named = {_text(key): value for key, value in content.items()}
            content = {key: value for key, value in named.items() if key in keys}
        return resolve(content)
    except InputError as error:
        raise type(error)(f"{label}: {error}") from error
    except DAMAGE as error:
        raise InputError(
            f"{label}: no readable SMPL pickle ({type(error).__name__}: {error}); give an intact file"
        ) from error


def read_pickle(path: Path, keys: Collection[str]) -> dict[str, Any]:
    """The named arrays of an SMPL .pkl file.

    Raises:
        InputError: see `unpickle_arrays`; also if the pickle holds no dictionary.
    """
    with path.open("rb") as stream:
        try:
            check_lengths(stream)
        except DAMAGE as error:
            raise InputError(f"{path}: no readable SMPL pickle ({error}); give an intact file") from error
        content = unpickle_arrays(stream, str(path), keys)
    if not isinstance(content, dict):
        raise InputError(
            f"{path}: the pickle holds a {type(content).__name__}; an SMPL file holds a dictionary"
        )
    return content


def _text(key: Any) -> str:
    return key.decode("latin1") if isinstance(key, bytes) else str(key)
