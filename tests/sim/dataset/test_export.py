"""What other programs read is what was stored."""

from __future__ import annotations

import builtins
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from sheet_producer import make_sample

from muslin.garments.errors import InputError
from muslin.sim.dataset.export import FORMATS, export_dataset, export_parts
from muslin.sim.dataset.parts import Part, read_mesh, sample_parts
from muslin.sim.dataset.pc2 import read_pc2
from muslin.sim.dataset.reader import Dataset, write_dataset

FRAMES = 3


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    samples = [make_sample("drape"), make_sample("wave", frames=FRAMES)]
    return write_dataset(tmp_path_factory.mktemp("export") / "data", samples)


def names(files: list[Path], out: Path) -> set[str]:
    return {str(file.relative_to(out)) for file in files}


@pytest.mark.parametrize("file_format", ["obj", "ply"])
def test_meshes_keep_vertices_and_faces_exactly(dataset: Dataset, tmp_path: Path, file_format: str) -> None:
    files = export_dataset(dataset.root, tmp_path, file_format)
    expected = {f"drape_{part}.{file_format}" for part in ("cloth", "body")}
    expected |= {f"wave/{part}_{k:04d}.{file_format}" for part in ("cloth", "body") for k in range(FRAMES)}
    assert names(files, tmp_path) == expected
    wave = dataset["wave"]
    for k in range(FRAMES):
        read = read_mesh(tmp_path / f"wave/cloth_{k:04d}.{file_format}")
        np.testing.assert_array_equal(read.positions[0], wave.positions[k])
        np.testing.assert_array_equal(read.faces, wave.garment.faces)
    body = read_mesh(tmp_path / f"drape_body.{file_format}")
    np.testing.assert_array_equal(body.positions[0], wave.body_vertices(0).astype(np.float32))


def test_obj_carries_the_uv_of_every_corner(dataset: Dataset, tmp_path: Path) -> None:
    export_dataset(dataset.root, tmp_path, "obj", ids=["drape"], body=False)
    assert [p.name for p in tmp_path.iterdir()] == ["drape_cloth.obj"]
    lines = [line.split() for line in (tmp_path / "drape_cloth.obj").read_text().splitlines()]
    uv = np.array([line[1:] for line in lines if line[0] == "vt"], dtype=float)
    corners = np.array([[c.split("/") for c in line[1:]] for line in lines if line[0] == "f"], dtype=int) - 1
    garment = dataset["drape"].garment
    np.testing.assert_allclose(uv[corners[:, :, 1]], garment.uv[garment.panel_faces], atol=1e-8)
    np.testing.assert_array_equal(corners[:, :, 0], garment.faces)


def test_glb_holds_cloth_and_body_in_one_file(dataset: Dataset, tmp_path: Path) -> None:
    files = export_dataset(dataset.root, tmp_path, "glb")
    assert names(files, tmp_path) == {"drape.glb", *(f"wave/{k:04d}.glb" for k in range(FRAMES))}
    scene = trimesh.load_scene(tmp_path / "wave/0002.glb", process=False)
    assert scene.geometry.keys() == {"cloth", "body"}
    wave = dataset["wave"]
    cloth = scene.geometry["cloth"]
    corners = wave.positions[2][wave.garment.faces]
    np.testing.assert_allclose(cloth.vertices[cloth.faces], corners, atol=1e-6)
    np.testing.assert_allclose(
        cloth.visual.uv[cloth.faces], wave.garment.uv[wave.garment.panel_faces], atol=1e-6
    )


def test_usd_moves_in_time(dataset: Dataset, tmp_path: Path) -> None:
    usd = pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom

    assert usd
    export_dataset(dataset.root, tmp_path, "usd")
    stage = Usd.Stage.Open(str(tmp_path / "wave.usd"))
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert (stage.GetTimeCodesPerSecond(), stage.GetEndTimeCode()) == (30.0, FRAMES - 1)
    wave = dataset["wave"]
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/sample/cloth"))
    for k in range(FRAMES):
        np.testing.assert_array_equal(np.array(mesh.GetPointsAttr().Get(k)), wave.positions[k])
    np.testing.assert_array_equal(np.array(mesh.GetFaceVertexIndicesAttr().Get()), wave.garment.faces.ravel())
    st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").ComputeFlattened()
    uv = wave.garment.uv[wave.garment.panel_faces].reshape(-1, 2)
    np.testing.assert_allclose(np.array(st), uv, atol=1e-7)
    drape = Usd.Stage.Open(str(tmp_path / "drape.usd"))
    assert not UsdGeom.Mesh(drape.GetPrimAtPath("/sample/cloth")).GetPointsAttr().GetTimeSamples()


