"""Alembic archives, written by alembic3d and read back; refused with a remedy where it is not installed."""

from __future__ import annotations

import importlib.util
import subprocess
import sys

import numpy as np
import pytest

import muslin.eval.read.alembic as reader
from muslin.eval.read.subject import open_subject
from muslin.garments.errors import InputError

INSTALLED = importlib.util.find_spec("alembic3d") is not None
needs_alembic = pytest.mark.skipif(not INSTALLED, reason="alembic3d is not installed")

# In a process of its own: a mistake in writing ends the process.
WRITE = """
import sys
import imath
import numpy as np
from alembic3d import Abc, AbcCoreAbstract, AbcGeom

def array(kind, values):
    made = kind(len(values))
    for k, value in enumerate(values):
        made[k] = value
    return made

arrays = np.load(sys.argv[1])
archive = Abc.OArchive(sys.argv[2])
sampling = archive.addTimeSampling(AbcCoreAbstract.TimeSampling(1 / 25.0, 0.0))
for part in ("cloth", "body"):
    transform = AbcGeom.OXform(archive.getTop(), part)
    moved = AbcGeom.XformSample()
    moved.setTranslation(imath.V3d(0, 0.25, 0))
    transform.getSchema().set(moved)
    mesh = AbcGeom.OPolyMesh(transform, part + "Shape")
    mesh.getSchema().setTimeSampling(sampling)
    faces = arrays[part + "_faces"][:, ::-1]
    for x in arrays[part] - np.array([0, 0.25, 0]):
        points = array(imath.V3fArray, [imath.V3f(*map(float, p)) for p in x])
        corners = array(imath.IntArray, [int(i) for i in faces.ravel()])
        counts = array(imath.IntArray, [3] * len(faces))
        mesh.getSchema().set(AbcGeom.OPolyMeshSchemaSample(points, corners, counts))
"""


def write(path, scene):
    np.savez(
        path.with_suffix(".in"),
        cloth=scene.positions,
        cloth_faces=scene.faces,
        body=scene.moving_body,
        body_faces=scene.body_faces,
    )
    source = path.with_suffix(".in.npz")
    subprocess.run([sys.executable, "-c", WRITE, str(source), str(path)], check=True)
    source.unlink()
    return path


@needs_alembic
def test_positions_faces_transforms_and_rate(tmp_path, scene):
    track = open_subject(write(tmp_path / "walk.abc", scene)).load("walk")
    assert [set(map(tuple, np.sort(f, axis=1))) for f in track.faces[:1]] == [
        set(map(tuple, np.sort(scene.faces, axis=1)))
    ]
    for t, x in enumerate(scene.positions):
        np.testing.assert_allclose(track.positions[t], x, atol=1e-6)
    assert track.fps == pytest.approx(25.0, abs=1e-6)
    assert track.body is not None
    assert track.body.closed
    x, f = track.positions[0], track.faces[0]
    up = np.cross(x[f[:, 1]] - x[f[:, 0]], x[f[:, 2]] - x[f[:, 0]])[:, 1]
    assert (up > 0).all(), "Alembic's clockwise corners are turned"


def outcome(path):
    """Frames read, or what was said instead."""
    try:
        return open_subject(path).load(path.stem).num_frames
    except InputError as error:
        return str(error)


@needs_alembic
def test_damage_is_named_even_where_the_library_crashes(tmp_path, scene):
    sound = write(tmp_path / "walk.abc", scene).read_bytes()
    rng = np.random.default_rng(0)
    for k in range(4):
        content = bytearray(sound[: len(sound) // 2] if k == 0 else sound)
        for place in rng.integers(len(content) - 2000, len(content), size=40 * (k > 0)):
            content[place] = rng.integers(256)
        (tmp_path / "damaged.abc").write_bytes(content)
        said = outcome(tmp_path / "damaged.abc")
        assert said == len(scene.positions) or "damaged.abc: not readable as an Alembic file" in said


def test_other_files_are_refused(tmp_path):
    (tmp_path / "a.abc").write_bytes(b"#usda 1.0")
    with pytest.raises(InputError, match="must begin with Ogawa"):
        open_subject(tmp_path / "a.abc").load("a")


def test_without_alembic3d_the_package_and_what_to_export_are_named(tmp_path, monkeypatch):
    (tmp_path / "a.abc").write_bytes(b"Ogawa\xff\0\1")
    monkeypatch.setattr(reader, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"muslin\[alembic\].*export USD, PC2 or a folder of OBJ"):
        open_subject(tmp_path / "a.abc").load("a")
