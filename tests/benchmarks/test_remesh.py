"""What remeshers are given, what is read back, and the table of what they made."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from benchmarks.remesh import Case, Result, cases_of, garment, make_task, panels_of, source_mesh, table
from benchmarks.remeshers.catalogue import MUSLIN, REMESHERS
from benchmarks.remeshers.exchange import (
    RECORD_FILE,
    Panels,
    Task,
    contend,
    join,
    load_panels,
    load_task,
    panel_by_panel,
)
from muslin.eval.metrics.mesh_quality import quality
from muslin.garments.mesh import corner_angles

CASE = Case("sweater", 403, 200)


@pytest.fixture(scope="module")
def task() -> Task:
    return make_task(CASE)


def assert_same(a: Panels, b: Panels) -> None:
    for entry in fields(Panels):
        np.testing.assert_array_equal(getattr(a, entry.name), getattr(b, entry.name))


def test_cases_are_all_pairs_of_presets_and_sizes() -> None:
    assert cases_of("top, sweater", "403:200,403:800") == [
        Case("top", 403, 200),
        Case("top", 403, 800),
        Case("sweater", 403, 200),
        Case("sweater", 403, 800),
    ]
    for wrong in ("403", "403:x", "403:200:1"):
        with pytest.raises(ValueError, match="SOURCE:TARGET"):
            cases_of("top", wrong)


def test_the_target_area_makes_the_vertices_asked_for(task: Task) -> None:
    mesh = source_mesh(CASE)
    assert mesh.face_areas.sum() / task.target_area == pytest.approx(2 * CASE.target)
    assert np.sqrt(3.0) / 4.0 * task.edge_length**2 == pytest.approx(task.target_area)
    assert task.corner.sum() == 26
    assert len(task.positions) == mesh.num_vertices


def test_a_task_survives_its_file(task: Task, tmp_path: Path) -> None:
    task.save(tmp_path / "task.npz")
    read = load_task(tmp_path / "task.npz")
    assert_same(read.panels, task.panels)
    assert read.target_area == task.target_area
    np.testing.assert_array_equal(read.uv, task.uv)
    np.testing.assert_array_equal(read.positions, task.positions)


def test_panels_are_split_with_their_corners_and_joined_again(task: Task) -> None:
    panels = task.split()
    joined = join([(panel.points, panel.faces) for panel in panels])
    np.testing.assert_array_equal(joined.panel_vertices, task.panels.panel_vertices)
    np.testing.assert_array_equal(joined.panel_faces, task.panels.panel_faces)
    np.testing.assert_array_equal(joined.face_panel, task.panels.face_panel)
    corners = np.concatenate([panel.points[panel.corners] for panel in panels])
    np.testing.assert_array_equal(corners, task.panels.panel_vertices[task.corner])


def test_a_remesher_writes_a_mesh_and_seconds_for_each_task(
    task: Task, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("a", "b"):
        task.save(tmp_path / "tasks" / f"{name}.npz")
    monkeypatch.setattr("sys.argv", ["remesher", str(tmp_path / "tasks"), str(tmp_path / "out")])
    seen = []

    def keep(panel, edge_length):
        seen.append(edge_length)
        sum(range(20_000))
        return panel.points, panel.faces

    contend(panel_by_panel(keep), ("numpy",), {"kept": True})
    assert seen == [task.edge_length] * 12  # four panels of each task, and of the first once before
    written = json.loads((tmp_path / "out" / RECORD_FILE).read_text(encoding="utf-8"))
    assert list(written["seconds"]) == ["a", "b"]
    assert min(written["seconds"].values()) > 0.0
    assert written["versions"] == {"numpy": np.__version__}
    assert_same(load_panels(tmp_path / "out" / "a.npz"), join([(p.points, p.faces) for p in task.split()]))


def test_panels_that_are_not_sewn_are_judged_like_the_source(task: Task) -> None:
    source = source_mesh(CASE)
    apart = garment(join([(panel.points, panel.faces) for panel in task.split()]))
    found, own = quality(apart, source), quality(source, source)
    assert found.vertices == own.panel_vertices == found.panel_vertices
    assert (found.min_angle, found.area_variation) == (own.min_angle, own.area_variation)
    assert (found.curve_error, found.seam_mismatches) == (0.0, 0)


def test_table_has_a_row_for_each_remesher_and_one_for_the_source() -> None:
    source = source_mesh(CASE)
    made = quality(garment(panels_of(source)), source)
    results = [
        Result(MUSLIN, {CASE.name: [0.2, 0.4]}, {CASE.name: made}),
        Result(REMESHERS[1], {CASE.name: [0.1, 0.1]}, {CASE.name: made}),
        Result(REMESHERS[3], failure="it ended with 1; the log ends:\nout of memory"),
    ]
    lines = table([CASE], results).splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    assert [row[0] for row in rows[2:]] == [f"**{CASE.name}**", "source", "muslin", "MMG", "gpytoolbox"]
    angles = np.degrees(corner_angles(source.panel_vertices, source.panel_faces))
    expected = [
        str(len(source.panel_vertices)),
        str(len(source.faces)),
        f"{angles.min():.1f}",
        f"{100.0 * (angles >= 30.0).mean():.2f}",
        f"{source.face_areas.std() / source.face_areas.mean():.3f}",
        "0, 0",
        "0.000",
        "0.00",
        "0.000",
        "0",
    ]
    assert rows[3][1:11] == rows[5][1:11] == expected
    assert rows[5][11:13] == ["0.100", "0.38 (0.25 to 0.50)"]
    assert rows[6][1] == "failed"
    assert lines[-1].endswith("out of memory")
    alone = table([CASE], results[1:]).splitlines()
    assert next(line for line in alone if line.startswith("| MMG")).endswith("| 0.100 |  |")


@pytest.mark.parametrize("remesher", REMESHERS, ids=lambda r: r.module)
def test_what_installs_a_remesher_exists(remesher) -> None:
    root = Path(__file__).resolve().parents[2] / "benchmarks"
    assert (root / "remeshers" / f"{remesher.module}.py").is_file()
    if remesher.environment is not None:
        wanted = (root / "requirements" / f"{remesher.environment}.txt").read_text(encoding="utf-8")
        assert f"{remesher.package}==" in wanted
