"""USD as other programs write it: units, axes, transforms, polygons, sparse samples."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from muslin.eval.read.options import ReadOptions
from muslin.eval.read.subject import open_subject
from muslin.garments.errors import InputError

from .conftest import assert_lies_on, assert_shows

pxr = pytest.importorskip("pxr", reason="usd-core is not installed")


def write(
    path, scene, *, times=None, metres=None, up=None, rate=None, lift=0.0, flip=False, names=("cloth", "body")
):
    """A stage with the sheet, in its own unit and axes, and the ball."""
    from pxr import Gf, Usd, UsdGeom, Vt

    stage = Usd.Stage.CreateNew(str(path))
    scale, to_file = 1.0 / (metres or 1.0), np.eye(3)
    if metres is not None:
        UsdGeom.SetStageMetersPerUnit(stage, metres)
    if up == "z":
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
        to_file = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    if rate is not None:
        stage.SetTimeCodesPerSecond(rate)
    frames = range(len(scene.positions))
    for name, positions, faces in (
        (names[0], scene.positions, scene.faces),
        (names[1], scene.body[None], scene.body_faces),
    ):
        root = UsdGeom.Xform.Define(stage, f"/World/{name}")
        root.AddTranslateOp().Set(Gf.Vec3d(*(scale * to_file @ [0, lift, 0]).tolist()))
        mesh = UsdGeom.Mesh.Define(stage, f"/World/{name}/Mesh_{name}")
        mesh.CreateFaceVertexCountsAttr(Vt.IntArray([3] * len(faces)))
        mesh.CreateFaceVertexIndicesAttr(
            Vt.IntArray.FromNumpy((faces[:, ::-1] if flip else faces).ravel().astype(np.int32))
        )
        if flip:
            mesh.CreateOrientationAttr(UsdGeom.Tokens.leftHanded)
        for t in frames[: len(positions)]:
            x = (scale * (positions[t] - [0, lift, 0]) @ to_file.T).astype(np.float32)
            code = Usd.TimeCode.Default() if len(positions) == 1 else Usd.TimeCode((times or frames)[t])
            mesh.CreatePointsAttr().Set(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(x)), code)
    stage.GetRootLayer().Save()
    return path


def load(path, **how):
    return open_subject(path, options=ReadOptions(**how)).load(path.stem)


@pytest.mark.parametrize("suffix", ["usd", "usda", "usdc"])
def test_units_axis_rate_and_transforms_are_the_files(tmp_path, scene, suffix):
    path = write(tmp_path / f"walk.{suffix}", scene, metres=0.01, up="z", rate=30.0, lift=0.25)
    track = load(path)
    assert_shows(track, scene, 1e-6)
    assert_lies_on(track, scene)
    assert track.fps == 30.0
    assert track.units_known


def test_what_the_stage_does_not_say_is_not_known(tmp_path, scene):
    track = load(write(tmp_path / "walk.usda", scene), fps=25.0)
    assert_shows(track, scene, 1e-6)
    assert track.fps == 25.0
    assert not track.units_known


def test_a_sample_every_second_time_code_halves_the_rate(tmp_path, scene):
    track = load(write(tmp_path / "walk.usda", scene, times=(1, 3, 5, 7), rate=60.0))
    assert_shows(track, scene, 1e-6)
    assert track.fps == 30.0


def test_missing_samples_are_interpolated_and_said(tmp_path, scene):
    track = load(write(tmp_path / "walk.usda", scene, times=(0, 1, 2, 4)))
    assert track.num_frames == 5
    np.testing.assert_allclose(track.positions[3], (scene.positions[2] + scene.positions[3]) / 2, atol=1e-6)
    assert any("1 of 5 frames" in note for note in track.notes)
    with pytest.raises(InputError, match="unevenly"):
        load(write(tmp_path / "odd.usda", scene, times=(0, 1, 2.37, 4)))


def test_clockwise_faces_are_turned(tmp_path, scene):
    track = load(write(tmp_path / "walk.usda", scene, flip=True))
    assert np.array_equal(np.sort(track.faces[0], axis=1), np.sort(scene.faces, axis=1))
    x, f = track.positions[0], track.faces[0]
    normal = np.cross(x[f[:, 1]] - x[f[:, 0]], x[f[:, 2]] - x[f[:, 0]])
    y, g = scene.positions[0].astype(float), scene.faces
    np.testing.assert_allclose(normal, np.cross(y[g[:, 1]] - y[g[:, 0]], y[g[:, 2]] - y[g[:, 0]]), atol=1e-6)
    assert track.body.closed


def test_unclear_names_are_listed(tmp_path, scene):
    path = write(tmp_path / "walk.usda", scene, names=("Plane", "Sphere"))
    with pytest.raises(InputError, match=r"which mesh is the garment.*/World/Plane/Mesh_Plane"):
        load(path)
    assert load(write(tmp_path / "b.usda", scene, names=("Plane", "Avatar"))).body is not None


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("a.usda", b"#usdx 1.0", "must begin with"),
        ("a.usd", b"", "must begin with"),
        ("a.usdc", b"PXR-USDC" + b"\0" * 10, "not readable"),
        ("a.usda", b"#usda 1.0\ndef Mesh \"m\" {\n", "not readable"),
        ("a.usda", b"#usda 1.0\n", "There are 0"),
        ("a.usda", b"#usda 1.0\ndef Mesh \"m\" {}\n", "no faces"),
    ],
)  # fmt: skip
def test_damage_is_named(tmp_path, name, content, says):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=says) as caught:
        list(load(tmp_path / name).positions)
    assert "\n" not in str(caught.value)


def test_without_usd_core_the_extra_is_named(tmp_path, scene, monkeypatch):
    path = write(tmp_path / "walk.usda", scene)
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(InputError, match=r"muslin\[usd\]"):
        load(path)
