"""Methods that lack samples, or predict what cannot be scored; wrong methods, metrics and figures."""

import json
from dataclasses import replace

import numpy as np
import pytest

from muslin.eval.bench.curves import plots
from muslin.eval.bench.findings import findings
from muslin.eval.bench.methods import open_method, parse_methods
from muslin.eval.bench.outcome import Outcome
from muslin.eval.bench.protocol import parse_protocol
from muslin.eval.bench.report import bench_report
from muslin.eval.bench.run import bench
from muslin.eval.bench.scenes import worst_median_best
from muslin.eval.bench.score import figure_value
from muslin.eval.bench.tables import duels, fill
from muslin.garments.errors import InputError
from muslin.sim.dataset.reader import open_dataset, write_dataset
from tests.eval.bench.data import predict, predict_files, sheet
from tests.eval.cli.commands import muslin, refused

METRIC = {"figure": "vertex_error_mm.mean", "title": "vertex error", "unit": "mm"}
TABLE = {"title": "By design", "rows": ["design"], "metrics": ["vertex_error_mm.mean"]}
RISE = {"a": 1e-3, "b": 2e-3}


def protocol(**values):
    base = {"name": "p", "title": "P", "source": "S", "metrics": [METRIC], "tables": [TABLE]}
    base["families"] = ["vertex", "motion"]
    return parse_protocol(base | values)


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """Three drapes and a sequence without a body; one method as a dataset, one as files."""
    folder = tmp_path_factory.mktemp("edges")
    drapes = [sheet(d, s, "t0", split="test", body=False) for d, s in (("a", "s0"), ("a", "s1"), ("b", "s0"))]
    write_dataset(folder / "truth", [*drapes, sheet("a", "s0", "t0", "jump", split="test", body=False)])
    predict(folder / "truth", folder / "one", lambda s, t: RISE[s.labels["design"]])
    predict_files(folder / "truth", folder / "two", lambda s, t: -3e-3)
    return folder


def run(data, methods: dict[str, str], **values) -> Outcome:
    folders = {name: data / folder for name, folder in methods.items()}
    return bench(protocol(**values), folders, data / "truth", workers=1)


def means(outcome: Outcome) -> dict[str, list]:
    table = fill(outcome, outcome.protocol.tables[0])
    return {
        row[0]: [cell.interval and round(cell.interval.mean, 3) for cell in cells]
        for row, cells in zip(table.rows, table.cells, strict=True)
    }


def test_files_and_datasets_are_scored_alike(data):
    outcome = run(data, {"one": "one", "two": "two"})
    assert means(outcome) == {"a": [1.0, 3.0], "b": [2.0, 3.0]}
    assert outcome.groups == {"all": ["a-s0-t0", "a-s1-t0", "b-s0-t0", "a-s0-t0-jump"]}
    assert outcome.missing("two") == []


def test_workers_change_nothing(data):
    apart, alone = (
        bench(protocol(), {"one": data / "one"}, data / "truth", workers=workers) for workers in (2, 1)
    )
    assert apart.scores == alone.scores


def test_a_nan_is_counted_and_named_and_its_sample_compared_for_no_method(data, tmp_path):
    predict_files(data / "truth", tmp_path / "bad", lambda s, t: -3e-3)
    file = tmp_path / "bad" / "a-s1-t0.npz"
    arrays = dict(np.load(file))
    arrays["vertices"][0, 3, 1] = np.nan
    np.savez(file, **arrays)
    outcome = bench(protocol(), {"one": data / "one", "bad": tmp_path / "bad"}, data / "truth", workers=1)
    assert list(outcome.refused("bad")) == ["a-s1-t0"]
    assert "NaN" in outcome.refused("bad")["a-s1-t0"]
    assert outcome.refused("one") == {}
    (cells, _) = fill(outcome, outcome.protocol.tables[0]).cells
    assert [cell.count for cell in cells] == ["2 of 3", "2 of 3"]


def test_another_number_of_frames_is_refused(data, tmp_path):
    made = [open_dataset(data / "one")[i] for i in ("b-s0-t0", "a-s0-t0-jump")]
    made[1] = replace(made[1], positions=made[1].positions[:2])
    write_dataset(tmp_path / "short", [replace(m, body=None) for m in made])
    outcome = bench(protocol(), {"short": tmp_path / "short"}, data / "truth", workers=1)
    assert list(outcome.refused("short")) == ["a-s0-t0-jump"]
    assert outcome.missing("short") == ["a-s0-t0", "a-s1-t0"]


