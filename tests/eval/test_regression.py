"""Baselines: what counts as worse, what is refused, and the command that says so."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from muslin.eval.compare import compare
from muslin.eval.provenance import content_hash, provenance
from muslin.eval.regression import (
    ROUNDING,
    Measured,
    Tolerances,
    is_error,
    measured,
    parse_tolerances,
    read_baseline,
    regressions,
    write_baseline,
)
from muslin.garments.errors import InputError
from muslin.sim.dataset.reader import write_dataset
from tests.eval.cli.commands import muslin, refused

ORIGIN = {"metrics_version": 1, "dataset": "abc"}


def figures(**values) -> Measured:
    return Measured({key.replace("__", "."): value for key, value in values.items()}, 3, 12, ORIGIN)


@given(st.floats(0, 1e3), st.floats(0, 1e3), st.floats(0, 0.5))
def test_an_error_is_worse_exactly_beyond_its_tolerance(before, after, rel):
    limits = Tolerances(usual=rel)
    rows = regressions(figures(hausdorff_mm=before), figures(hausdorff_mm=after), limits)
    bound = before * (1 + rel) + ROUNDING
    if abs(after - bound) > 1e-9 * (1 + bound):
        assert bool(rows) == (after > bound)
    for row in rows:
        assert (row.figure, row.baseline, row.now) == ("hausdorff_mm", before, after)
        assert row.allowed == pytest.approx(bound)


def test_a_perfect_baseline_leaves_room_for_rounding_alone():
    perfect = figures(penetration__ratio=0.0)
    assert regressions(perfect, figures(penetration__ratio=1e-7)) == []
    assert len(regressions(perfect, figures(penetration__ratio=1e-3))) == 1


def test_longest_path_of_a_tolerance_counts():
    before = figures(vertex_error_mm__mean=10.0, vertex_error_mm__max=10.0)
    after = figures(vertex_error_mm__mean=11.5, vertex_error_mm__max=11.5)
    limits = Tolerances({"vertex_error_mm": 0.2, "vertex_error_mm.max": 0.1})
    (row,) = regressions(before, after, limits)
    assert row.figure == "vertex_error_mm.max"
    assert str(row) == "vertex_error_mm.max: baseline 10, now 11.5, allowed at most 11"


def test_what_is_no_error_is_checked_on_both_sides_where_named():
    before = figures(wrinkle_energy_ratio=0.9)
    assert regressions(before, figures(wrinkle_energy_ratio=0.2)) == []
    limits = Tolerances({"wrinkle_energy_ratio": 0.1})
    assert regressions(before, figures(wrinkle_energy_ratio=0.85), limits) == []
    (low,) = regressions(before, figures(wrinkle_energy_ratio=0.2), limits)
    (high,) = regressions(before, figures(wrinkle_energy_ratio=1.2), limits)
    assert "at least 0.81" in str(low)
    assert "at most 0.99" in str(high)


def test_a_figure_that_is_gone_is_worse_and_a_new_one_is_not():
    (row,) = regressions(figures(hausdorff_mm=1.0), figures(hausdorff_mm=None))
    assert "now null" in str(row)
    assert regressions(figures(hausdorff_mm=None), figures(hausdorff_mm=5.0)) == []


@pytest.mark.parametrize(
    ("figure", "error"),
    [
        ("vertex_error_mm.mean", True),
        ("hausdorff_upper_mm", True),
        ("penetration.depth_max_mm", True),
        ("spectrum.log_spectral_distance", True),
        ("truth_penetration.ratio", False),
        ("penetration.area_ratio_uncertain", False),
        ("curvature_1_m.truth_rms", False),
        ("strain.p95", False),
    ],
)
def test_errors_are_known_by_name(figure, error):
    assert is_error(figure) is error


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"origin": {"metrics_version": 2, "dataset": "abc"}}, "metrics version"),
        ({"origin": {"metrics_version": 1, "dataset": "xyz"}}, "another truth"),
        ({"samples": 2}, "3 samples, this comparison of 2"),
        ({"frames": 11}, "12 frames, this comparison of 11"),
    ],
)
def test_what_cannot_be_compared_is_refused(change, says):
    one = figures(hausdorff_mm=1.0)
    with pytest.raises(InputError, match=says):
        regressions(one, replace(one, **change))


def test_figures_that_were_not_computed_are_told_from_those_that_do_not_exist():
    before = figures(velocity_error_mm_s__mean=1.0)
    (row,) = regressions(before, figures(velocity_error_mm_s=None))
    assert row.now is None
    with pytest.raises(InputError, match=r"velocity_error_mm_s\.mean, which was not computed now"):
        regressions(before, figures(hausdorff_mm=1.0))


def test_a_tolerance_of_no_figure_is_refused():
    one = figures(hausdorff_mm=1.0)
    with pytest.raises(InputError, match=r"'hausdorf_mm'.*choose from hausdorff_mm"):
        regressions(one, one, Tolerances({"hausdorf_mm": 0.1}))


def test_tolerances_of_the_command_line():
    assert parse_tolerances(["a.b=0.5", "0.2"]) == Tolerances({"a.b": 0.5}, 0.2)
    for wrong in ("a=b", "a=-1", "nan", "=0.1", "a", "a=inf"):
        with pytest.raises(InputError, match="PATH=REL"):
            parse_tolerances([wrong])


def test_baseline_round_trip(tmp_path):
    one = figures(vertex_error_mm__mean=0.1 + 0.2, hausdorff_mm=None)
    write_baseline(tmp_path / "b.json", one)
    assert read_baseline(tmp_path / "b.json") == one


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{", "JSON"),
        ("[]", "no baseline"),
        ('{"format": "muslin baseline", "format_version": 9}', "format_version = 9"),
        ('{"format": "muslin baseline", "format_version": 1}', "lacks a valid 'figures'"),
    ],
)
def test_damaged_baselines_are_named(tmp_path, text, says):
    (tmp_path / "b.json").write_text(text)
    with pytest.raises(InputError, match=says):
        read_baseline(tmp_path / "b.json")


def raised(sample, by: float):
    return replace(sample, positions=sample.positions + np.array([0, by, 0], dtype=np.float32))


@pytest.fixture
def folders(tmp_path, make_sample):
    truth = make_sample("sheet", n=5)
    write_dataset(tmp_path / "truth", [truth])
    for name, by in (("good", 0.010), ("bad", 0.012)):
        write_dataset(tmp_path / name, [raised(truth, by)])
    return tmp_path


def test_the_command_exits_with_1_and_the_row_that_got_worse(folders):
    base = folders / "base.json"
    muslin("eval", folders / "good", folders / "truth", "--write-baseline", base)
    muslin("eval", folders / "good", folders / "truth", "--baseline", base)
    answer = muslin("eval", folders / "bad", folders / "truth", "--baseline", base, code=1)
    assert "vertex_error_mm.mean: baseline 10, now 12, allowed at most 10.1" in answer.stderr
    muslin("eval", folders / "bad", folders / "truth", "--baseline", base, "--tolerance", 0.21)
    answer = muslin(
        *("eval", folders / "bad", folders / "truth", "--baseline", base),
        *("--tolerance", 0.21, "--tolerance", "hausdorff_mm=0.1"),
        code=1,
    )
    assert "hausdorff_mm: baseline 10, now 12, allowed at most 11" in answer.stderr
    assert "vertex_error" not in answer.stderr


def test_the_command_refuses_a_baseline_of_another_truth(folders):
    base = folders / "base.json"
    muslin("eval", folders / "good", folders / "truth", "--write-baseline", base)
    refused("eval", folders / "good", folders / "bad", "--baseline", base, says="another truth")
    old = json.loads(base.read_text())
    old["origin"]["metrics_version"] = 0
    base.write_text(json.dumps(old))
    refused("eval", folders / "good", folders / "truth", "--baseline", base, says="metrics version 0")
    refused("eval", folders / "good", folders / "truth", "--tolerance", "x=y", says="PATH=REL")


def test_content_hash_follows_content_and_not_place(tmp_path, make_sample):
    sample = make_sample("sheet", n=4)
    for name, made in (("a", sample), ("b", sample), ("c", raised(sample, 0.1))):
        write_dataset(tmp_path / name, [made])
    hashes = {name: content_hash(tmp_path / name) for name in "abc"}
    assert hashes["a"] == hashes["b"] != hashes["c"]
    one = content_hash(tmp_path / "a" / "samples" / "sheet.zarr.zip")
    assert one == content_hash(tmp_path / "b" / "samples" / "sheet.zarr.zip")
    assert one not in hashes.values()
    (tmp_path / "m.obj").write_text("v 0 0 0\n")
    before = content_hash(tmp_path / "m.obj")
    (tmp_path / "m.obj").write_text("v 0 0 1\n")
    assert content_hash(tmp_path / "m.obj") != before
    with pytest.raises(InputError, match="no such file"):
        content_hash(tmp_path / "nothing")


def test_a_baseline_keeps_versions_and_numbers_alone(folders):
    result = compare(folders / "good", folders / "truth").to_dict()
    found = measured(result)
    assert found.origin == provenance(folders / "truth")
    assert found.figures["vertex_error_mm.mean"] == result["vertex_error_mm"]["mean"]
    assert found.figures["velocity_error_mm_s"] is None
    assert not any(name.startswith(("pairs", "notes")) for name in found.figures)
