"""The allow-list of the pickle reader: what it reads, and that what it refuses is never run."""

from __future__ import annotations

import contextlib
import io
import os
import pickle
import struct
import sys
import types
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sparse
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.sim.body import load_body
from muslin.sim.body.smpl_pickle import ForbiddenPickleError, read_pickle, unpickle_arrays

PROTOCOLS = (0, 1, 2, 3, 4, 5)


def read(content: bytes) -> Any:
    return unpickle_arrays(io.BytesIO(content), "a file")


class Ch:
    """What a pickled chumpy.ch.Ch looks like: an object whose dictionary has the value in `x`."""

    def __init__(self, x: Any) -> None:
        self.x = x
        self._dirty_vars: set[str] = {"x"}


class Select:
    def __init__(self, a: Any, idxs: Any, preferred_shape: tuple[int, ...]) -> None:
        self.a, self.idxs, self.preferred_shape = a, idxs, preferred_shape


@pytest.fixture
def chumpy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets the two classes above be pickled under chumpy's names; reading them needs no such module."""
    monkeypatch.setitem(sys.modules, "chumpy", types.ModuleType("chumpy"))
    for module, kind in (("chumpy.ch", Ch), ("chumpy.reordering", Select)):
        stand = types.ModuleType(module)
        setattr(stand, kind.__name__, kind)
        monkeypatch.setitem(sys.modules, module, stand)
        monkeypatch.setattr(kind, "__module__", module)


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize(
    "array",
    [
        np.arange(12.0).reshape(3, 4),
        np.asfortranarray(np.arange(12.0).reshape(3, 4)),
        np.arange(6, dtype=">i4").reshape(2, 3),
        np.array([True, False]),
        np.zeros((0, 3), dtype=np.float32),
        np.array(["lbs", "x"]),
        np.array(2.5),
    ],
    ids=["C", "F", "big-endian", "bool", "empty", "text", "0d"],
)
def test_arrays_are_read_exactly(protocol: int, array: NDArray[Any]) -> None:
    result = read(pickle.dumps({"x": array, "s": np.float32(1.5), "n": 3, "t": "lbs"}, protocol=protocol))
    np.testing.assert_array_equal(result["x"], array)
    assert (result["s"], result["n"], result["t"]) == (1.5, 3, "lbs")


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.usefixtures("chumpy")
def test_chumpy_and_scipy_objects_become_arrays(protocol: int) -> None:
    base = np.arange(30.0).reshape(5, 6)
    chosen = np.array([3, 0, 7, 29])
    matrix = sparse.random_array((6, 9), density=0.3, format="csc", rng=np.random.default_rng(0))
    content = {
        "ch": Ch(base),
        "nested": Ch(Ch(base)),
        "select": Select(Ch(base), chosen, (2, 2)),
        "csc": sparse.csc_matrix(matrix),
        "csc_array": matrix,
    }
    result = read(pickle.dumps(content, protocol=protocol))
    np.testing.assert_array_equal(result["ch"], base)
    np.testing.assert_array_equal(result["nested"], base)
    np.testing.assert_array_equal(result["select"], base.ravel()[chosen].reshape(2, 2))
    np.testing.assert_array_equal(result["csc"], matrix.toarray())
    np.testing.assert_array_equal(result["csc_array"], matrix.toarray())


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.usefixtures("chumpy")
def test_an_official_style_file_loads(tmp_path: Path, smpl_arrays: dict[str, Any], protocol: int) -> None:
    content = dict(smpl_arrays)
    content["v_template"], content["posedirs"] = Ch(content["v_template"]), Ch(content["posedirs"])
    whole = Ch(np.concatenate([content["shapedirs"], content["shapedirs"]], axis=2))
    first_half = np.arange(60 * 3 * 20).reshape(60, 3, 20)[:, :, :10]
    content["shapedirs"] = Select(whole, first_half.ravel(), first_half.shape)
    content["J_regressor"] = sparse.csc_matrix(content["J_regressor"])
    content["bs_style"], content["bs_type"] = "lbs", "lrotmin"
    (tmp_path / "model.pkl").write_bytes(pickle.dumps(content, protocol=protocol))
    model = load_body(tmp_path / "model.pkl")
    for key in ("v_template", "shapedirs", "posedirs"):
        np.testing.assert_array_equal(getattr(model, key), smpl_arrays[key])
    regressed = smpl_arrays["J_regressor"] @ smpl_arrays["v_template"]
    np.testing.assert_allclose(model.joint_template, regressed, atol=1e-14)


def python2_array(array: NDArray[np.float64]) -> bytes:
    """A float64 array as Python 2's cPickle writes it with protocol 2: its bytes are a string."""
    shape = b"(" + b"".join(b"J" + struct.pack("<i", size) for size in array.shape) + b"t"
    dtype = b"cnumpy\ndtype\nU\x02f8K\x00K\x01\x87R(K\x03U\x01<NNNJ\xff\xff\xff\xffJ\xff\xff\xff\xffK\x00tb"
    raw = b"T" + struct.pack("<i", array.nbytes) + array.tobytes()
    empty = b"cnumpy.core.multiarray\n_reconstruct\ncnumpy\nndarray\nK\x00\x85U\x01b\x87R"
    return empty + b"(K\x01" + shape + dtype + b"\x89" + raw + b"tb"


