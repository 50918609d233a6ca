"""`muslin remesh` on small, real data: what it writes, what it refuses."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from muslin.garments.designs.tee import TEE
from muslin.garments.mesh import GarmentMesh
from muslin.garments.obj import read_garment, write_garment
from muslin.garments.template import template
from muslin.sim.body import load_body
from muslin.sim.dataset.intersections import find_crossings
from muslin.sim.dataset.reader import write_dataset
from muslin.sim.dataset.sample import BodyTrack
from tests.eval.cli.commands import muslin, refused


def remesh(*arguments, code: int = 0):
    return muslin("remesh", *arguments, code=code)


def refuses(*arguments, says: str):
    refused("remesh", *arguments, says=says)


def drape(path: Path) -> tuple[GarmentMesh, np.ndarray]:
    mesh, positions = read_garment(path)
    assert positions is not None
    return mesh, positions


@pytest.fixture
def dataset(tmp_path, make_sample):
    """Sheets of 10 cm cells: one still, one that rises 1 cm a frame, 1 cm above a sphere."""
    write_dataset(tmp_path / "data", [make_sample("still"), make_sample("moving", frames=3)])
    return tmp_path / "data"


@pytest.fixture
def panels(tmp_path) -> Path:
    write_garment(template("tee", TEE.preset("tshirt"), 1400), tmp_path / "panels.obj")
    return tmp_path / "panels.obj"


def test_a_sample_is_remeshed_off_its_body(dataset, tmp_path, make_sample):
    out = tmp_path / "new" / "out.obj"
    line = remesh(dataset / "samples" / "still.zarr.zip", "--target-area", 1e-3, "--out", out).output
    mesh, positions = drape(out)
    assert mesh.face_areas.mean() == pytest.approx(1e-3, rel=0.01)
    np.testing.assert_allclose(positions[:, 1], 0.21, atol=1e-6)
    sample = make_sample()
    assert len(find_crossings(positions, mesh.faces, sample.body_vertices(0), sample.body_faces)) == 0
    for part in ("vertices,", f"{len(mesh.faces)} faces", "cm²", "smallest angle", "distortion", "moved"):
        assert part in line


def test_a_frame_of_a_sequence(dataset, tmp_path):
    remesh(dataset, "--sample", "moving", "--frame", 2, "--target-area", 2e-3, "--out", tmp_path / "f.obj")
    np.testing.assert_allclose(drape(tmp_path / "f.obj")[1][:, 1], 0.23, atol=1e-6)
    refuses(
        *(dataset, "--sample", "moving", "--frame", 3, "--target-area", 2e-3, "--out", tmp_path / "g.obj"),
        says="frames 0 to 2",
    )


def test_seeds_repeat_and_topologies_are_numbered(dataset, tmp_path):
    common = (dataset, "--sample", "still", "--target-area", 2e-3)
    remesh(*common, "--seed", 3, "--topologies", 2, "--out", tmp_path / "t.obj")
    remesh(*common, "--seed", 4, "--out", tmp_path / "alone.obj")
    files = sorted(path.name for path in tmp_path.glob("t*.obj"))
    assert files == ["t_3.obj", "t_4.obj"]
    first, second, alone = (tmp_path / name for name in ("t_3.obj", "t_4.obj", "alone.obj"))
    assert second.read_bytes() == alone.read_bytes()
    assert first.read_bytes() != second.read_bytes()
    areas = [drape(file)[0].face_areas.mean() for file in (first, second)]
    assert areas[0] == pytest.approx(areas[1], rel=0.01)


def test_panels_alone_and_targets_of_single_panels(panels, tmp_path):
    out = tmp_path / "out.obj"
    remesh(panels, "--target-area", 6e-4, "--panel-area", "front=2e-4", "--out", out)
    mesh, positions = read_garment(out)
    assert positions is None
    for panel, name in enumerate(mesh.panel_names):
        wanted = 2e-4 if name == "front" else 6e-4
        assert mesh.face_areas[mesh.face_panel == panel].mean() == pytest.approx(wanted, rel=0.04)
    assert mesh.parameters == pytest.approx(TEE.preset("tshirt"))


def test_a_garment_file_with_a_fold_is_refined_there(tmp_path, make_sample):
    garment = make_sample(n=33).garment
    x, y = garment.panel_vertices.T
    bend = 0.05 * np.cos(np.clip((x - 0.4) / 0.05, -0.5 * np.pi, 0.5 * np.pi))
    write_garment(garment, tmp_path / "fold.obj", np.stack([x, bend, -y], axis=1))
    arguments = (tmp_path / "fold.obj", "--target-area", 1e-3, "--refine-angle", 0.2, "--aspect-min", 0.5)
    remesh(*arguments, "--size-max", 0.1, "--out", tmp_path / "out.obj")
    mesh, _ = drape(tmp_path / "out.obj")
    middle = np.abs(mesh.panel_vertices[mesh.panel_faces].mean(axis=1)[:, 0] - 0.4)
    assert mesh.face_areas.mean() == pytest.approx(1e-3, rel=0.02)
    assert mesh.face_areas[middle < 0.05].mean() < 0.3 * mesh.face_areas[middle > 0.2].mean()


def test_the_binding_carries_skinning_weights(tmp_path, make_sample):
    """A sheet before a body: weights are non-negative, of sum one, and vertices are found where they lie."""
    body = load_body("female")
    track = BodyTrack("female", body.digest, np.zeros(body.num_betas), np.zeros((1, 24, 3)), np.zeros((1, 3)))
    sample = make_sample(body=False)
    x, _, z = sample.positions[0].T
    upright = np.stack([x, 1.0 - z, np.full_like(x, 0.6)], axis=1)[None]
    write_dataset(tmp_path / "data", [replace(sample, positions=upright, body=track)])
    out = tmp_path / "out.obj"
    remesh(tmp_path / "data", "--target-area", 2e-3, "--binding", "--interpolate", "--out", out)
    mesh, positions = drape(out)
    with np.load(out.with_suffix(".npz")) as found:
        corners, weights, skinning = (found[key] for key in ("source_vertices", "source_weights", "skinning"))
    assert skinning.shape == (mesh.num_vertices, 24)
    assert skinning.min() >= -1e-12
    np.testing.assert_allclose(skinning.sum(axis=1), 1.0)
    np.testing.assert_allclose(np.einsum("vk,vkj->vj", weights, upright[0][corners]), positions, atol=1e-6)


def test_a_source_that_crosses_the_body_is_remeshed_with_a_note(tmp_path, make_sample):
    write_dataset(tmp_path / "data", [make_sample("cut", height=0.1, n=21)])
    result = remesh(tmp_path / "data", "--target-area", 2e-3, "--out", tmp_path / "out.obj")
    assert "intersections itself" in result.stderr
    np.testing.assert_allclose(drape(tmp_path / "out.obj")[1][:, 1], 0.1, atol=1e-6)


def test_what_is_wrong_is_said_in_a_line(dataset, panels, tmp_path):
    out = ("--out", tmp_path / "out.obj")
    area = ("--target-area", 4e-4)
    refuses(panels, *area, "--out", tmp_path / "out.ply", says="written as .obj")
    refuses(dataset, *area, *out, says="--sample")
    refuses(dataset, "--sample", "nobody", *area, *out, says="no sample")
    refuses(tmp_path / "none.obj", *area, *out, says="no such file")
    refuses(panels, *out, says="--target-area")
    refuses(panels, "--target-area", -1, *out, says="must be positive")
    refuses(panels, *area, "--panel-area", "collar=1e-4", *out, says="no such panel")
    refuses(panels, *area, "--panel-area", "front", *out, says="NAME=AREA")
    refuses(panels, *area, "--size-min", 0.01, *out, says="--refine-angle")
    refuses(panels, *area, "--refine-angle", 0.3, *out, says="no drape")
    refuses(dataset, "--sample", "still", "--refine-angle", 0.3, "--size-min", 0.3, *out, says="size_min")
    refuses(panels, *area, "--max-distortion", 1, *out, says="more than 1")
    (tmp_path / "out.obj").write_text("mine")
    refuses(panels, *area, *out, says="is there already")
    assert (tmp_path / "out.obj").read_text() == "mine"
