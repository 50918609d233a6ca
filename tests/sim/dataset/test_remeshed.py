"""Sequences of changing topology: stored bit for bit, verified, and exported frame by frame."""

from __future__ import annotations

import json
import pickle
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
import zarr
from remeshed_producer import FRAME_TOPOLOGY, remeshed, sheet_at, swayed
from sheet_producer import RADIUS, make_sample
from unpacked import chunk_of, entries_of, unpacked

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.sim.certify import certify
from muslin.sim.dataset import store
from muslin.sim.dataset.certificate import Certificate
from muslin.sim.dataset.codecs import numcodecs_unremarked
from muslin.sim.dataset.export import export_dataset
from muslin.sim.dataset.header import Header, digest, prepare_root
from muslin.sim.dataset.index import COLUMNS, read_index
from muslin.sim.dataset.info import info
from muslin.sim.dataset.local_root import LocalRoot
from muslin.sim.dataset.parts import read_mesh
from muslin.sim.dataset.reader import Dataset, open_dataset, write_dataset
from muslin.sim.dataset.remeshed import RemeshedSequence, sample_of_frames
from muslin.sim.dataset.sample import Sample
from muslin.sim.dataset.schema import INDEX, REMESHED_ARRAYS
from muslin.sim.dataset.verify import verify

FRAMES = len(FRAME_TOPOLOGY)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    samples = [make_sample("still", frames=2), remeshed()]
    return write_dataset(tmp_path_factory.mktemp("remeshed") / "data", samples)


@pytest.fixture
def root(tmp_path: Path) -> LocalRoot:
    place = LocalRoot(tmp_path / "data")
    prepare_root(place, Header(config={}, splits={"sway": ""}))
    return place


def same_mesh(a: GarmentMesh, b: GarmentMesh) -> None:
    for part in fields(a):
        np.testing.assert_array_equal(getattr(a, part.name), getattr(b, part.name))


def test_every_frame_survives_the_round_trip_bit_for_bit(dataset: Dataset) -> None:
    written, read = remeshed(), dataset["sway"]
    assert isinstance(read, RemeshedSequence)
    assert read.num_frames == FRAMES
    assert len(read.garments) == 3
    for t in range(FRAMES):
        assert read.frame_positions(t).tobytes() == written.frame_positions(t).tobytes()
        assert read.frame_positions(t).dtype == np.float32
        same_mesh(read.frame_garment(t), written.frame_garment(t))
    assert read.frame_garment(5) is read.frame_garment(0)
    assert read.num_vertices == sheet_at(0.11).num_vertices
    assert (read.fps, read.fabric, read.certificate) == (30.0, "paper", written.certificate)
    np.testing.assert_array_equal(read.body_vertices(3), written.body_vertices(3))


def test_what_a_changing_topology_has_not_is_refused_by_name(dataset: Dataset) -> None:
    sample = pickle.loads(pickle.dumps(dataset["sway"]))
    for name in ("garment", "positions"):
        with pytest.raises(InputError, match=rf"sway: its topology changes.*frame_{name}"):
            getattr(sample, name)
    assert not hasattr(sample, "faces")
    assert replace(sample, id="other").frame_positions(2) is sample.frame_positions(2)


def test_a_fixed_topology_answers_frame_by_frame_too(dataset: Dataset) -> None:
    still = dataset["still"]
    assert still.garments == (still.garment,)
    assert still.frame_garment(1) is still.garment
    np.testing.assert_array_equal(still.frame_positions(1), still.positions[1])


