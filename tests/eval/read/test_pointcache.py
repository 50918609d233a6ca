"""PC2 and PC16: byte for byte from their description, faces from the mesh beside them."""

from __future__ import annotations

import numpy as np
import pytest

from muslin.eval.read.options import ReadOptions
from muslin.eval.read.pointcache import map_pointcache
from muslin.eval.read.subject import open_subject
from muslin.garments.errors import InputError
from muslin.sim.dataset.pc2 import write_pc2

from .conftest import assert_shows, cache, write_obj


def load(path, **how):
    return open_subject(path, options=ReadOptions(**how)).load(path.stem)


def test_pc2_with_the_only_mesh_beside_it(tmp_path, scene):
    (tmp_path / "walk.pc2").write_bytes(cache(scene.positions))
    assert load(tmp_path / "walk.pc2").faces == []
    write_obj(tmp_path / "template.obj", scene.positions[0], scene.faces)
    write_obj(tmp_path / "body.obj", scene.body, scene.body_faces)
    assert_shows(load(tmp_path / "walk.pc2"), scene)


def test_the_mesh_of_the_same_stem_comes_first(tmp_path, scene):
    (tmp_path / "walk.pc2").write_bytes(cache(scene.positions))
    write_obj(tmp_path / "other.obj", scene.body, scene.body_faces)
    with pytest.raises(InputError, match=r"36 points, but other\.obj beside it has 42"):
        load(tmp_path / "walk.pc2")
    write_obj(tmp_path / "walk.obj", scene.positions[0], scene.faces)
    assert_shows(load(tmp_path / "walk.pc2"), scene)


def test_muslins_own_writer(tmp_path, scene):
    write_pc2(tmp_path / "a.pc2", scene.positions)
    assert (tmp_path / "a.pc2").read_bytes() == cache(scene.positions)


def test_pc16_is_half_precision_and_says_that_it_is_relative(tmp_path, scene):
    (tmp_path / "Tshirt.pc16").write_bytes(cache(scene.positions, "<f2"))
    write_obj(tmp_path / "Tshirt.obj", scene.positions[0], scene.faces)
    track = load(tmp_path / "Tshirt.pc16", fps=30.0)
    assert_shows(track, scene, 2**-11 * 0.5)  # half of the last bit of numbers below 1/2
    assert track.fps == 30.0
    assert any("relative to the body's root" in note for note in track.notes)


def test_positions_are_mapped(tmp_path, scene):
    (tmp_path / "a.pc2").write_bytes(cache(scene.positions))
    assert isinstance(map_pointcache(tmp_path / "a.pc2"), np.memmap)


@pytest.mark.parametrize(
    ("header", "says"),
    [
        ({"magic": b"POINTCACHE1\0"}, "must begin with POINTCACHE2"),
        ({"version": 2}, "version 2"),
        ({"version": 1 << 24}, "big endian"),
        ({"points": -1}, "-1 points"),
        ({"samples": 0}, "0 samples"),
        ({"points": 2**31 - 1, "samples": 2**31 - 1}, "asks for 55340232"),
        ({"samples": 5}, "asks for"),
    ],
)
def test_headers_that_lie(tmp_path, scene, header, says):
    (tmp_path / "a.pc2").write_bytes(cache(scene.positions, **header))
    with pytest.raises(InputError, match=says):
        load(tmp_path / "a.pc2")


def test_the_precision_of_the_other_suffix_is_recognised(tmp_path, scene):
    (tmp_path / "a.pc2").write_bytes(cache(scene.positions, "<f2"))
    with pytest.raises(InputError, match=r"fits \.pc16, rename"):
        load(tmp_path / "a.pc2")
    (tmp_path / "a.pc2").write_bytes(cache(scene.positions)[:20])
    with pytest.raises(InputError, match="not a point cache"):
        load(tmp_path / "a.pc2")
