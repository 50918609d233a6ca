"""Pickles of arrays: HOOD's dictionary is read, and nothing in a pickle is ever run."""

from __future__ import annotations

import os
import pickle
import struct
import tracemalloc
from collections import OrderedDict, defaultdict
from typing import Any

import numpy as np
import pytest

from muslin.eval.read.subject import open_subject
from muslin.garments.errors import InputError
from muslin.sim.body.smpl_pickle import ForbiddenPickleError

from .conftest import assert_lies_on, assert_shows

PROTOCOLS = range(pickle.HIGHEST_PROTOCOL + 1)


def rollout(scene) -> dict[str, Any]:
    """What HOOD's valid_rollout returns."""
    return {
        "pred": scene.positions,
        "obstacle": scene.moving_body,
        "metrics": {"stretching_loss": [0.5, 0.25], "time": 1.5},
        "cloth_faces": scene.faces.astype(np.int64),
        "obstacle_faces": scene.body_faces.astype(np.int64),
    }


def load(tmp_path, content: Any, protocol: int = 4):
    path = tmp_path / "walk.pkl"
    path.write_bytes(content if isinstance(content, bytes) else pickle.dumps(content, protocol=protocol))
    return open_subject(path, fps=30.0).load("walk")


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_a_rollout_of_hood(tmp_path, scene, protocol):
    track = load(tmp_path, rollout(scene), protocol)
    assert_shows(track, scene)
    assert_lies_on(track, scene)
    assert track.fps == 30.0


@pytest.mark.parametrize("kind", [OrderedDict, lambda content: defaultdict(list, content)])
def test_other_dictionaries_and_lists_of_frames(tmp_path, scene, kind):
    content = kind(rollout(scene) | {"pred": list(scene.positions), "cloth_faces": scene.faces[None]})
    assert_shows(load(tmp_path, content), scene)


class Payload:
    """Unpickled freely, this calls `function(*arguments)`."""

    def __init__(self, function: Any, *arguments: Any) -> None:
        self.call = (function, arguments)

    def __reduce__(self) -> Any:
        return self.call


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("where", ["alone", "beside", "in an array", "in a list"])
def test_a_payload_is_refused_and_not_run(tmp_path, scene, protocol, where):
    witness = tmp_path / "was_run"
    payload: Any = Payload(os.mkdir, str(witness))
    content: Any = rollout(scene)
    if where == "alone":
        content = payload
    elif where == "beside":
        content["metrics"] = payload
    elif where == "in an array":
        content["pred"] = np.array([payload], dtype=object)
    else:
        content["pred"] = [*scene.positions, payload]
    with pytest.raises(ForbiddenPickleError, match=r"walk\.pkl: the pickle asks for (posix|nt|os)\.mkdir"):
        load(tmp_path, content, protocol)
    assert not witness.exists()
    pickle.loads((tmp_path / "walk.pkl").read_bytes())
    assert witness.exists(), "the payload would have run: the test is real"


@pytest.mark.parametrize(
    "function", [eval, exec, getattr, __import__, open, np.load, np.save, pickle.loads, type]
)
def test_functions_are_refused_by_name(tmp_path, function):
    with pytest.raises(ForbiddenPickleError, match=rf"{function.__name__}, which no array needs"):
        load(tmp_path, Payload(function, "x"))


def test_tensors_are_refused_with_a_remedy(tmp_path):
    with pytest.raises(ForbiddenPickleError, match=r"torch\._utils\._rebuild_tensor_v2.*cpu\(\)\.numpy\(\)"):
        load(tmp_path, b"\x80\x02ctorch._utils\n_rebuild_tensor_v2\n.")


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "no readable pickle"),
        (b"\x80\x04.", "no readable pickle"),
        (b"\x80\x04\x8e" + struct.pack("<Q", 1 << 40) + b"x.", "no readable pickle"),
        (b"\x80\x04}r" + struct.pack("<I", 1 << 31) + b".", "memo entry"),
        (b"\x80\x05\x96" + struct.pack("<Q", 1 << 33) + b".", "no readable pickle"),
        (pickle.dumps([1, 2]), "holds a list"),
        (pickle.dumps({"loss": 1.0}), "There is loss; name it 'vertices'"),
        (pickle.dumps({"pred": "walk"}), "'pred' holds a str"),
        (pickle.dumps({"pred": [[0.0, 1.0, 2.0]]}), "'pred' holds a list"),
        (pickle.dumps({"pred": np.array([None, 1], dtype=object)}), "array of objects"),
        (pickle.dumps({"pred": np.zeros((4, 3), dtype="U2")}), "plain numbers"),
    ],
)
def test_damage_is_named_and_costs_no_memory(tmp_path, content, says):
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match=says):
            load(tmp_path, content)
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()


def test_an_array_named_many_times_is_refused(tmp_path):
    frame = np.zeros((100_000, 3))
    with pytest.raises(InputError, match="repeats arrays"):
        load(tmp_path, {"pred": [frame] * 1000})