def test_usd_without_its_package_tells_how_to_get_it(
    dataset: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = builtins.__import__

    def without(name: str, *rest: Any, **more: Any) -> Any:
        if name.startswith("pxr"):
            raise ImportError("No module named 'pxr'")
        return whole(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(InputError, match=r"pip install 'muslin\[usd\]'"):
        export_dataset(dataset.root, tmp_path, "usd")
    assert not list(tmp_path.iterdir())


def test_point_caches_hold_every_frame(dataset: Dataset, tmp_path: Path) -> None:
    files = export_dataset(dataset.root, tmp_path, "pc2", ids=["wave"])
    expected = {f"wave_{part}.{ending}" for part in ("cloth", "body") for ending in ("pc2", "obj")}
    assert names(files, tmp_path) == expected
    cache = tmp_path / "wave_cloth.pc2"
    np.testing.assert_array_equal(read_pc2(cache), dataset["wave"].positions)
    assert cache.stat().st_size == 32 + 12 * 81 * FRAMES
    cache.write_bytes(cache.read_bytes()[:-4])
    with pytest.raises(InputError, match="its header asks for"):
        read_pc2(cache)
    with pytest.raises(InputError, match="not a Point Cache 2 file"):
        read_pc2(tmp_path / "wave_cloth.obj")


def test_npz_holds_the_arrays_and_no_pickle(dataset: Dataset, tmp_path: Path) -> None:
    export_dataset(dataset.root, tmp_path, "npz")
    with np.load(tmp_path / "wave.npz", allow_pickle=False) as arrays:
        wave = dataset["wave"]
        np.testing.assert_array_equal(arrays["cloth_positions"], wave.positions)
        np.testing.assert_array_equal(arrays["cloth_faces"], wave.garment.faces)
        assert arrays["body_positions"].shape[0] == FRAMES
        assert arrays["fps"] == 30.0


def test_unknown_formats_ids_and_files_in_the_way(dataset: Dataset, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="'abc': must be one of obj, ply, glb, usd, pc2, npz"):
        export_dataset(dataset.root, tmp_path, "abc")
    with pytest.raises(InputError, match="no sample 'vave'; it has wave"):
        export_dataset(dataset.root, tmp_path, "obj", ids=["vave"])
    (tmp_path / "drape_body.ply").write_text("mine")
    with pytest.raises(InputError, match=r"drape_body\.ply: exists"):
        export_dataset(dataset.root, tmp_path, "ply", ids=["drape"])
    assert [p.name for p in tmp_path.iterdir()] == ["drape_body.ply"]
    assert (tmp_path / "drape_body.ply").read_text() == "mine"


@pytest.mark.parametrize("file_format", FORMATS)
def test_plain_mesh_files_go_through_every_format(dataset: Dataset, tmp_path: Path, file_format: str) -> None:
    (source,) = export_dataset(dataset.root, tmp_path / "in", "obj", ids=["drape"], body=False)
    files = export_parts("copy", [read_mesh(source)], None, tmp_path / "out", file_format)
    assert files
    assert all(file.is_file() for file in files)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("none.obj", None, "no such file"),
        ("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no triangle|not readable"),
        ("nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "NaN or infinity"),
        ("bad.ply", "ply\nformat ascii 1.0\n", "not readable as a mesh|no triangle"),
        ("image.png", "x", "not readable as a mesh"),
    ],
)
def test_files_that_are_no_mesh(tmp_path: Path, name: str, text: str | None, message: str) -> None:
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=message):
        read_mesh(tmp_path / name)


def test_seams_cut_the_uv_of_an_obj_but_not_its_surface(tmp_path: Path) -> None:
    square = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]], dtype=np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    uv = np.array([[0, 0], [0.4, 0], [0.4, 0.4], [0.5, 0.5], [0.9, 0.9], [0.5, 0.9]])
    part = Part("square", square, faces, uv, np.arange(6, dtype=np.int32).reshape(2, 3))
    np.testing.assert_array_equal(part.uv_to_vertex, [0, 1, 2, 0, 2, 3])
    (file,) = export_parts("cut", [part], None, tmp_path, "obj")
    read = read_mesh(file)
    np.testing.assert_array_equal(read.positions, square)
    np.testing.assert_array_equal(read.faces, faces)
    (file,) = export_parts("cut", [part], None, tmp_path, "glb")
    assert read_mesh(file).positions.shape == (1, 6, 3)


def test_a_moving_obstacle_moves_in_the_export(tmp_path: Path) -> None:
    sample = make_sample(frames=FRAMES)
    assert sample.obstacle_vertices is not None
    moving = np.concatenate([sample.obstacle_vertices + np.float32(0.1 * k) for k in range(FRAMES)])
    _, body = sample_parts(replace(sample, obstacle_vertices=moving))
    np.testing.assert_array_equal(body.positions, moving)
