"""Files cut short and files with wrong bytes: an InputError or surfaces that can be scored, nothing else."""

from __future__ import annotations

import pickle
import subprocess
import sys
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from muslin.eval.read.check import check_finite, check_track
from muslin.eval.read.subject import open_subject
from muslin.garments.errors import InputError

from .conftest import cache, make_scene, write_obj

NAMES = (
    "a.obj", "a.ply", "text.ply", "a.off", "a.stl", "text.stl", "a.glb", "a.npy", "a.npz", "packed.npz",
    "a.pc2", "a.pc16", "p2.pkl", "p4.pkl", "p5.pkl",
)  # fmt: skip
# One argument a damaged file; prints a letter for each that was named or read, and dies at anything else.
READ_ALL = """
import sys
from tests.eval.read.test_damage import outcome
for name in sys.argv[1:]:
    print("o" if outcome(name) is not None else "e", end="")
"""


@lru_cache
def whole(name: str) -> bytes:
    """A sound file of each format."""
    scene = make_scene(n=4, frames=3)
    mesh = trimesh.Trimesh(scene.positions[0], scene.faces, process=False)
    content = {"pred": scene.positions, "cloth_faces": scene.faces, "metrics": {"loss": [0.5]}}
    with TemporaryDirectory() as folder:
        path = Path(folder) / name
        match name:
            case "a.obj":
                write_obj(path, scene.positions[0], scene.faces)
            case "text.ply":
                mesh.export(path, encoding="ascii")
            case "text.stl":
                mesh.export(path, file_type="stl_ascii")
            case "a.npy":
                np.save(path, scene.positions)
            case "a.npz":
                np.savez(path, vertices=scene.positions, faces=scene.faces)
            case "packed.npz":
                np.savez_compressed(path, vertices=scene.positions, faces=scene.faces)
            case "a.pc2" | "a.pc16":
                return cache(scene.positions, "<f4" if name == "a.pc2" else "<f2")
            case "p2.pkl" | "p4.pkl" | "p5.pkl":
                return pickle.dumps(content, protocol=int(name[1]))
            case _:
                mesh.export(path)
        return path.read_bytes()


def outcome(path: str | Path) -> list[np.ndarray] | None:
    """The checked frames in a file; None if it was refused by an InputError of one line."""
    said = ""
    try:
        subject = open_subject(path)
        track = subject.load(subject.ids[0])
        if track.faces:
            check_track(track)
        for x in track.positions:
            check_finite(x, track.name)
        return list(track.positions)
    except InputError as error:
        said = str(error)
    assert "\n" not in said
    assert Path(path).stem in said
    return None


def of_bytes(name: str, content: bytes) -> list[np.ndarray] | None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(content)
        return outcome(path)


@pytest.mark.parametrize("name", NAMES)
def test_a_sound_file_is_read(name):
    scene = make_scene(n=4, frames=3)
    frames = of_bytes(name, whole(name))
    assert frames is not None
    x, y = frames[0], scene.positions[0]
    if name.endswith("stl"):  # its vertices come in the order of the faces
        x, y = np.unique(np.float32(x).round(5), axis=0), np.unique(y.round(5), axis=0)
    np.testing.assert_allclose(x, y, atol=1e-3 if name == "a.pc16" else 1e-6)


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=12)
@given(data=st.data())
def test_a_file_cut_short_is_refused_or_whole(name, data):
    content = whole(name)
    sound = of_bytes(name, content)
    found = of_bytes(name, content[: data.draw(st.integers(0, len(content) - 1))])
    # text may lose the last face, or digits of its last number, and still be a mesh
    if found is not None and name not in ("a.obj", "text.ply", "a.off", "text.stl"):
        assert len(found) == len(sound)
        assert all(np.array_equal(x, y) for x, y in zip(found, sound, strict=True))


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=25)
@given(data=st.data())
def test_wrong_bytes_are_refused_or_read(name, data):
    content = bytearray(whole(name))
    # headers are where a wrong byte matters most
    for _ in range(data.draw(st.integers(1, 3))):
        near = data.draw(st.sampled_from([min(200, len(content)), len(content)]))
        content[data.draw(st.integers(0, near - 1))] = data.draw(st.integers(0, 255))
    place = data.draw(st.integers(0, len(content)))
    inserted = data.draw(st.sampled_from([b"", b"", b"\xff" * 8, b"\0" * 3, b"9" * 12]))
    of_bytes(name, bytes(content[:place] + inserted + content[place:]))


def test_damaged_usd_files(tmp_path):
    """In a process of their own: a crash of USD's library is to be a failed test, not a dead test run.

    Wrong bytes go where the structure of the file is, behind its values: a wrong size of a value makes the
    library ask for as much memory, which no reader can check beforehand.
    """
    pytest.importorskip("pxr", reason="usd-core is not installed")
    from muslin.sim.dataset.parts import Part
    from muslin.sim.dataset.usd import write_usd

    scene = make_scene(n=4, frames=3)
    write_usd(tmp_path / "sound.usd", [Part("cloth", scene.positions, scene.faces)], 30.0)
    sound = (tmp_path / "sound.usd").read_bytes()
    rng = np.random.default_rng(0)
    files = [tmp_path / "sound.usd"]
    for k in range(16):
        content = bytearray(sound[: rng.integers(len(sound))] if k % 4 == 0 else sound)
        for place in rng.integers(min(1080, len(content) - 1), len(content), size=0 if k % 4 == 0 else 4):
            content[place] = rng.integers(256)
        files.append(tmp_path / f"damaged{k}.usd")
        files[-1].write_bytes(content)
    command = [sys.executable, "-c", READ_ALL, *map(str, files)]
    root = Path(__file__).resolve().parents[3]
    done = subprocess.run(command, capture_output=True, text=True, errors="replace", cwd=root, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert len(done.stdout) == len(files)
    assert done.stdout[0] == "o"
    assert "e" in done.stdout
