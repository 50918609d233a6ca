"""Reads SMPL's official pickles without executing anything in them.

A pickle is a program: it names functions and calls them. This reader knows a short list of names, maps each
to a plain stand-in that only stores what it is given, and refuses the file at the first other name, before
anything is called.
"""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import IO, Any

import numpy as np
import scipy.sparse as sparse
from numpy.typing import NDArray

from muslin.garments.errors import InputError

# What unpickling a damaged file can raise.
DAMAGE = (pickle.UnpicklingError, EOFError, ValueError, TypeError, AttributeError, LookupError, OverflowError,
          MemoryError, RecursionError)  # fmt: skip


class _Dtype:
    """Stands for numpy.dtype: numbers, booleans, bytes, text and object references only."""

    def __init__(self, code: Any, align: bool = False, copy: bool = False) -> None:
        text = code.decode("ascii") if isinstance(code, bytes) else str(code)
        if text[:1] not in set("fiubSUO"):
            raise InputError(f"a pickled array has dtype '{text}'; an SMPL file holds numbers and text only")
        self.code, self.order = text, "<"

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        self.order = _text(state[1])

    def resolve(self) -> np.dtype[Any]:
        dtype = np.dtype(self.code)
        return dtype.newbyteorder(">") if self.order == ">" else dtype


class _Array:
    """Stands for numpy.ndarray."""

    def __init__(self, *_: Any) -> None:
        self.state: tuple[Any, ...] = ()

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        self.state = state

    def resolve(self) -> Any:
        shape, dtype, fortran, raw = self.state[-4:]
        if dtype.code[:1] == "O":
            return [_resolve(item) for item in raw]
        values = np.frombuffer(_bytes(raw), dtype=dtype.resolve())
        return values.reshape(shape, order="F" if fortran else "C").copy()


class _Buffer:
    """Stands for numpy's `_frombuffer`, the array constructor of pickle protocol 5."""

    def __init__(self, raw: Any, dtype: _Dtype, shape: tuple[int, ...], order: str) -> None:
        self.raw, self.dtype, self.shape, self.order = raw, dtype, shape, order

    def resolve(self) -> NDArray[Any]:
        values = np.frombuffer(_bytes(self.raw), dtype=self.dtype.resolve())
        return values.reshape(self.shape, order="F" if self.order == "F" else "C").copy()


class _Scalar:
    """Stands for numpy's scalar constructor."""

    def __init__(self, dtype: _Dtype, raw: Any = b"") -> None:
        self.dtype, self.raw = dtype, raw

    def resolve(self) -> Any:
        return np.frombuffer(_bytes(self.raw), dtype=self.dtype.resolve())[0]


class _State:
    """An object that keeps the state it is given and does nothing with it."""

    def __init__(self, *_: Any) -> None:
        self.state: dict[str, Any] = {}

    def __setstate__(self, state: Any) -> None:
        self.state = state if isinstance(state, dict) else {}

    def _value(self, key: str) -> Any:
        if key not in self.state:
            raise InputError(
                f"a pickled {type(self).__name__.strip('_')} lacks its '{key}'; the file is damaged"
            )
        return _resolve(self.state[key])


class _Chumpy(_State):
    """Stands for chumpy.ch.Ch: its value is `x`."""

    def resolve(self) -> Any:
        return np.asarray(self._value("x"))


class _Select(_State):
    """Stands for chumpy.reordering.Select: the entries `idxs` of `a`, in `preferred_shape`."""

    def resolve(self) -> Any:
        chosen = np.asarray(self._value("a")).ravel()[np.asarray(self._value("idxs"))]
        shape = self.state.get("preferred_shape")
        return chosen if shape is None else chosen.reshape(_resolve(shape))


class _SparseColumns(_State):
    """Stands for scipy's csc_matrix and csc_array: resolved to a dense array."""

    def resolve(self) -> Any:
        shape = self._value("_shape" if "_shape" in self.state else "shape")
        parts = tuple(self._value(key) for key in ("data", "indices", "indptr"))
        return sparse.csc_array(parts, shape=tuple(shape)).toarray()


class _Object:
    """Stands for the name `object`, which older pickles hand to the constructor below."""


class _Type:
    """Names a stand-in class on the pickle's stack without being that class: nothing can be set on it."""

    __slots__ = ("_stand_in",)

    def __init__(self, stand_in: type) -> None:
        self._stand_in = stand_in

    def __call__(self, *arguments: Any) -> Any:
        return self._stand_in(*arguments)

    def __setstate__(self, _: Any) -> None:
        raise InputError("the pickle sets attributes of a class; refused, nothing was run")