def test_frames_make_the_sample_that_they_need() -> None:
    about = {"id": "a", "kind": "sequence", "certificate": Certificate(), "fps": 30.0}
    coarse, fine = sheet_at(0.2), sheet_at(0.11)
    meshes = [coarse, fine, coarse]
    made = sample_of_frames(meshes, [swayed(mesh, t) for t, mesh in enumerate(meshes)], **about).validate()
    assert isinstance(made, RemeshedSequence)
    assert made.frame_topology.tolist() == [0, 1, 0]
    assert [made.frame_garment(t) for t in range(3)] == meshes
    fixed = sample_of_frames([fine, fine], [swayed(fine, t) for t in range(2)], **about).validate()
    assert type(fixed) is Sample
    assert fixed.positions.shape == (2, fine.num_vertices, 3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"kind": "drape"}, "7 frames is not allowed"),
        ({"topologies": ()}, "no topology"),
        ({"frame_topology": np.zeros(7, np.int32)}, r"frame_topology of \[0\].*all from 0 to 2"),
        ({"frame_topology": np.array([0, 0, 1, 1, 3, 2, 0], np.int32)}, r"\[0, 1, 2, 3\]"),
        ({"frame_topology": np.array(FRAME_TOPOLOGY)}, "int64.*int32"),
        ({"frame_topology": np.array([0, 1, 2], np.int32)}, r"frame_topology of shape \(3,\)"),
        ({"frames": tuple(swayed(sheet_at(0.2), t) for t in range(7))}, "positions in frame 2 of shape"),
        ({"topologies": (sheet_at(0.2), sheet_at(0.11), replace(sheet_at(0.15), name="x"))}, "topology 2 of"),
        (
            {"frames": (*remeshed().frames[:6], np.full_like(remeshed().frames[6], np.nan))},
            "NaN or infinity in positions in frame 6",
        ),
    ],
)
def test_what_cannot_be_is_never_written(root: LocalRoot, change: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        store.write_sample(root, remeshed(**change))
    assert store.stored_ids(root) == []


@pytest.mark.parametrize(
    "name", sorted(REMESHED_ARRAYS.keys() - {"face_panel"})
)  # all zero, so no chunk is stored
def test_a_damaged_array_is_named_with_a_remedy(root: LocalRoot, name: str) -> None:
    store.write_sample(root, remeshed())
    with unpacked(store.sample_file(root.path, "sway")) as folder:
        chunk = chunk_of(folder, name)
        data = bytearray(chunk.read_bytes())
        data[-1] ^= 0x10
        chunk.write_bytes(data)
    with pytest.raises(InputError, match=rf"sway\.zarr\.zip/{name}: .*muslin repair"):
        store.read_sample(root, "sway")


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("topology_sizes", lambda a: a + 1, "faces has .* rows; topology_sizes and frame_topology ask for"),
        ("topology_sizes", lambda a: a[:, :2], r"topology_sizes has shape \(3, 2\)"),
        ("frame_topology", lambda a: a + 1, "frame_topology must be from 0 to 2"),
        ("frame_topology", lambda a: a[::-1] * 0, "positions has .* rows"),
        ("positions", lambda a: a[:-1], "positions has .* rows"),
    ],
)
def test_arrays_that_do_not_fit_each_other_are_refused(
    root: LocalRoot, name: str, change, message: str
) -> None:
    # Checksums that match: what a faulty writer would leave.
    store.write_sample(root, remeshed())
    with unpacked(store.sample_file(root.path, "sway")) as folder, numcodecs_unremarked():
        group = zarr.open_group(zarr.storage.LocalStore(folder), mode="r+")
        array = np.ascontiguousarray(change(np.asarray(group[name][...])))
        del group[name]
        group.create_array(name, data=array)
        group.attrs["sha256"] = {**group.attrs["sha256"], name: store._sha256(array)}
    with pytest.raises(InputError, match=rf"sway\.zarr\.zip: {message}"):
        store.read_sample(root, "sway")


def test_only_samples_that_need_it_are_of_the_newer_schema(dataset: Dataset, tmp_path: Path) -> None:
    versions = {i: store.read_meta(dataset.root, i)[0]["schema_version"] for i in dataset.ids}
    assert versions == {"still": 1, "sway": 2}
    assert "topologies" not in store.read_meta(dataset.root, "still")[0]
    fixed = write_dataset(tmp_path / "fixed", [make_sample("still", frames=2)])
    a, b = (store.sample_file(data.root.path, "still") for data in (dataset, fixed))
    assert entries_of(a) == entries_of(b)
    import pyarrow.parquet as parquet

    assert parquet.read_schema(fixed.root.path / INDEX).names == COLUMNS.names
    assert parquet.read_schema(dataset.root.path / INDEX).names == [*COLUMNS.names, "topologies"]


def test_index_and_summary_count_topologies(dataset: Dataset) -> None:
    assert [row["topologies"] for row in dataset.rows] == [1, 3]
    assert dataset.where(topologies=3).ids == ("sway",)
    assert dataset.rows[1]["vertices"] == sheet_at(0.11).num_vertices
    found = info(dataset.root)
    assert (found.sequences_made, found.remeshed, found.frames) == (2, 1, 2 + FRAMES)
    folder = dataset.root.path
    (folder / INDEX).rename(folder / "kept")
    try:
        assert read_index(dataset.root, dataset.header) == dataset.rows
    finally:
        (folder / "kept").rename(folder / INDEX)


def test_verification_finds_the_one_bad_frame(tmp_path: Path) -> None:
    cut = list(remeshed().frames)
    cut[4] = cut[4] - np.float32([0, 0.5 * RADIUS, 0])
    write_dataset(tmp_path / "data", [remeshed("good"), remeshed("cut", frames=tuple(cut))])
    result = verify(tmp_path / "data", workers=1)
    assert (result.samples, result.frames) == (2, 2 * FRAMES)
    assert result.failed.keys() == {"cut"}
    assert result.failed["cut"].startswith("frame 4: ")
    assert result.cloth_body_intersections > 0


def test_verification_validates_every_topology(tmp_path: Path) -> None:
    write_dataset(tmp_path / "data", [remeshed()])
    with unpacked(store.sample_file(tmp_path / "data", "sway")) as folder:
        group = zarr.open_group(zarr.storage.LocalStore(folder), mode="r+")
        vertices = np.asarray(group["panel_vertices"][...])
        vertices[-1, 0] = np.nan  # of the last topology
        group["panel_vertices"][...] = vertices
        group.attrs["sha256"] = {**group.attrs["sha256"], "panel_vertices": store._sha256(vertices)}
    result = verify(tmp_path / "data", workers=1)
    assert "panel_vertices" in result.failed["sway"]


