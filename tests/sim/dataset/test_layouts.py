"""Whole datasets in others' layouts: what their readers compute is what was stored."""

from __future__ import annotations

import csv
import json
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from remeshed_producer import remeshed
from scipy.io import loadmat
from sheet_producer import make_sample

from muslin.eval.read.subject import open_subject
from muslin.garments.errors import InputError
from muslin.sim.body import load_body
from muslin.sim.body.rotation import rotation_matrices
from muslin.sim.dataset import pc2
from muslin.sim.dataset.layouts.catalogue import LAYOUTS
from muslin.sim.dataset.layouts.export import export_layout
from muslin.sim.dataset.reader import Dataset, open_dataset, write_dataset
from muslin.sim.dataset.sample import BodyTrack, Sample

FRAMES = 3
HALF = 2.0**-11
"""Largest relative error of float16."""


def worn(sample_id: str, **labels: str) -> Sample:
    """A sheet that floats by a moving body."""
    generator = np.random.default_rng(1)
    track = BodyTrack(
        model="female",
        digest=load_body("female").digest,
        beta=np.array([0.5, -1.0, 0.7]),
        poses=0.2 * generator.standard_normal((FRAMES, 24, 3)),
        translations=0.5 * generator.standard_normal((FRAMES, 3)),
    )
    sheet = make_sample(sample_id, frames=FRAMES)
    scene = {"motion": {"clip": "/home/me/secret/spin.npz"}, "garment": {"design": "sheet"}}
    bare = replace(sheet, obstacle_vertices=None, obstacle_faces=None, fabric="gray-interlock", scene=scene)
    return replace(bare, body=track, labels=labels)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    samples = [
        replace(make_sample("drape"), labels={"split": "train"}),
        worn("worn", split="train", design="a"),
        replace(make_sample("wave", frames=FRAMES), labels={"split": "test"}),
    ]
    return write_dataset(tmp_path_factory.mktemp("layouts") / "data", samples, {"name": "sheets"})


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.mark.parametrize("layout", ["obj", "hood"])
def test_read_back_as_it_was(dataset: Dataset, tmp_path: Path, layout: str) -> None:
    export_layout(dataset, tmp_path, layout)
    exported = open_subject(tmp_path / "samples", ids=dataset.ids)
    assert sorted(exported.ids) == sorted(dataset.ids)
    for sample in dataset:
        track = exported.load(sample.id)
        assert track.num_frames == sample.num_frames
        assert track.body is not None
        for frame in range(sample.num_frames):
            np.testing.assert_array_equal(np.float32(track.positions[frame]), sample.positions[frame])
            np.testing.assert_array_equal(track.faces[frame], sample.garment.faces)
            body = sample.body_vertices(frame).astype(np.float32)
            np.testing.assert_array_equal(np.float32(track.body.vertices(frame)), body)


def test_point_caches_read_back_turned_and_rounded(dataset: Dataset, tmp_path: Path) -> None:
    export_layout(dataset, tmp_path, "cloth3d")
    exported = open_subject(tmp_path / "samples", ids=dataset.ids)
    for sample in dataset:
        track, info = exported.load(sample.id), loadmat(tmp_path / f"samples/{sample.id}/info.mat")
        assert track.body is not None
        np.testing.assert_array_equal(track.faces[0], sample.garment.faces)
        for frame in range(sample.num_frames):
            for read, stored in (
                (track.positions[frame], sample.positions[frame]),
                (track.body.vertices(frame), sample.body_vertices(frame)),
            ):
                up = stored[:, [0, 2, 1]] * [1, -1, 1]
                bound = HALF * np.abs(read).max() + 1e-6
                np.testing.assert_allclose(read + info["trans"][:, frame], up, rtol=0, atol=bound)
        meta = json.loads((tmp_path / f"samples/{sample.id}/meta.json").read_text())
        assert meta["rounding_error_m"] <= HALF * 2.0
    np.testing.assert_array_equal(loadmat(tmp_path / "samples/wave/info.mat")["trans"], np.zeros((3, FRAMES)))


def test_a_reader_of_cloth3d_poses_the_same_body(dataset: Dataset, tmp_path: Path) -> None:
    """As the starter kit does it: SMPL posed with no translation, less its root at rest, plus trans."""
    export_layout(dataset, tmp_path, "cloth3d", ids=["worn"])
    info = loadmat(tmp_path / "samples/worn/info.mat", squeeze_me=True, struct_as_record=False)
    assert (info["gender"], info["zrot"], info["fps"]) == (0, 0, 30)
    (garment,) = info["outfit"]._fieldnames
    assert getattr(info["outfit"], garment).fabric == "gray-interlock"
    assert (tmp_path / f"samples/worn/{garment}.pc16").is_file()
    assert (info["shape"].shape, info["poses"].shape) == ((10,), (72, FRAMES))
    model, sample = load_body("female"), dataset["worn"]
    beta = info["shape"][: model.num_betas]
    for frame in range(FRAMES):
        posed = model.vertices(beta, info["poses"][:, frame].reshape(24, 3))
        posed += info["trans"][:, frame] - model.rest_joints(beta)[0]
        np.testing.assert_allclose(posed, sample.body_vertices(frame)[:, [0, 2, 1]] * [1, -1, 1], atol=1e-9)