def _construct(kind: Any, *_: Any) -> Any:
    """Stands for copyreg._reconstructor and numpy's _reconstruct: an empty stand-in."""
    if not isinstance(kind, _Type):
        raise InputError("the pickle constructs an object of no known class; refused, nothing was run")
    return kind()


def _encode(text: Any, encoding: Any = "latin1") -> bytes:
    """Stands for _codecs.encode, by which newer pickles of old protocols write bytes."""
    if encoding not in ("latin1", "latin-1"):
        raise InputError(f"the pickle asks for the text encoding {encoding!r}; only latin1 is read")
    return str(text).encode("latin1")


def _make_set(items: Any = ()) -> set[Any]:
    return set(items)


_NUMPY_CORE = ("numpy.core", "numpy._core")
_ALLOWED: dict[tuple[str, str], Any] = {
    ("chumpy.ch", "Ch"): _Chumpy,
    ("chumpy", "Ch"): _Chumpy,
    ("chumpy.reordering", "Select"): _Select,
    ("numpy", "ndarray"): _Array,
    ("numpy", "dtype"): _Dtype,
    **{(f"{core}.multiarray", "_reconstruct"): _construct for core in _NUMPY_CORE},
    **{(f"{core}.multiarray", "scalar"): _Scalar for core in _NUMPY_CORE},
    **{(f"{core}.numeric", "_frombuffer"): _Buffer for core in _NUMPY_CORE},
    **{(f"scipy.sparse.{module}", name): _SparseColumns
       for module in ("csc", "_csc") for name in ("csc_matrix", "csc_array")},
    # Python 2's names and Python 3's for the same three things
    **{(module, "_reconstructor"): _construct for module in ("copy_reg", "copyreg")},
    **{(module, "object"): _Object for module in ("__builtin__", "builtins")},
    **{(module, "set"): _make_set for module in ("__builtin__", "builtins")},
    ("_codecs", "encode"): _encode,
}  # fmt: skip


class _ArrayUnpickler(pickle.Unpickler):
    def __init__(self, stream: IO[bytes], label: str) -> None:
        # latin1 maps bytes to text one to one, so Python 2's array buffers survive
        super().__init__(stream, fix_imports=False, encoding="latin1")
        self._label = label

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in _ALLOWED:
            raise InputError(
                f"{self._label}: the pickle asks for {module}.{name}, which no SMPL file needs; refused, "
                "nothing was run; get the file from its original source"
            )
        stand_in = _ALLOWED[module, name]
        return _Type(stand_in) if isinstance(stand_in, type) else stand_in

    def persistent_load(self, pid: Any) -> Any:
        raise InputError(
            f"{self._label}: the pickle refers to objects outside itself; refused, nothing was run"
        )


def unpickle_arrays(stream: IO[bytes], label: str) -> Any:
    """What one pickle holds, with chumpy's and scipy's objects turned into numpy arrays.

    Raises:
        InputError: a name besides the allowed ones, or a damaged pickle. Nothing is executed.
    """
    try:
        return _resolve(_ArrayUnpickler(stream, label).load())
    except InputError as error:
        message = str(error)
        raise InputError(message if message.startswith(label) else f"{label}: {message}") from error
    except DAMAGE as error:
        raise InputError(
            f"{label}: no readable SMPL pickle ({type(error).__name__}: {error}); give an intact file"
        ) from error


def read_pickle(path: Path) -> dict[str, Any]:
    """Arrays of an SMPL .pkl file by key.

    Raises:
        InputError: see `unpickle_arrays`; also if the pickle holds no dictionary.
    """
    with path.open("rb") as stream:
        content = unpickle_arrays(stream, str(path))
    if not isinstance(content, dict):
        raise InputError(
            f"{path}: the pickle holds a {type(content).__name__}; an SMPL file holds a dictionary"
        )
    return {_text(key): value for key, value in content.items()}


def _resolve(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _resolve(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return type(value)(_resolve(item) for item in value)
    return value.resolve() if hasattr(value, "resolve") else value


def _text(value: Any) -> str:
    return value.decode("latin1") if isinstance(value, bytes) else str(value)


def _bytes(value: Any) -> bytes:
    return value.encode("latin1") if isinstance(value, str) else bytes(value)
