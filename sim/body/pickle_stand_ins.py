"""Plain objects that stand for what an SMPL pickle may name: they store what they are given, nothing more."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sparse
from numpy.typing import NDArray

from muslin.garments.errors import InputError


class StandIn:
    """An object of a pickle: keeps its state and turns into an array on `resolve`."""

    state: Any

    def __init__(self, *_: Any) -> None:
        self.state = None

    def __setstate__(self, state: Any) -> None:
        self.state = state

    def resolve(self) -> Any:
        raise InputError(f"the pickle holds a bare {type(self).__name__}, which is no array")


class Object(StandIn):
    """The name `object`, which older pickles hand to the constructor."""


class Dtype(StandIn):
    """numpy.dtype: numbers, booleans, text and references to other objects of the pickle."""

    def __init__(self, code: Any, *_: Any) -> None:
        self.code = code.decode("latin1") if isinstance(code, bytes) else str(code)
        self.state = None
        if self.code[:1] not in set("fiubSUO") or not self.code[1:].isdigit():
            raise InputError(
                f"a pickled array has dtype '{self.code}'; an SMPL file holds numbers and text only"
            )

    @property
    def holds_objects(self) -> bool:
        return self.code.startswith("O")

    def resolve(self) -> np.dtype[Any]:
        dtype = np.dtype(self.code)
        big_endian = self.state is not None and self.state[1] in (">", b">")
        return dtype.newbyteorder(">") if big_endian else dtype


class Array(StandIn):
    """numpy.ndarray; an array of objects becomes a list."""

    def resolve(self) -> Any:
        shape, dtype, fortran, raw = self.state[-4:]
        if dtype.holds_objects:
            return [resolve(item) for item in raw]
        return _array(raw, dtype, shape, "F" if fortran else "C")


class Buffer(StandIn):
    """numpy's `_frombuffer`, the array constructor of pickle protocol 5."""

    def __init__(self, raw: Any, dtype: Dtype, shape: tuple[int, ...], order: str) -> None:
        self.state = (raw, dtype, shape, order)

    def resolve(self) -> NDArray[Any]:
        return _array(*self.state)


class Scalar(StandIn):
    """numpy's scalar constructor."""

    def __init__(self, dtype: Dtype, raw: Any) -> None:
        self.state = (raw, dtype)

    def resolve(self) -> Any:
        raw, dtype = self.state
        return _array(raw, dtype, (1,), "C")[0]


class Chumpy(StandIn):
    """chumpy.ch.Ch: its value is `x`."""

    def resolve(self) -> Any:
        return np.asarray(_entry(self, "x"))


class Select(StandIn):
    """chumpy.reordering.Select: the entries `idxs` of `a`, in `preferred_shape`."""

    def resolve(self) -> Any:
        chosen = np.asarray(_entry(self, "a")).ravel()[np.asarray(_entry(self, "idxs"))]
        return chosen.reshape(_entry(self, "preferred_shape")) if "preferred_shape" in self.state else chosen


class SparseColumns(StandIn):
    """scipy's csc_matrix and csc_array; becomes dense."""

    def resolve(self) -> Any:
        shape = _entry(self, "_shape" if "_shape" in self.state else "shape")
        parts = tuple(_entry(self, key) for key in ("data", "indices", "indptr"))
        return sparse.csc_array(parts, shape=tuple(int(size) for size in shape)).toarray()


class Function:
    """A function of the allow-list, wrapped so that a pickle cannot set anything on it."""

    __slots__ = ("_function",)

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function

    def __call__(self, *arguments: Any) -> Any:
        return self._function(*arguments)

    def __setstate__(self, _: Any) -> None:
        raise InputError("the pickle changes a function; refused, nothing was run")


def _construct(kind: Any, *_: Any) -> StandIn:
    """copyreg._reconstructor and numpy's _reconstruct: an empty stand-in."""
    if not (isinstance(kind, type) and issubclass(kind, StandIn)):
        raise InputError("the pickle constructs an object of no known class; refused, nothing was run")
    return kind.__new__(kind)


def _encode(text: str, encoding: str = "latin1") -> bytes:
    """_codecs.encode, by which Python 3 writes bytes in pickles of protocol 2."""
    if encoding != "latin1":
        raise InputError(f"the pickle asks for the text encoding {encoding!r}; only latin1 is read")
    return text.encode("latin1")


_CONSTRUCT, _SET = Function(_construct), Function(lambda items=(): set(items))
# the buffer of an empty array, in Python 3's pickles of old protocols
_EMPTY = Function(lambda: b"")
_NUMPY_CORE = ("numpy.core", "numpy._core")

# (module, name) as a pickle writes them, in Python 2's and Python 3's spelling.
ALLOWED: dict[tuple[str, str], Any] = {
    ("chumpy.ch", "Ch"): Chumpy,
    ("chumpy", "Ch"): Chumpy,
    ("chumpy.reordering", "Select"): Select,
    ("numpy", "ndarray"): Array,
    ("numpy", "dtype"): Dtype,
    **{(f"{core}.multiarray", "_reconstruct"): _CONSTRUCT for core in _NUMPY_CORE},
    **{(f"{core}.multiarray", "scalar"): Scalar for core in _NUMPY_CORE},
    **{(f"{core}.numeric", "_frombuffer"): Buffer for core in _NUMPY_CORE},
    **{(f"scipy.sparse.{module}", "csc_matrix"): SparseColumns for module in ("csc", "_csc")},
    ("scipy.sparse._csc", "csc_array"): SparseColumns,
    **{(module, "_reconstructor"): _CONSTRUCT for module in ("copy_reg", "copyreg")},
    **{(module, "object"): Object for module in ("__builtin__", "builtins")},
    **{(module, "set"): _SET for module in ("__builtin__", "builtins")},
    **{(module, "bytes"): _EMPTY for module in ("__builtin__", "builtins")},
    ("_codecs", "encode"): Function(_encode),
}


def resolve(value: Any) -> Any:
    """The value with every stand-in inside it turned into an array."""
    if isinstance(value, dict):
        return {key: resolve(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return type(value)(resolve(item) for item in value)
    return value.resolve() if isinstance(value, StandIn) else value


def _array(raw: Any, dtype: Dtype, shape: tuple[int, ...], order: Any) -> NDArray[Any]:
    # Python 2's buffers arrive as text, one character a byte
    content = raw.encode("latin1") if isinstance(raw, str) else bytes(raw)
    return np.frombuffer(content, dtype=dtype.resolve()).reshape(shape, order=order).copy()


def _entry(owner: StandIn, key: str) -> Any:
    if not isinstance(owner.state, dict) or key not in owner.state:
        raise InputError(f"a pickled {type(owner).__name__} lacks its '{key}'; the file is damaged")
    return resolve(owner.state[key])