def test_hood_skins_a_garment_into_its_first_frame(dataset: Dataset, tmp_path: Path) -> None:
    export_layout(dataset, tmp_path, "hood")
    with (tmp_path / "aux_data/splits/train.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [(row["id"], row["length"]) for row in rows] == [("drape", "1"), ("worn", str(FRAMES))]
    garments = pickle.loads((tmp_path / "aux_data/garments.pkl").read_bytes())
    assert garments.keys() == {rows[1]["garment"]}
    garment = garments[rows[1]["garment"]]
    one = pickle.loads((tmp_path / f"aux_data/garments/{rows[1]['garment']}.pkl").read_bytes())
    np.testing.assert_array_equal(one["rest_pos"], garment["rest_pos"])
    assert (garment["gender"], garment["model_type"]) == ("female", "smpl")
    assert garment["node_type"].shape == (81, 1)
    with np.load(tmp_path / "motions/worn.npz", allow_pickle=False) as motion:
        beta, pose = motion["betas"], motion["poses"][0].reshape(24, 3)
        transl, rate = motion["trans"][0], motion["mocap_framerate"].item()
    assert rate == 30.0
    # utils/lbs.py of HOOD: v + shapedirs beta + posedirs vec(R - I), then linear blend skinning
    lbs, model = garment["lbs"], load_body("female")
    feature = (rotation_matrices(pose[1:]) - np.eye(3)).reshape(-1)
    shaped = lbs["v"] + lbs["shapedirs"][..., : len(beta)] @ beta + (feature @ lbs["posedirs"]).reshape(-1, 3)
    blended = np.einsum("vj,jab->vab", lbs["lbs_weights"], model.transforms(beta, pose))
    skinned = np.einsum("vab,vb->va", blended[:, :3, :3], shaped) + blended[:, :3, 3] + transl
    np.testing.assert_allclose(skinned, dataset["worn"].positions[0], atol=2e-6)
    assert not (tmp_path / "motions/wave.npz").exists()


def test_hood_finds_rollout_and_mesh_sequence_in_one_pickle(dataset: Dataset, tmp_path: Path) -> None:
    export_layout(dataset, tmp_path, "hood", ids=["wave"])
    file = tmp_path / "samples/wave/sequence.pkl"
    arrays = pickle.loads(file.read_bytes())
    assert arrays.keys() == {"pred", "cloth_faces", "obstacle", "obstacle_faces", "verts", "faces"}
    assert arrays["verts"] is arrays["obstacle"]
    assert arrays["faces"].dtype == np.int64
    assert (
        file.stat().st_size < sum(arrays[k].nbytes for k in ("pred", "cloth_faces", "verts", "faces")) + 2000
    )
    assert not (tmp_path / "aux_data/garments.pkl").exists()


def test_a_body_that_stands_still_is_one_file(dataset: Dataset, tmp_path: Path) -> None:
    export_layout(dataset, tmp_path, "obj")
    assert {p.name for p in (tmp_path / "samples/wave").glob("body*")} == {"body.obj"}
    assert {p.name for p in (tmp_path / "samples/worn").glob("body*")} == {
        f"body_{k:04d}.obj" for k in range(3)
    }
    meta = json.loads((tmp_path / "samples/worn/meta.json").read_text())
    np.testing.assert_array_equal(meta["poses"], dataset["worn"].body.poses)
    export_layout(dataset, tmp_path / "bare", "obj", body=False)
    assert not list((tmp_path / "bare").rglob("body*"))


def test_the_manifest_tells_splits_and_the_header_terms(dataset: Dataset, tmp_path: Path) -> None:
    export_layout(dataset, tmp_path, "obj")
    with (tmp_path / "manifest.csv").open() as stream:
        rows = {row["id"]: row for row in csv.DictReader(stream)}
    assert {name: row["split"] for name, row in rows.items()} == dataset.header.splits
    for name, row in rows.items():
        folder = tmp_path / row["folder"]
        assert len(list(folder.iterdir())) == int(row["files"])
        assert row["geometry_sha256"] == next(r["geometry_sha256"] for r in dataset.rows if r["id"] == name)
    header = json.loads((tmp_path / "export.json").read_text())
    assert header["complete"]
    told = {(entry["what"], entry["name"]): entry["terms"] for entry in header["sources"]}
    assert "CC0" in told["body", "female"]
    assert told["motion", "spin.npz"] == "ask its maker: not part of muslin"
    assert told["fabric", "gray-interlock"] == "cite the paper"
    assert "secret" not in (tmp_path / "export.json").read_text()


@pytest.mark.parametrize("layout", LAYOUTS)
def test_an_export_goes_on_where_it_was_killed(
    dataset: Dataset, tmp_path: Path, layout: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    export_layout(dataset, tmp_path / "whole", layout)
    write = LAYOUTS[layout].write

    def dies(sample: Sample, folder: Path, out: Path, body: bool) -> dict:
        facts = write(sample, folder, out, body)
        if sample.id == "worn":
            raise KeyboardInterrupt
        return facts

    with monkeypatch.context() as patch:
        patch.setitem(LAYOUTS, layout, replace(LAYOUTS[layout], write=dies))
        with pytest.raises(KeyboardInterrupt):
            export_layout(dataset, tmp_path / "cut", layout)
    assert [p.name for p in (tmp_path / "cut/samples").iterdir()] == ["drape"]
    assert not json.loads((tmp_path / "cut/export.json").read_text())["complete"]
    done = export_layout(dataset, tmp_path / "cut", layout)
    assert (done.written, done.kept) == (("worn", "wave"), ("drape",))
    whole, cut = files(tmp_path / "whole"), files(tmp_path / "cut")
    assert whole.keys() == cut.keys()
    assert {name for name in whole if whole[name] != cut[name] and "info.mat" not in name} == set()
    again = export_layout(dataset, tmp_path / "cut", layout)
    assert not again.written
    assert files(tmp_path / "cut") == cut


def test_selections_add_up(dataset: Dataset, tmp_path: Path) -> None:
    told: list[tuple[float, int, str]] = []
    export_layout(dataset, tmp_path, "hood", split="test", progress=lambda *now: told.append(now))
    assert told == [(1, 1, "wave")]
    done = export_layout(dataset, tmp_path, "hood", where={"design": "a"})
    assert done.written == ("worn",)
    assert (tmp_path / "manifest.csv").read_text().count("samples/") == 2
    assert {p.name for p in (tmp_path / "aux_data/splits").iterdir()} == {"train.csv", "test.csv"}


def test_changing_topology_is_exported_or_refused_before_anything_is_written(tmp_path: Path) -> None:
    dataset = write_dataset(tmp_path / "data", [make_sample("first"), remeshed("sway")])
    for layout in ("cloth3d", "hood"):
        with pytest.raises(InputError, match="topology of sample sway changes"):
            export_layout(dataset, tmp_path / layout, layout)
        assert not (tmp_path / layout).exists()
        assert export_layout(dataset, tmp_path / layout, layout, where={"topologies": 1}).written == (
            "first",
        )
    export_layout(dataset, tmp_path / "obj", "obj")
    track = open_subject(tmp_path / "obj/samples", ids=dataset.ids).load("sway")
    sway = dataset["sway"]
    for frame in range(sway.num_frames):
        np.testing.assert_array_equal(np.float32(track.positions[frame]), sway.frame_positions(frame))
        np.testing.assert_array_equal(track.faces[frame], sway.frame_garment(frame).faces)


def test_what_is_in_the_way_is_told_and_left(dataset: Dataset, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="layout 'smpl': must be one of obj, cloth3d, hood"):
        export_layout(dataset, tmp_path, "smpl")
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match=r"not empty \(mine.txt …\) and no export"):
        export_layout(dataset, tmp_path, "obj")
    with pytest.raises(InputError, match="is a file"):
        export_layout(dataset, tmp_path / "mine.txt", "obj")
    assert files(tmp_path) == {"mine.txt": b"mine"}
    out = tmp_path / "out"
    export_layout(dataset, out, "obj", ids=["drape"])
    with pytest.raises(InputError, match="holds an export with layout = 'obj', not 'hood'"):
        export_layout(dataset, out, "hood")
    with pytest.raises(InputError, match="holds an export with body = True, not False"):
        export_layout(dataset, out, "obj", body=False)
    other = write_dataset(tmp_path / "other", [make_sample("drape", phase=1.0)])
    with pytest.raises(InputError, match="another geometry of this sample"):
        export_layout(open_dataset(str(other.root)), out, "obj")


def test_half_precision_caches_have_the_header_of_pc2(tmp_path: Path) -> None:
    positions = np.arange(12.0).reshape(2, 2, 3)
    pc2.write_pc2(tmp_path / "a.pc16", positions, dtype="<f2")
    data = (tmp_path / "a.pc16").read_bytes()
    assert len(data) == 32 + 2 * 12
    np.testing.assert_array_equal(np.frombuffer(data, "<f2", offset=32), np.arange(12))
