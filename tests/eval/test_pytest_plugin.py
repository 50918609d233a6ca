"""The fixture `muslin_regression` inside other people's tests."""

import json
import subprocess
import sys
from dataclasses import replace
from importlib.metadata import entry_points

import numpy as np
import pytest

import muslin.eval.compare
import muslin.eval.regression  # noqa: F401  pytester forgets modules that a run imports, and numpy cannot be twice
from muslin.sim.dataset.reader import write_dataset

pytest_plugins = ["pytester"]

TEST = """
def test_walk(muslin_regression):
    muslin_regression.check("prediction", "truth", name="walk")
"""


def predict(folder, truth, by: float) -> None:
    write_dataset(
        folder, [replace(truth, positions=truth.positions + np.array([0, by, 0], dtype=np.float32))]
    )


@pytest.fixture
def project(pytester, make_sample, monkeypatch):
    """A folder with a truth, a prediction 10 mm above it, a worse one, and a test."""
    monkeypatch.chdir(pytester.path)
    truth = make_sample("sheet", n=4)
    write_dataset(pytester.path / "truth", [truth])
    predict(pytester.path / "prediction", truth, 0.010)
    predict(pytester.path / "worse", truth, 0.020)
    pytester.makepyfile(test_mine=TEST)
    return pytester


def swap(project) -> None:
    (project.path / "prediction").rename(project.path / "better")
    (project.path / "worse").rename(project.path / "prediction")


def test_the_plugin_is_registered_under_pytest11():
    (found,) = [entry for entry in entry_points(group="pytest11") if entry.name == "muslin"]
    assert found.value == "muslin.eval.pytest_plugin"


def test_loading_the_plugin_loads_nothing_heavy():
    code = (
        "import sys; import muslin.eval.pytest_plugin; "
        "print([m for m in ('numpy','scipy','igl','zarr','warp','pydantic','jinja2') if m in sys.modules])"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"


def test_a_baseline_is_asked_for_then_written_then_kept(project):
    first = project.runpytest("-p", "no:xdist")
    first.assert_outcomes(failed=1)
    first.stdout.fnmatch_lines(["*walk.json: no baseline yet; run pytest --muslin-regenerate*"])
    project.runpytest("-p", "no:xdist", "--muslin-regenerate").assert_outcomes(passed=1)
    kept = json.loads((project.path / "muslin_baselines" / "test_mine" / "walk.json").read_text())
    assert kept["figures"]["vertex_error_mm.mean"] == pytest.approx(10.0, abs=1e-3)
    project.runpytest("-p", "no:xdist").assert_outcomes(passed=1)

    swap(project)
    failed = project.runpytest("-p", "no:xdist")
    failed.assert_outcomes(failed=1)
    failed.stdout.fnmatch_lines(["*vertex_error_mm.mean: baseline 10, now 20, allowed at most 10.1*"])
    project.runpytest("-p", "no:xdist", "--muslin-regenerate").assert_outcomes(passed=1)
    project.runpytest("-p", "no:xdist").assert_outcomes(passed=1)


def test_tolerances_and_names(project):
    project.makepyfile(
        test_mine="""
        def test_a(muslin_regression):
            muslin_regression.check("prediction", "truth", tolerance=1.1)

        def test_b(muslin_regression):
            limits = {"hausdorff_mm": 0.5}
            muslin_regression.check("prediction", "truth", "one/two three", tolerance=1.1, tolerances=limits)
        """
    )
    project.runpytest("-p", "no:xdist", "--muslin-regenerate").assert_outcomes(passed=2)
    folder = project.path / "muslin_baselines" / "test_mine"
    assert {file.name for file in folder.iterdir()} == {"test_a.json", "one-two-three.json"}
    swap(project)
    result = project.runpytest("-p", "no:xdist")
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(["*hausdorff_mm: baseline 10, now 20, allowed at most 15*"])


def test_another_truth_is_refused(project):
    project.runpytest("-p", "no:xdist", "--muslin-regenerate").assert_outcomes(passed=1)
    (project.path / "truth").rename(project.path / "old")
    (project.path / "worse").rename(project.path / "truth")
    result = project.runpytest("-p", "no:xdist")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*another truth*"])
