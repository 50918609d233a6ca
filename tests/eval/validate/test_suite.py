"""Every case at its small size, the files they come from, and what becomes of rows that fail."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from typer.testing import CliRunner

from muslin.eval.cli.app import app
from muslin.eval.validate.case import Outcome, Plot, Row, Series
from muslin.eval.validate.catalogue import CASES
from muslin.eval.validate.load import LoadedCase, load_cases
from muslin.eval.validate.report import write_report
from muslin.eval.validate.runner import Finding, run_cases, write_json
from muslin.garments.errors import InputError

FOLDER = Path(__file__).resolve().parents[3] / "scenes" / "validation"
SMALL = load_cases(FOLDER, small=True)


def test_every_case_has_its_file_in_both_sizes() -> None:
    assert [case.name for case in SMALL] == list(CASES)
    assert [case.name for case in load_cases(FOLDER, small=False)] == list(CASES)


@pytest.mark.parametrize("case", SMALL, ids=lambda case: case.name)
def test_case_passes_at_small_size(case: LoadedCase) -> None:
    (finding,) = run_cases([case])
    assert not finding.error
    assert finding.outcome.rows
    assert [row for row in finding.outcome.rows if not row.passed] == []
    names = [row.name for row in finding.outcome.rows]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize(
    ("measured", "expected", "bar", "kind", "passed"),
    [
        (1.01, 1.0, 0.0101, "relative", True),
        (1.02, 1.0, 0.01, "relative", False),
        (-98.0, -100.0, 0.02, "relative", True),
        (0.02, 0.0, 0.03, "absolute", True),
        (0.02, 0.0, 0.01, "absolute", False),
        (0.0, 0.0, 0.0, "absolute", True),
        (math.nan, 0.0, 1.0, "absolute", False),
        (math.nan, 1.0, 1.0, "relative", False),
    ],
)
def test_bars(measured: float, expected: float, bar: float, kind: str, passed: bool) -> None:
    assert Row("a", measured, expected, bar, kind).passed is passed  # type: ignore[arg-type]


def found(passes: bool) -> Finding:
    row = Row("length", 1.0 if passes else 2.0, 1.0, 0.1, unit="m")
    curves = [Series("known", [0.0, 1.0], [0.0, 1.0]), Series("found", [0.5], [0.6], "points")]
    return Finding("hanging", "A <strip>", Outcome([row], [Plot("A curve", "x", "y", curves)]), 1.5)


def test_json_holds_the_rows(tmp_path: Path) -> None:
    write_json(tmp_path / "rows.json", [found(True), found(False)], small=True)
    rows = json.loads((tmp_path / "rows.json").read_text())["rows"]
    assert [row["passed"] for row in rows] == [True, False]
    assert rows[1] == {
        "case": "hanging",
        "name": "length",
        "measured": 2.0,
        "expected": 1.0,
        "bar": 0.1,
        "passed": False,
        "kind": "relative",
        "unit": "m",
    }


def test_case_that_stops_is_a_row_that_fails(tmp_path: Path) -> None:
    stopped = Finding("drape", "A drape", Outcome(), 1.0, "no equilibrium")
    assert not stopped.passed
    write_json(tmp_path / "rows.json", [stopped], small=False)
    result = json.loads((tmp_path / "rows.json").read_text())
    assert [row["passed"] for row in result["rows"]] == [False]
    assert result["errors"] == {"drape": "no equilibrium"}


def test_report_is_one_page_with_its_plots(tmp_path: Path) -> None:
    page = write_report(tmp_path, [found(False)], small=True).read_text()
    assert "A &lt;strip&gt;" in page
    assert "FAILS" in page
    assert "<svg" in page
    assert 'src="http' not in page
    assert 'href="http' not in page
    assert (tmp_path / "hanging-1.png").read_bytes().startswith(b"\x89PNG")


def test_command_writes_and_passes(tmp_path: Path) -> None:
    json_file, out = tmp_path / "rows.json", tmp_path / "out"
    words = ["validate", "--small", "--case", "stretch", "--scenes", str(FOLDER)]
    result = CliRunner().invoke(app, [*words, "--json", str(json_file), "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert "1 of 1 cases pass" in result.output
    assert all(row["passed"] for row in json.loads(json_file.read_text())["rows"])
    assert (out / "validation.html").is_file()


def test_command_fails_with_a_row_that_does(tmp_path: Path) -> None:
    text = (FOLDER / "hanging.toml").read_text().replace("bar = 0.01", "bar = 1e-9")
    (tmp_path / "hanging.toml").write_text(text)
    result = CliRunner().invoke(app, ["validate", "--small", "--scenes", str(tmp_path)])
    assert result.exit_code == 1
    assert "FAIL  hanging strip" in result.output
    assert "0 of 1 cases pass" in result.output


def test_folder_without_cases_names_the_remedy(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--scenes"):
        load_cases(tmp_path / "nowhere", small=True)


def test_unknown_case_is_told_the_known_ones(tmp_path: Path) -> None:
    (tmp_path / "trampoline.toml").write_text("title = 'T'")
    with pytest.raises(InputError, match=r"trampoline\.toml.*cantilever"):
        load_cases(tmp_path, small=True)
    with pytest.raises(InputError, match="--case 'trampoline'"):
        load_cases(FOLDER, small=True, only="trampoline")


@pytest.mark.parametrize(
    ("key", "line", "message"),
    [
        ("bar", "bar = -1.0", r"bar = -1\.0: .*greater than 0"),
        ("elements", "elements = 0", "elements = 0: .*greater than or equal to 1"),
        ("loads", "loads = [0.1, -0.1]", r"loads\.1 = -0\.1: .*greater than 0"),
        ("beer", "beer = 2", "unknown key beer; allowed here are across, bar,"),
        ("loads", "", "loads is missing"),
    ],
)
def test_wrong_values_are_named(tmp_path: Path, key: str, line: str, message: str) -> None:
    text = (FOLDER / "hanging.toml").read_text().split("[small]")[0]
    kept = [old for old in text.splitlines() if not old.startswith(f"{key} ")]
    (tmp_path / "hanging.toml").write_text("\n".join([*kept, line]))
    with pytest.raises(InputError, match=message):
        load_cases(tmp_path, small=False)
