"""Ratios, exponents, the table, and processes held to a core."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.compare import Result, table
from benchmarks.contenders.catalogue import CONTENDERS, MUSLIN, Contender, named
from benchmarks.growth import REFERENCE_EDGE, edge_length
from benchmarks.isolated import held_to, run
from benchmarks.judge import Verdict
from benchmarks.make_setting import START_SECONDS, from_rest
from benchmarks.spread import exponent, paired_ratio, spread


def test_spread_is_median_and_range() -> None:
    found = spread([3.0, 1.0, 2.0, 10.0])
    assert (found.median, found.low, found.high) == (2.5, 1.0, 10.0)
    assert found.text(1) == "2.5 (1.0 to 10.0)"
    assert spread([2.0, 2.0]).text() == "2.00"
    with pytest.raises(ValueError, match="at least one round"):
        spread([])


def test_a_slow_machine_does_not_change_a_ratio() -> None:
    slowed = np.array([1.0, 3.0, 1.7])
    found = paired_ratio(list(4.0 * slowed), list(2.0 * slowed))
    assert (found.low, found.high) == (pytest.approx(2.0), pytest.approx(2.0))
    with pytest.raises(ValueError, match="2 rounds against 1"):
        paired_ratio([1.0, 2.0], [1.0])


@pytest.mark.parametrize("power", [0.5, 1.0, 1.7])
def test_exponent_of_a_power_law(power: float) -> None:
    sizes = [1000, 4000, 16000]
    assert exponent(sizes, [3.0 * n**power for n in sizes]) == pytest.approx(power)
    with pytest.raises(ValueError, match="two or more"):
        exponent([1000, 1000], [1.0, 2.0])


def test_edge_length_follows_the_area_of_a_vertex() -> None:
    assert edge_length(4176) == REFERENCE_EDGE
    assert edge_length(4 * 4176) == pytest.approx(REFERENCE_EDGE / 2)


def test_the_body_starts_from_rest_and_reaches_its_pace() -> None:
    times = np.linspace(0.0, 1.0, 1001)
    clip = from_rest(times)
    pace = np.gradient(clip, times)
    assert pace[0] == pytest.approx(0.0, abs=0.01)
    assert (np.diff(clip) > 0.0).all()
    np.testing.assert_allclose(pace[times > START_SECONDS + 0.01], 1.0)


def result(name: int, rates: list[float], crossings: int) -> Result:
    verdict = Verdict(60, crossings, crossings, 2 * crossings, 0, 1.25)
    made = Result(CONTENDERS[name], rates, [0.5] * len(rates), [3 * 2**20] * len(rates))
    made.verdict = verdict
    return made


def test_table_has_a_row_for_each_contender() -> None:
    lines = table([result(0, [5.0, 6.0], 0), result(1, [20.0, 18.0], 7)]).splitlines()
    row = next(line for line in lines if line.startswith(f"| {CONTENDERS[1].name}"))
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells[1:] == [
        "19.00 (18.00 to 20.00)",
        "3.50 (3.00 to 4.00)",
        "0.50",
        "3",
        "7 of 60",
        "7, 14",
        "1.25",
    ]
    assert lines[0].count("|") == row.count("|")


def test_table_tells_of_a_peer_that_failed() -> None:
    failed = Result(CONTENDERS[2], failure="it ended with 1; the log ends:\nout of memory")
    lines = table([result(0, [5.0], 0), failed]).splitlines()
    row = next(line for line in lines if line.startswith(f"| {CONTENDERS[2].name}"))
    assert "failed" in row
    assert row.count("|") == lines[0].count("|")
    assert lines[-1].endswith("out of memory")


def test_contenders_are_chosen_by_name() -> None:
    assert named("newton_vbd") == (MUSLIN, CONTENDERS[3])
    with pytest.raises(ValueError, match="no contender houdini"):
        named("houdini, blender")


def test_a_peer_that_is_absent_is_told_with_its_remedy(tmp_path: Path) -> None:
    assert MUSLIN.missing(tmp_path) is None
    why = CONTENDERS[1].missing(tmp_path)
    assert why is not None
    assert "benchmarks/requirements/blender.txt" in why


@pytest.mark.parametrize("contender", CONTENDERS, ids=lambda c: c.module)
def test_what_installs_a_peer_exists(contender: Contender) -> None:
    root = Path(__file__).resolve().parents[2] / "benchmarks"
    assert (root / "contenders" / f"{contender.module}.py").is_file()
    if contender.environment is not None:
        wanted = (root / "requirements" / f"{contender.environment}.txt").read_text(encoding="utf-8")
        assert f"{contender.package}==" in wanted


def test_a_process_is_held_to_its_core_and_measured(tmp_path: Path) -> None:
    core = min(os.sched_getaffinity(0))
    code = (
        "import os; x = bytearray(200_000_000); print(os.sched_getaffinity(0), os.environ['OMP_NUM_THREADS'])"
    )
    used = run([sys.executable, "-c", code], {core}, tmp_path / "log")
    assert (tmp_path / "log").read_text(encoding="utf-8").split() == [f"{{{core}}}", "1"]
    assert 2e8 < used.peak_bytes < 4e8
    assert used.cpu_seconds > 0.0


def test_a_process_that_fails_says_so(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="too thin"):
        run([sys.executable, "-c", "raise SystemExit('too thin')"], {0}, tmp_path / "log")


def test_cores_are_given_back() -> None:
    allowed = os.sched_getaffinity(0)
    with held_to({min(allowed)}):
        assert os.sched_getaffinity(0) == {min(allowed)}
    assert os.sched_getaffinity(0) == allowed
    with pytest.raises(ValueError, match="may use"), held_to({9999}):
        pass
