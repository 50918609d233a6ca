"""Every command on small, real data: what it writes, what it refuses, with which exit code."""

import json
import subprocess
import sys

import numpy as np
import pytest
import trimesh
from PIL import Image

from muslin.sim.dataset.reader import open_dataset, write_dataset
from tests.eval.cli.commands import muslin, refused

COMMANDS = ("simulate", "generate", "verify", "info", "eval", "report", "export", "pattern", "remesh")
COMMANDS += ("render", "view", "repair")


@pytest.fixture
def dataset(tmp_path, make_sample):
    write_dataset(tmp_path / "data", [make_sample("still"), make_sample("moving", frames=3, height=0.25)])
    return tmp_path / "data"


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_examples(command):
    output = muslin(command, "--help").output
    assert "Example" in output
    assert f"muslin {command}" in output


def test_version_and_commands():
    assert muslin("--version").output.startswith("muslin ")
    help_text = muslin("--help").output
    assert all(command in help_text for command in COMMANDS)
    assert muslin("nonsense", code=2)


def test_help_loads_no_heavy_library():
    code = (
        "import sys; from muslin.eval.cli.app import app; "
        "print([m for m in ('warp','torch','pyvista','matplotlib','igl','zarr','scipy') if m in sys.modules])"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"


def test_verify_passes_and_writes_json(dataset, tmp_path):
    muslin("verify", dataset, "--json", tmp_path / "v.json", "--workers", 1)
    result = json.loads((tmp_path / "v.json").read_text())
    assert (result["samples"], result["frames"]) == (2, 4)
    assert result["cloth_cloth_intersections"] == result["cloth_body_intersections"] == 0
    assert result["failed"] == []


def test_verify_fails_on_an_intersecting_sample(tmp_path, make_sample):
    write_dataset(tmp_path / "bad", [make_sample("good"), make_sample("cut", height=0.1, n=21)])
    result = muslin("verify", tmp_path / "bad", "--json", tmp_path / "v.json", "--workers", 1, code=1)
    assert "cut" in result.stderr
    found = json.loads((tmp_path / "v.json").read_text())
    assert found["failed"] == ["cut"]
    assert found["cloth_body_intersections"] > 0


def test_repair_lists_what_is_damaged_and_moves_nothing_that_it_cannot_make_again(dataset):
    muslin("repair", dataset, "--workers", 1, "--dry-run")
    assert (
        "2 samples checked, 0 damaged, 0 missing, 0 made" in muslin("repair", dataset, "--workers", 1).output
    )
    sample = dataset / "samples" / "still.zarr.zip"
    sample.write_bytes(sample.read_bytes()[:-100])
    damaged = sample.read_bytes()
    listed = muslin("repair", dataset, "--workers", 1, "--dry-run", code=1).output
    assert "still: " in listed
    assert "1 damaged" in listed
    refused("repair", dataset, "--workers", 1, says="not planned by the dataset's config")
    assert sample.read_bytes() == damaged
    assert not (dataset / "failed").exists()


def test_info(dataset):
    assert "still" in muslin("info", dataset, "--samples").output
    facts = json.loads(muslin("info", dataset, "--json").output)
    assert (facts["samples"], facts["frames"]) == (2, 4)


def test_eval_of_a_dataset_against_itself(dataset, tmp_path):
    muslin("eval", dataset, dataset, "--json", tmp_path / "e.json", "--html", tmp_path / "e.html")
    result = json.loads((tmp_path / "e.json").read_text())
    assert result["vertex_error_mm"] == dict.fromkeys(("mean", "rms", "median", "p95", "max"), 0.0)
    assert result["velocity_error_mm_s"]["mean"] == 0.0
    assert result["hausdorff_mm"] <= 0.01
    assert result["penetration"]["ratio"] == 0.0
    page = (tmp_path / "e.html").read_text()
    assert "data:image/jpeg" in page
    assert 'src="http' not in page


def test_eval_of_mesh_files(tmp_path):
    ball = trimesh.creation.icosphere(2)
    ball.export(tmp_path / "a.obj")
    ball.apply_scale(1.01)
    ball.export(tmp_path / "b.ply")
    output = muslin("eval", tmp_path / "b.ply", tmp_path / "a.obj").output
    assert "mean 10 " in output


def test_report_shows_and_cites_the_verification(dataset, tmp_path):
    muslin("verify", dataset, "--json", tmp_path / "v.json", "--workers", 1)
    muslin(
        "report",
        dataset,
        "--html",
        tmp_path / "r.html",
        "--verification",
        tmp_path / "v.json",
        "--workers",
        1,
    )
    page = (tmp_path / "r.html").read_text()
    assert page.count("data:image/jpeg") == 2  # the drape and the contact sheet
    assert page.count("data:image/gif") == 1
    assert "checked again" in page
    assert "gray-interlock" in page
    for outside in ('src="http', 'href="http', "@import", "url(http"):
        assert outside not in page


def test_export_refuses_a_mesh_that_is_not_manifold(tmp_path):
    fan = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n"
    (tmp_path / "fan.obj").write_text(fan)
    refused("export", tmp_path / "fan.obj", "--format", "ply", "--out", tmp_path / "x", says="not manifold")
    assert not (tmp_path / "x").exists()


def test_export_refuses_to_overwrite(dataset, tmp_path):
    muslin("export", dataset, "--format", "obj", "--out", tmp_path / "obj", "--sample", "still")
    assert (tmp_path / "obj" / "still_cloth.obj").is_file()
    refused("export", dataset, "--format", "obj", "--out", tmp_path / "obj", "--sample", "still", says="obj")
    refused("export", dataset, "--format", "max", "--out", tmp_path / "x", says="max")


def test_output_in_a_place_that_cannot_be_is_refused(dataset, tmp_path):
    (tmp_path / "file").write_text("mine")
    refused("export", dataset, "--out", tmp_path / "file" / "out", says="cannot be made")
    scene = tmp_path / "scene.toml"
    scene.write_text('[body]\nmodel = "female"\n')
    refused("simulate", scene, "--out", tmp_path / "file" / "out", says="cannot be made")
    assert (tmp_path / "file").read_text() == "mine"


def test_verify_tells_what_is_not_made_yet(dataset):
    header = json.loads((dataset / "muslin.json").read_text())
    header["splits"]["planned"] = ""
    (dataset / "muslin.json").write_text(json.dumps(header))
    assert "0 failed, 1 not made yet" in muslin("verify", dataset, "--workers", 1).output


def test_export_of_a_mesh_file(tmp_path):
    trimesh.creation.icosphere(1).export(tmp_path / "a.obj")
    muslin("export", tmp_path / "a.obj", "--format", "ply", "--out", tmp_path / "out")
    assert len(list((tmp_path / "out").glob("*.ply"))) == 1


@pytest.mark.parametrize("suffix", ["json", "obj", "svg", "png"])
def test_pattern(tmp_path, suffix):
    out = tmp_path / f"tee.{suffix}"
    muslin("pattern", "tee", "-p", "sleeve_length=0.3", "--edge-length", 0.05, "--out", out)
    assert out.stat().st_size > 500
    before = out.read_bytes()
    refused("pattern", "tee", "--out", out, says="--force")
    assert out.read_bytes() == before


def test_forced_pattern_is_replaced(tmp_path):
    out = tmp_path / "tee.json"
    muslin("pattern", "tee", "--out", out)
    before = out.read_bytes()
    muslin("pattern", "tee", "-p", "sleeve_length=0.5", "--out", out, "--force")
    assert out.read_bytes() != before


def test_pattern_refusals(tmp_path):
    out = tmp_path / "p.json"
    refused("pattern", "cape", "--out", out, says="tee")
    refused("pattern", "tee", "-p", "sleeve=0.2", "--out", out, says="sleeve_length")
    refused("pattern", "tee", "-p", "sleeve_length=9", "--out", out, says="sleeve_length")
    refused("pattern", "tee", "-p", "sleeve_length=long", "--out", out, says="number")
    refused("pattern", "tee", "--out", tmp_path / "p.dxf", says=".svg")
    refused("pattern", tmp_path / "none.json", "--out", out, says="none.json")
    assert not out.exists()


def test_render_pictures_and_movies(dataset, tmp_path):
    muslin("render", dataset, "--out", tmp_path / "sheet.png")
    assert Image.open(tmp_path / "sheet.png").width > 480
    muslin(
        "render", dataset, "--sample", "moving", "--frame", 2, "--size", "120x90", "--out", tmp_path / "f.png"
    )
    assert Image.open(tmp_path / "f.png").size == (120, 90)
    muslin("render", dataset, "--size", "64x80", "--out", tmp_path / "m.gif")
    assert Image.open(tmp_path / "m.gif").n_frames == 2
    assert sorted(p.name for p in tmp_path.iterdir()) == ["data", "f.png", "m.gif", "sheet.png"]
    refused("render", dataset, "--out", tmp_path / "m.gif", says="--force")
    refused("render", dataset, "--out", tmp_path / "m.avi", says=".mp4")
    refused("render", dataset, "--size", "big", "--out", tmp_path / "n.png", says="WIDTHxHEIGHT")
    refused("render", dataset, "--sample", "moving", "--frame", 3, "--out", tmp_path / "n.png", says="0 to 2")
    refused("render", dataset, "--sample", "nobody", "--out", tmp_path / "n.png", says="nobody")


def test_view_without_display(dataset, monkeypatch):
    monkeypatch.setattr("muslin.sim.view.window.sys.platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    refused("view", dataset, says="muslin render")


@pytest.mark.parametrize("command", ["verify", "info", "view"])
def test_no_dataset_is_one_line(command, tmp_path):
    refused(command, tmp_path / "nothing", says="nothing")
    assert not (tmp_path / "nothing").exists()


def test_damaged_sample_is_one_line(dataset):
    sample = dataset / "samples" / "still.zarr.zip"
    sample.write_bytes(sample.read_bytes()[:40])
    refused("eval", dataset, dataset, says="still")


def test_newer_schema_is_one_line(dataset):
    header = json.loads((dataset / "muslin.json").read_text())
    (dataset / "muslin.json").write_text(json.dumps(header | {"schema_version": 99}))
    refused("info", dataset, says="newer")


def test_simulate_and_generate_refuse_bad_input_before_they_begin(tmp_path, dataset):
    refused("simulate", tmp_path / "none.toml", "--out", tmp_path / "out", says="none.toml")
    refused("generate", tmp_path / "none.toml", "--out", tmp_path / "out", says="none.toml")
    scene = tmp_path / "scene.toml"
    scene.write_text('fabric = "gray-interlock"\nspeed = 3\n[body]\nmodel = "female"\n')
    refused("simulate", scene, "--out", tmp_path / "out", says="speed")
    scene.write_text('[body]\nmodel = "female"\n')
    refused("simulate", scene, "--out", tmp_path / "out", "--device", "gpu", says="cuda:0")
    refused("simulate", scene, "--out", tmp_path / "out", "--set", "fabric=tin", says="tin")
    refused("simulate", scene, "--out", dataset, says="not an empty folder")
    assert not (tmp_path / "out").exists()
    assert len(open_dataset(dataset)) == 2


def test_simulation_error_is_exit_code_three(tmp_path, monkeypatch):
    from muslin.sim import run
    from muslin.sim.solve.errors import SimulationError

    def stop(*_):
        raise SimulationError("frame 3, vertex 17: no step is free of intersections; use a smaller dt")

    monkeypatch.setattr(run, "simulate", stop)
    scene = tmp_path / "scene.toml"
    scene.write_text('[body]\nmodel = "female"\n')
    result = muslin("simulate", scene, "--out", tmp_path / "out", code=3)
    assert "frame 3, vertex 17" in result.stderr
    assert "Traceback" not in result.output
    assert not (tmp_path / "out").exists()


def test_what_cannot_go_on_leaves_its_last_good_state(tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text(
        'garment = { design = "sheet", edge_length = 0.2, position = [0.0, 0.205, 0.0] }\n'
        'colliders = [{ shape = "sphere", radius = 0.2, subdivisions = 2 }]\n'
        "sequence = { duration = 0.2 }\nsolver = { max_work = 3 }\n"
    )
    result = muslin("simulate", scene, "--out", tmp_path / "out", code=3)
    kept = tmp_path / "out.last_good.npz"
    assert "frame 1: the budget of Newton iterations is spent" in result.stderr
    assert str(kept) in result.stderr.replace("\n", "")
    assert not (tmp_path / "out").exists()
    with np.load(kept) as state:
        assert state["positions"].shape == state["velocity"].shape
        assert state["faces"].max() == len(state["positions"]) - 1
        assert state["collider_faces"].max() == len(state["collider_vertices"]) - 1


def test_simulated_sample_is_stored(tmp_path, make_sample, monkeypatch):
    from muslin.sim import run

    sample = make_sample("made")
    monkeypatch.setattr(run, "simulate", lambda scene, device, progress: sample)
    scene = tmp_path / "scene.toml"
    scene.write_text('[body]\nmodel = "female"\n')
    muslin("simulate", scene, "--out", tmp_path / "out")
    stored = open_dataset(tmp_path / "out")["made"]
    assert np.array_equal(stored.positions, sample.positions)
    refused("simulate", scene, "--out", tmp_path / "out", says="not an empty folder")


def test_violated_expectations_are_listed_with_exit_code_one(tmp_path, make_sample, monkeypatch):
    from muslin.sim import run

    sample = make_sample("made")
    monkeypatch.setattr(run, "simulate", lambda scene, device, progress: sample)
    scene = tmp_path / "scene.toml"
    scene.write_text('[body]\nmodel = "female"\n[expect]\nsmallest_distance = 0.02\nframes = 1\n')
    result = muslin("simulate", scene, "--out", tmp_path / "out", code=1)
    assert "expect.smallest_distance: measured 0.01 m, allowed is at least 0.02 m" in result.stderr
    assert "frames:" not in result.stderr
    assert len(open_dataset(tmp_path / "out")) == 1, "what was computed is kept, to be looked at"


def test_every_command_takes_a_sequence_whose_topology_changes(tmp_path, remeshed_sample, make_sample):
    data = write_dataset(tmp_path / "data", [remeshed_sample]).root
    facts = json.loads(muslin("info", data, "--json").output)
    assert (facts["remeshed"], facts["frames"], facts["vertices"]) == (1, 3, [144, 144])
    muslin("verify", data, "--json", tmp_path / "v.json", "--workers", 1)
    assert json.loads((tmp_path / "v.json").read_text())["frames"] == 3
    for name in ("last.png", "film.gif"):
        muslin(
            "render", data, "--sample", "remeshed", "--frame", 2, "--size", "64x64", "--out", tmp_path / name
        )
    assert Image.open(tmp_path / "film.gif").n_frames == 2  # thinned to 15 a second
    muslin("report", data, "--html", tmp_path / "r.html", "--workers", 1)
    assert (tmp_path / "r.html").read_text().count("data:image/gif") == 1
    muslin("export", data, "--format", "obj", "--out", tmp_path / "obj")
    sizes = [len(trimesh.load(f, process=False).vertices) for f in sorted(tmp_path.glob("obj/*/cloth_*.obj"))]
    assert sizes == [49, 49, 144]
    refused("export", data, "--format", "pc2", "--out", tmp_path / "x", says="export it as usd")
    write_dataset(tmp_path / "fixed", [make_sample("remeshed", frames=3, height=0.24)])
    muslin("eval", data, tmp_path / "fixed", "--json", tmp_path / "e.json", "--html", tmp_path / "e.html")
    found = json.loads((tmp_path / "e.json").read_text())
    assert found["vertex_error_mm"]["max"] == pytest.approx(30.0, abs=1e-3)
    assert found["velocity_error_mm_s"]["max"] < 0.01