def test_certificates_count_over_all_topologies() -> None:
    found = certify(remeshed(), Certificate(seed=3)).certificate
    assert (found.cloth_cloth_intersections, found.cloth_body_intersections, found.seed) == (0, 0, 3)
    # dx/du = (1, SWAY sin(0.7 t), 0): its length is the larger stretch, on every mesh
    steepest = max(abs(np.sin(0.7 * t)) for t in range(FRAMES))
    assert found.largest_strain == pytest.approx(np.sqrt(1 + (0.02 * steepest) ** 2) - 1, rel=1e-2)


@pytest.mark.parametrize("file_format", ["obj", "ply", "glb"])
def test_meshes_of_every_frame(dataset: Dataset, tmp_path: Path, file_format: str) -> None:
    export_dataset(dataset.root, tmp_path, file_format, ids=["sway"])
    sample = dataset["sway"]
    for t in range(FRAMES):
        mesh, positions = sample.frame_garment(t), sample.frame_positions(t)
        if file_format == "glb":
            cloth = trimesh.load_scene(tmp_path / f"sway/{t:04d}.glb", process=False).geometry["cloth"]
            np.testing.assert_allclose(cloth.vertices[cloth.faces], positions[mesh.faces], atol=1e-6)
            np.testing.assert_allclose(cloth.visual.uv[cloth.faces], mesh.uv[mesh.panel_faces], atol=1e-6)
        else:
            read = read_mesh(tmp_path / f"sway/cloth_{t:04d}.{file_format}")
            np.testing.assert_array_equal(read.positions[0], positions)
            np.testing.assert_array_equal(read.faces, mesh.faces)


def test_usd_samples_topology_over_time(dataset: Dataset, tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom

    export_dataset(dataset.root, tmp_path, "usd", ids=["sway"])
    stage = Usd.Stage.Open(str(tmp_path / "sway.usd"))
    cloth = UsdGeom.Mesh(stage.GetPrimAtPath("/sample/cloth"))
    sample = dataset["sway"]
    for t in range(FRAMES):
        mesh = sample.frame_garment(t)
        np.testing.assert_array_equal(np.array(cloth.GetPointsAttr().Get(t)), sample.frame_positions(t))
        np.testing.assert_array_equal(np.array(cloth.GetFaceVertexIndicesAttr().Get(t)), mesh.faces.ravel())
        assert len(cloth.GetFaceVertexCountsAttr().Get(t)) == len(mesh.faces)
        st = np.array(UsdGeom.PrimvarsAPI(cloth).GetPrimvar("st").ComputeFlattened(t))
        np.testing.assert_allclose(st, mesh.uv[mesh.panel_faces].reshape(-1, 2), atol=1e-7)
    assert cloth.GetFaceVertexIndicesAttr().GetTimeSamples() == [0, 1, 2, 3, 4, 5, 6]
    body = UsdGeom.Mesh(stage.GetPrimAtPath("/sample/body"))
    assert body.GetFaceVertexIndicesAttr().GetTimeSamples() == []


def test_npz_has_an_entry_a_frame_and_a_topology(dataset: Dataset, tmp_path: Path) -> None:
    export_dataset(dataset.root, tmp_path, "npz", ids=["sway"])
    sample = dataset["sway"]
    with np.load(tmp_path / "sway.npz", allow_pickle=False) as arrays:
        for t, k in enumerate(arrays["cloth_topology"]):
            np.testing.assert_array_equal(arrays[f"cloth_positions_{t:04d}"], sample.frame_positions(t))
            np.testing.assert_array_equal(arrays[f"cloth_faces_{k}"], sample.frame_garment(t).faces)
            np.testing.assert_array_equal(arrays[f"cloth_uv_{k}"], sample.frame_garment(t).uv)
        assert arrays["body_positions"].shape[0] == FRAMES


def test_a_point_cache_is_refused_with_a_remedy(dataset: Dataset, tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"pc2: the topology of sway's cloth changes .* usd, .* obj, ply or glb"
    ):
        export_dataset(dataset.root, tmp_path, "pc2", ids=["sway"])
    assert not list(tmp_path.iterdir())


def test_a_dataset_of_the_older_form_is_read(tmp_path: Path) -> None:
    made = write_dataset(tmp_path / "data", [make_sample("old", frames=2)])
    meta, _ = store.read_meta(made.root, "old")
    values = json.loads(entries_of(store.sample_file(tmp_path / "data", "old"))["zarr.json"])
    assert values["attributes"]["meta_sha256"] == digest(meta | {"schema_version": 1})
    assert type(open_dataset(made.root)["old"]) is Sample
