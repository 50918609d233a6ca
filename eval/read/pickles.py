"""Pickled dictionaries of arrays, as HOOD and ContourCraft write them, read without running anything.

A pickle is a program. Of the names that it may call, this reader knows those that build NumPy arrays and
plain containers, each by a stand-in that stores what it is given; at the first other name the file is
refused.

HOOD's rollout is a dictionary: pred (T, V, 3), cloth_faces (F, 3), obstacle (T, N, 3), obstacle_faces (M, 3),
metres, y up, and figures of its own in metrics. It does not say its frame rate (30 in HOOD).

Source: Grigorev et al. (2023), "HOOD: Hierarchical Graphs for Generalized Modelling of Clothing Dynamics".
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from muslin.eval.read.content import Content, parsing
from muslin.eval.read.named_arrays import content_of, is_known
from muslin.garments.errors import InputError
from muslin.sim.body.pickle_stand_ins import ALLOWED, Array, Function, StandIn
from muslin.sim.body.smpl_pickle import (
    DAMAGE,
    ArrayUnpickler,
    ForbiddenPickleError,
    check_lengths,
)

_ARRAYS = {
    key: value
    for key, value in ALLOWED.items()
    if key[0].partition(".")[0] in ("numpy", "_codecs", "builtins", "__builtin__", "copyreg", "copy_reg")
}
_PLAIN: dict[tuple[str, str], Any] = {
    ("collections", "defaultdict"): Function(lambda *_: {}),
    ("collections", "OrderedDict"): Function(lambda *_: {}),
    # the factory of a defaultdict: named, never called
    ("builtins", "list"): Function(lambda *_: []),
    ("builtins", "dict"): Function(lambda *_: {}),
}
_READ = _ARRAYS | _PLAIN

# A list may name one array many times; beyond this size and so many times the file it is taken for a trap.
LARGE_BYTES, MOST_REPEATED = 1 << 30, 16


class _Unpickler(ArrayUnpickler):
    """Knows arrays and plain containers."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) in _READ:
            return _READ[module, name]
        remedy = "write plain NumPy arrays"
        if module.partition(".")[0] == "torch":
            remedy = "write NumPy arrays instead of tensors (tensor.cpu().numpy())"
        raise ForbiddenPickleError(
            f"the pickle asks for {module}.{name}, which no array needs; refused, nothing was run; {remedy}"
        )


def read_pickle(path: Path) -> Content:
    """The garment and body of a pickled dictionary, by the names of `named_arrays`; others are left out.

    Raises ForbiddenPickleError for a pickle that asks for more than arrays and containers, InputError for a
    damaged one or one without a garment.
    """
    try:
        with path.open("rb") as stream:
            check_lengths(stream)
            loaded = _Unpickler(stream).load()
    except InputError as error:
        raise type(error)(f"{path}: {error}") from error
    except DAMAGE as error:
        raise InputError(f"{path}: no readable pickle ({type(error).__name__}: {error})") from error
    if not isinstance(loaded, dict):
        raise InputError(
            f"{path}: the pickle holds a {type(loaded).__name__}; give a dictionary with 'vertices' or 'pred'"
        )
    named = {_text(key).lower(): value for key, value in loaded.items()}
    with parsing(path, "a pickle of arrays"):
        most = max(LARGE_BYTES, MOST_REPEATED * path.stat().st_size)
        arrays = {name: _array(value, name, most) for name, value in named.items() if is_known(name)}
    return content_of(arrays or dict.fromkeys(named, np.zeros(0)), path)


def _array(value: Any, name: str, most_bytes: int) -> np.ndarray:
    """An array, a number, or a list of one array a frame."""
    if not isinstance(value, (list, tuple)):
        return _plain(value, name)
    distinct = {id(item): item for item in value}
    arrays = {key: _plain(item, name) for key, item in distinct.items()}
    if sum(arrays[id(item)].nbytes for item in value) > most_bytes:
        raise InputError(f"'{name}' repeats arrays to more than {most_bytes} bytes; refused, write one array")
    return np.stack([arrays[id(item)] for item in value])


def _plain(value: Any, name: str) -> np.ndarray:
    if isinstance(value, Array) and value.state[-3].holds_objects:
        raise InputError(f"'{name}' is an array of objects; write an array of numbers")
    if isinstance(value, StandIn):
        value = value.resolve()
    elif not isinstance(value, (int, float)):
        raise InputError(f"'{name}' holds a {type(value).__name__}; write an array of numbers")
    array = np.asarray(value)
    if array.dtype.kind not in "fiub":
        raise InputError(f"'{name}' holds {array.dtype}, not plain numbers")
    return array


def _text(key: Any) -> str:
    return key.decode("latin1") if isinstance(key, bytes) else str(key)
