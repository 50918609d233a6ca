"""Folders: which files are frames of one sequence, which are samples, and which is the body."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from muslin.eval.read.options import ReadOptions
from muslin.eval.read.subject import matched, open_subject
from muslin.garments.errors import InputError
from muslin.sim.dataset.export import export_dataset
from muslin.sim.dataset.reader import write_dataset

from .conftest import assert_lies_on, assert_shows, cache, write_obj


def only(path, **how):
    subject = open_subject(path, options=ReadOptions(**how))
    assert len(subject.ids) == 1
    return subject.load(subject.ids[0])


def test_frames_come_in_the_order_of_their_numbers(tmp_path, scene):
    for t, name in enumerate(("frame_2", "frame_9", "frame_10", "frame_011")):
        write_obj(tmp_path / f"walk/{name}.obj", scene.positions[t], scene.faces)
    track = only(tmp_path / "walk", fps=30.0)
    assert_shows(track, scene, 1e-9)
    assert track.fps == 30.0
    assert len(track.notes) == 1
    assert "2 to 9" in track.notes[0]


def test_every_second_frame_is_no_gap(tmp_path, scene):
    for t, x in enumerate(scene.positions):
        write_obj(tmp_path / f"walk/{2 * t}.obj", x, scene.faces)
    assert only(tmp_path / "walk").notes == ()


def test_two_files_of_one_number_are_refused(tmp_path, scene):
    for name in ("frame_1", "frame_01"):
        write_obj(tmp_path / f"walk/{name}.obj", scene.positions[0], scene.faces)
    with pytest.raises(InputError, match="same number 1"):
        only(tmp_path / "walk")


def test_a_moving_and_a_still_body_beside_the_frames(tmp_path, scene):
    for t, x in enumerate(scene.positions):
        for folder in ("moving", "still"):
            write_obj(tmp_path / f"{folder}/cloth_{t:04}.obj", x, scene.faces)
        write_obj(tmp_path / f"moving/body_{t:04}.obj", scene.body, scene.body_faces)
    write_obj(tmp_path / "still/body.obj", scene.body, scene.body_faces)
    for folder, frames in (("moving", 4), ("still", 1)):
        track = only(tmp_path / folder)
        assert_shows(track, scene, 1e-9)
        assert_lies_on(track, scene)
        assert track.body.num_frames == frames


def test_two_unnamed_series_are_refused(tmp_path, scene):
    for t in range(2):
        for name in ("left", "right"):
            write_obj(tmp_path / f"walk/{name}_{t}.obj", scene.positions[t], scene.faces)
    with pytest.raises(InputError, match="which series of files is the garment"):
        only(tmp_path / "walk")


def test_files_are_matched_with_samples_by_name(tmp_path, make_sample):
    samples = [make_sample(f"drape_{k:02}", height=0.21 + 0.01 * k) for k in range(3)]
    write_dataset(tmp_path / "truth", samples)
    for sample in samples[:2]:
        write_obj(tmp_path / f"p/{sample.id}_cloth.obj", sample.positions[0], sample.garment.faces)
    truth = open_subject(tmp_path / "truth")
    prediction = open_subject(tmp_path / "p", ids=truth.ids)
    pairs, left, missing = matched(prediction, truth)
    assert pairs == [("drape_00", "drape_00"), ("drape_01", "drape_01")]
    assert (left, missing) == ([], ["drape_02"])
    # without the names of samples they could as well be frames
    assert open_subject(tmp_path / "p").load("p").num_frames == 2


@pytest.mark.parametrize("file_format", ["obj", "ply", "glb", "usd", "pc2", "npz"])
def test_what_muslin_exports_reads_back(tmp_path, make_sample, file_format):
    samples = [replace(make_sample(name, frames=3), fps=25.0) for name in ("walk", "run")]
    write_dataset(tmp_path / "d", samples)
    export_dataset(tmp_path / "d", tmp_path / "out", file_format)
    truth, subject = open_subject(tmp_path / "d"), open_subject(tmp_path / "out")
    assert sorted(subject.ids) == ["run", "walk"]
    track, original = subject.load("run"), truth.load("run")
    assert track.num_frames == 3
    assert track.fps == (25.0 if file_format in ("usd", "npz") else None)
    assert track.body is not None
    for t in range(3):
        x, y = track.positions[t], original.positions[t]
        if file_format == "glb":  # vertices are cut at seams of the uv map there
            x = x[track.faces[t]]
            y = y[original.faces[t]]
        else:
            np.testing.assert_array_equal(track.faces[t], original.faces[t])
        np.testing.assert_allclose(x, y, atol=1e-6)
        np.testing.assert_allclose(track.body.vertices(t), original.body.vertices(t), atol=1e-6)


def test_changing_topology_of_an_npz_and_a_usd(tmp_path, remeshed_sample):
    write_dataset(tmp_path / "d", [remeshed_sample])
    truth = open_subject(tmp_path / "d").load("remeshed")
    for file_format in ("npz", "usd"):
        export_dataset(tmp_path / "d", tmp_path / file_format, file_format)
        track = only(tmp_path / file_format)
        assert [len(x) for x in track.positions] == [49, 49, 144]
        assert track.faces[0] is track.faces[1]
        for t in range(3):
            np.testing.assert_array_equal(track.faces[t], truth.faces[t])
            np.testing.assert_allclose(track.positions[t], truth.positions[t], atol=1e-6)


def test_a_dataset_of_cloth3d_has_garments_of_sequences(tmp_path, scene):
    for sequence in ("01_01_s0", "01_02_s1"):
        for garment in ("Tshirt", "Trousers"):
            write_obj(tmp_path / f"c/{sequence}/{garment}.obj", scene.positions[0], scene.faces)
            (tmp_path / f"c/{sequence}/{garment}.pc16").write_bytes(cache(scene.positions, "<f2"))
        (tmp_path / f"c/{sequence}/info.mat").write_bytes(b"not read")
    subject = open_subject(tmp_path / "c")
    assert len(subject.ids) == 4
    assert_shows(subject.load("01_02_s1/Tshirt"), scene, 2e-4)
    assert open_subject(tmp_path / "c/01_01_s0").ids == ("Trousers", "Tshirt")


def test_two_files_for_one_sample_are_refused(tmp_path, scene):
    (tmp_path / "p").mkdir()
    np.savez(tmp_path / "p/walk.npz", vertices=scene.positions, faces=scene.faces)
    np.save(tmp_path / "p/walk.npy", scene.positions)
    with pytest.raises(InputError, match="both 'walk'"):
        open_subject(tmp_path / "p")


def test_a_folder_without_anything_to_read(tmp_path):
    (tmp_path / "p/deeper").mkdir(parents=True)
    (tmp_path / "p/readme.txt").write_text("hello")
    with pytest.raises(InputError, match="neither a dataset"):
        open_subject(tmp_path / "p")