def test_python_2_names_and_strings_are_read() -> None:
    array = np.random.default_rng(0).normal(size=(7, 3))
    chumpy_object = (
        b"ccopy_reg\n_reconstructor\n(cchumpy.ch\nCh\nc__builtin__\nobject\nNtR}(U\x01x"
        + python2_array(array)
        + b"U\x0b_dirty_varsc__builtin__\nset\n]\x85RU\x04_itrNub"
    )  # fmt: skip
    content = b"\x80\x02}(U\x0av_template" + chumpy_object + b"U\x01y" + python2_array(array[:2]) + b"u."
    result = read(content)
    np.testing.assert_array_equal(result["v_template"], array)
    np.testing.assert_array_equal(result["y"], array[:2])


class Payload:
    """Unpickled freely, this calls `function(*arguments)`."""

    def __init__(self, function: Any, *arguments: Any) -> None:
        self.call = (function, arguments)

    def __reduce__(self) -> Any:
        return self.call


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("where", ["alone", "beside", "in array", "in state"])
@pytest.mark.usefixtures("chumpy")
def test_a_payload_is_refused_and_not_run(
    tmp_path: Path, smpl_arrays: dict[str, Any], protocol: int, where: str
) -> None:
    witness = tmp_path / "was_run"
    payload: Any = Payload(os.mkdir, str(witness))
    content: dict[str, Any] = dict(smpl_arrays)
    if where == "beside":
        content["extra"] = payload
    elif where == "in array":
        content["v_template"] = np.array([payload], dtype=object)
    elif where == "in state":
        content["v_template"] = Ch(payload)
    path = tmp_path / "model.pkl"
    path.write_bytes(pickle.dumps(payload if where == "alone" else content, protocol=protocol))
    with pytest.raises(ForbiddenPickleError, match=r"model\.pkl: the pickle asks for (posix|nt|os)\.mkdir"):
        load_body(path)
    assert not witness.exists()
    pickle.loads(path.read_bytes())
    assert witness.exists(), "the payload would have run: the test is real"


def test_a_payload_inside_an_npz_is_refused_and_not_run(tmp_path: Path, smpl_arrays: dict[str, Any]) -> None:
    witness = tmp_path / "was_run"
    smpl_arrays["J_regressor"] = np.array(Payload(os.mkdir, str(witness)), dtype=object)
    np.savez(tmp_path / "model.npz", **smpl_arrays)
    with pytest.raises(ForbiddenPickleError, match="refused, nothing was run"):
        load_body(tmp_path / "model.npz")
    assert not witness.exists()


@pytest.mark.parametrize(
    "function",
    [eval, exec, getattr, __import__, open, print, pickle.loads, np.load, np.save, type, io.open_code],
)
def test_functions_are_refused(function: Any) -> None:
    with pytest.raises(ForbiddenPickleError, match=rf"{function.__name__}"):
        read(pickle.dumps(Payload(function, "x")))


@pytest.mark.parametrize(
    "content",
    [
        b"cnumpy.core.multiarray\n_reconstruct\n(U\x04evilK\x00\x85U\x01btR.",
        b"\x80\x02c_codecs\nencode\nX\x01\x00\x00\x00xX\x05\x00\x00\x00rot13\x86R.",
        b"\x80\x02c_codecs\nencode\nN}U\x0c__defaults__Nsb.",
        b"\x80\x02cnumpy\ndtype\nU\x02V8\x85R.",
        b"\x80\x02cnumpy\ndtype\nU\x07O8,(9,)\x85R.",
        b"\x80\x02cchumpy.ch\nCh\n}U\x07resolveNsb.",
        b"cos.path\njoin\n.",
        b"Psomewhere\n.",
        b"\x80\x02\x82\x01.",
    ],
    ids=["foreign class", "codec", "function state", "void dtype", "odd dtype", "class state", "name",
         "persistent", "extension"],
)  # fmt: skip
def test_tricks_are_refused(content: bytes) -> None:
    with pytest.raises(InputError, match="a file"):
        read(content)


@pytest.mark.parametrize("content", [[1, 2], "text", 7, None])
def test_a_pickle_that_is_no_dictionary(tmp_path: Path, content: Any) -> None:
    (tmp_path / "list.pkl").write_bytes(pickle.dumps(content))
    with pytest.raises(InputError, match="holds a dictionary"):
        read_pickle(tmp_path / "list.pkl", ["f"])


def test_incomplete_objects_are_named() -> None:
    with pytest.raises(InputError, match="Chumpy lacks its 'x'"):
        read(b"\x80\x02cchumpy.ch\nCh\n)\x81}b.")


def test_random_damage_gives_one_error_or_data() -> None:
    content = bytearray(pickle.dumps({"x": np.arange(9.0), "f": np.arange(4)}, protocol=2))
    generator = np.random.default_rng(0)
    for _ in range(400):
        damaged = bytearray(content)
        for position in generator.integers(0, len(content), size=3):
            damaged[position] = generator.integers(0, 256)
        with contextlib.suppress(InputError):
            read(bytes(damaged))


@pytest.mark.parametrize(
    "content",
    [
        b"\x80\x04\x8d" + (1 << 40).to_bytes(8, "little") + b"short.",  # a string of 1 TB
        b"\x80\x02}r" + (1 << 31).to_bytes(4, "little") + b".",  # entry 2^31 of the memo
    ],
)
def test_lengths_beyond_the_file_are_refused_before_anything_is_allocated(tmp_path, content):
    (tmp_path / "body.pkl").write_bytes(content)
    with pytest.raises(InputError, match="no readable SMPL pickle"):
        read_pickle(tmp_path / "body.pkl", ["v_template"])