def test_samples_of_other_ids_are_found_by_what_they_show(data, tmp_path):
    renamed = [replace(s, id=f"other-{k}") for k, s in enumerate(open_dataset(data / "one"))]
    # Without a body nothing tells shapes apart: two drapes of one garment could be either, and are left out.
    write_dataset(tmp_path / "renamed", [replace(s, garment=_named(s)) for s in renamed])
    samples = [replace(s, garment=_named(s)) for s in open_dataset(data / "truth")]
    write_dataset(tmp_path / "truth", samples)
    outcome = bench(protocol(), {"m": tmp_path / "renamed"}, tmp_path / "truth", workers=1)
    assert outcome.missing("m") == ["a-s0-t0", "a-s1-t0"]
    assert means(outcome) == {"a": [1.0], "b": [2.0]}


def _named(sample):
    return replace(sample.garment, parameters={"side": {"a": 1.0, "b": 2.0}[sample.labels["design"]]})


def test_a_figure_that_one_method_lacks_is_compared_for_none(data):
    velocity = {"figure": "velocity_error_mm_s.mean", "title": "velocity", "unit": "mm/s"}
    table = {
        "title": "All",
        "rows": ["metric"],
        "metrics": ["vertex_error_mm.mean", "velocity_error_mm_s.mean"],
    }
    outcome = run(data, {"one": "one"}, metrics=[METRIC, velocity], tables=[table])
    ((all_samples,), (moving,)) = fill(outcome, outcome.protocol.tables[0]).cells
    assert all_samples.count == "4"
    assert moving.count == "1 of 4"


def test_a_page_without_a_sample_to_show_is_written_all_the_same(data):
    """The first metric exists for none."""
    velocity = {"figure": "velocity_error_mm_s.mean", "title": "velocity", "unit": "mm/s"}
    outcome = run(
        data,
        {"one": "one"},
        metrics=[velocity],
        tables=[TABLE | {"metrics": ["velocity_error_mm_s.mean"]}],
        select={"where": {"kind": ["drape"]}},
    )
    page = bench_report(outcome, findings(outcome))
    assert "muslin-viewer" not in page


def test_higher_is_better_where_a_metric_says_so(data):
    outcome = run(data, {"one": "one", "two": "two"}, metrics=[METRIC | {"better": "higher"}])
    (duel,) = duels(outcome)
    assert (duel.found.first, duel.found.second) == (0, 4)
    assert duel.found.difference.mean == pytest.approx((1 + 1 + 2 + 1) / 4 - 3, abs=1e-3)


def test_nearer_to_one_is_better_where_a_metric_says_so(data):
    # 1, 1, 2, 1 against 3 everywhere: off one by 0, 0, 1, 0 and by 2.
    outcome = run(data, {"one": "one", "two": "two"}, metrics=[METRIC | {"better": "one"}])
    (duel,) = duels(outcome)
    assert (duel.found.first, duel.metric) == (4, "vertex error, off 1")
    assert duel.found.difference.mean == pytest.approx(0.25 - 2.0, abs=1e-3)
    assert worst_median_best(outcome, outcome.groups["all"])["worst"] == "b-s0-t0"


def test_labels_as_x_and_clusters(data):
    figure = {"title": "F", "x": "design", "y": "vertex_error_mm.mean"}
    outcome = run(data, {"one": "one"}, figures=[figure], bootstrap={"cluster": "design"})
    (plot,) = plots(outcome, outcome.protocol.figures[0])
    assert plot.categories == ["a", "b"]
    assert plot.curves[0].mean == pytest.approx([1.0, 2.0], abs=1e-3)
    assert plot.curves[0].n == [3, 1]
    assert outcome.clusters(["a-s0-t0", "b-s0-t0"]) == ["a", "b"]


@pytest.mark.parametrize(
    ("values", "says"),
    [
        (
            {"metrics": [METRIC | {"figure": "vertex_eror_mm.mean"}], "tables": []},
            "choose from .*vertex_error_mm.mean",
        ),
        (
            {"metrics": [METRIC | {"figure": "vertex_error_mm"}], "tables": []},
            "choose from .*vertex_error_mm.mean",
        ),
        ({"tables": [TABLE | {"rows": ["colour"]}]}, "no sample has a label 'colour'; labels there are"),
        ({"families": ["vertices"]}, "metrics: 'vertices' is none; choose from standard"),
        ({"groups": [{"name": "g", "splits": ["valid"]}]}, "no sample has split 'valid'"),
        ({"groups": [{"name": "g", "unseen": ["design"]}]}, "training splits .train. is there"),
    ],
)
def test_what_the_dataset_does_not_have_is_named(data, values, says):
    with pytest.raises(InputError, match=says):
        run(data, {"one": "one"}, **values)


@pytest.mark.parametrize(
    ("figure", "says"),
    [
        ({"x": "beta", "y": "vertex_error_mm.mean"}, "no sample has a body with a shape"),
        ({"x": "frame", "y": "vertex", "y_label": "mm"}, "'vertex' is not among vertex_mean"),
        ({"x": "time", "y": "vertex_mean", "y_label": "mm"}, "one frame rate"),
    ],
)
def test_a_figure_that_cannot_be_drawn_says_why(data, figure, says):
    outcome = run(data, {"one": "one"}, figures=[{"title": "F"} | figure])
    with pytest.raises(InputError, match=says):
        plots(outcome, outcome.protocol.figures[0])


def test_wrong_methods_are_named(data, tmp_path):
    for given, says in (
        (["one"], "must be NAME=DIR"),
        (["=x"], "must be NAME=DIR"),
        (["a=x", "b=y", "a=z"], "two methods are named 'a'"),
    ):
        with pytest.raises(InputError, match=says):
            parse_methods(given)
    assert str(parse_methods(["a = b=c"])["a"]).strip() == "b=c"
    truth = data / "truth"
    (tmp_path / "empty").mkdir()
    for path, says in (
        (truth, "is the truth itself"),
        (truth / ".." / "truth", "is the truth itself"),
        (tmp_path / "none", "no such folder"),
        (tmp_path / "empty", "predicts none of the 1 samples"),
    ):
        with pytest.raises(InputError, match=says):
            open_method("m", path, truth, ["a-s0-t0"])
    for name in ("a-s0-t0.obj", "a-s0-t0.ply"):
        (tmp_path / "empty" / name).touch()
    with pytest.raises(InputError, match=r"both a-s0-t0\.obj and a-s0-t0\.ply"):
        open_method("m", tmp_path / "empty", truth, ["a-s0-t0"])


def test_no_common_sample_is_an_error(data, tmp_path):
    ids = tuple(open_dataset(data / "truth").ids)
    predict_files(data / "truth", tmp_path / "left", lambda s, t: 0.0, leave_out=ids[1:])
    predict_files(data / "truth", tmp_path / "right", lambda s, t: 0.0, leave_out=ids[:1])
    with pytest.raises(InputError, match=r"every method: left lacks 3 .*right lacks 1"):
        bench(protocol(), {n: tmp_path / n for n in ("left", "right")}, data / "truth", workers=1)


def test_figure_paths():
    figures = {"a": {"b": 1.5, "c": None}, "d": None, "e": "text"}
    assert figure_value(figures, "a.b") == 1.5
    assert figure_value(figures, "a.c") is None
    assert figure_value(figures, "d.mean") is None
    for path in ("a", "a.x", "x", "e", "a.b.c"):
        with pytest.raises(InputError, match=r"choose from a\.b, a\.c, d"):
            figure_value(figures, path)


PROTOCOL = """
name = "p"
title = "P"
source = "S"
families = ["vertex"]
[[metrics]]
figure = "vertex_error_mm.mean"
title = "vertex error"
unit = "mm"
[[tables]]
title = "By design"
rows = ["design"]
metrics = ["vertex_error_mm.mean"]
"""


def test_the_command_writes_everything(data, tmp_path):
    (tmp_path / "p.toml").write_text(PROTOCOL)
    command = ("bench", tmp_path / "p.toml", "--dataset", data / "truth", "--workers", 1)
    answer = muslin(*command, "--method", f"one={data / 'one'}", "--out", tmp_path / "out")
    assert "| a | 1.000 | 3 |" in answer.output
    assert json.loads((tmp_path / "out" / "results.json").read_text())["methods"]["one"]["scored"] == 4
    assert "By design" in (tmp_path / "out" / "report.html").read_text()
    refused(*command, "--method", f"one={data / 'truth'}", says="is the truth itself")
    refused(*command[:2], "--method", f"one={data / 'one'}", says="names no dataset; give one with --dataset")


def test_the_command_exits_with_1_for_what_cannot_be_scored(data, tmp_path):
    (tmp_path / "p.toml").write_text(PROTOCOL)
    predict_files(data / "truth", tmp_path / "bad", lambda s, t: 0.0)
    np.savez(tmp_path / "bad" / "b-s0-t0.npz", vertices=np.full((1, 16, 3), np.nan), faces=[[0, 1, 2]])
    command = ("bench", tmp_path / "p.toml", "--dataset", data / "truth", "--workers", 1)
    answer = muslin(*command, "--method", f"bad={tmp_path / 'bad'}", code=1)
    assert "bad, b-s0-t0:" in answer.stderr
    assert "1 predictions cannot be scored" in answer.stderr
