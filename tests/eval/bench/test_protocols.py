"""The shipped protocols on a small dataset, whose errors are known in closed form."""

import csv
import json

import pytest

from muslin.eval.bench.curves import plots
from muslin.eval.bench.findings import findings
from muslin.eval.bench.protocol import load_protocol
from muslin.eval.bench.report import bench_report
from muslin.eval.bench.tables import duels, fill
from muslin.eval.bench.write import write_outcome
from tests.browser import browser
from tests.eval.bench.conftest import LEFT_OUT, PROTOCOLS
from tests.eval.bench.data import FPS, FRAMES

TOPOLOGIES, DESIGNS, ANIMATED = "static_topologies", "static_designs", "animated_designs"
MM = 1e-3  # of a millimetre: what float32 positions about 1 m high leave


def cells(outcome, place: int) -> dict[tuple[str, ...], object]:
    table = fill(outcome, outcome.protocol.tables[place])
    return {
        row + column: cell
        for row, entries in zip(table.rows, table.cells, strict=True)
        for column, cell in zip(table.columns, entries, strict=True)
    }


def test_every_protocol_is_here():
    assert {file.stem for file in PROTOCOLS.glob("*.toml")} == {TOPOLOGIES, DESIGNS, ANIMATED}
    for file in PROTOCOLS.glob("*.toml"):
        protocol = load_protocol(file)
        assert protocol.name == file.stem
        assert "doi:" in protocol.source or "arXiv:" in protocol.source
        assert file.name in file.read_text(encoding="utf-8")  # the command that runs it


def test_seen_and_unseen_topologies(outcomes):
    outcome = outcomes[TOPOLOGIES]
    seen = ["a-s2-t0", "a-s3-t0", "a-s4-t0", "b-s2-t0", "b-s3-t0"]
    assert outcome.groups == {"seen": seen, "unseen": [i.replace("t0", "t2") for i in seen]}
    found = cells(outcome, 0)
    # Means of designs a, a, a, b, b.
    for method, group, mean in (
        ("steady", "seen topologies", 1.4),
        ("steady", "unseen topologies", 3.4),
        ("shaky", "seen topologies", 2.8),
        ("shaky", "unseen topologies", 2.8),
    ):
        for metric in ("Hausdorff distance, mm", "mean surface distance, mm", "mean vertex error, mm"):
            interval = found[method, group, metric].interval
            assert interval.mean == pytest.approx(mean, abs=MM)
            assert interval.low < mean < interval.high
            assert interval.n == 5
        assert found[method, group, "inside the body, share of vertices"].interval.mean == 0.0


def test_hausdorff_against_shape_has_a_line_for_each_method_and_group(outcomes):
    (plot,) = plots(outcomes[TOPOLOGIES], outcomes[TOPOLOGIES].protocol.figures[0])
    lines = {(curve.method, curve.rest): curve for curve in plot.curves}
    assert "coefficient 1" in plot.x_label  # the one that varies
    assert len(lines) == 4
    curve = lines["steady", "unseen topologies"]
    assert curve.x == [-1.0, 0.5, 1.5]
    assert curve.mean == pytest.approx([3.5, 3.5, 3.0], abs=MM)  # a and b, a and b, a
    assert curve.n == [2, 2, 1]
    assert curve.low == [None, None, None]


def test_unseen_designs_are_compared_on_what_both_have(outcomes):
    outcome = outcomes[DESIGNS]
    assert len(outcome.groups["unseen"]) == 6
    assert outcome.missing("shaky") == [LEFT_OUT]
    assert outcome.missing("steady") == []
    found = cells(outcome, 1)
    assert found["c", "steady"].interval.mean == pytest.approx(3.0, abs=MM)
    assert (found["c", "steady"].interval.n, found["c", "steady"].of) == (2, 3)
    assert (found["d", "shaky"].interval.n, found["d", "shaky"].of) == (3, 3)
    # Over all six samples it would be 3.5.
    overall = cells(outcome, 0)["steady", "Hausdorff distance, mm"]
    assert overall.interval.mean == pytest.approx((2 * 3 + 3 * 4) / 5, abs=MM)
    assert overall.count == "5 of 6"


def test_duel_of_unseen_designs(outcomes):
    found = {duel.metric: duel for duel in duels(outcomes[DESIGNS])}
    duel = found["Hausdorff distance, mm"]
    assert (duel.first, duel.second) == ("steady", "shaky")
    assert duel.found.difference.mean == pytest.approx(-3.6, abs=MM)
    assert (duel.found.first, duel.found.second, duel.found.equal) == (5, 0, 0)
    assert duel.found.decided
    assert found["inside the body, share of vertices"].found.equal == 5


def test_each_unseen_design_has_a_plot(outcomes):
    figure = outcomes[DESIGNS].protocol.figures[1]
    assert [plot.title[-3:] for plot in plots(outcomes[DESIGNS], figure)] == [": c", ": d"]


def test_errors_over_frames(outcomes):
    outcome = outcomes[ANIMATED]
    assert outcome.groups == {"unseen": ["c-s0-t0-jump", "d-s0-t0-jump"]}
    position, velocity, *_ = outcome.protocol.figures
    lines = {curve.method: curve for curve in plots(outcome, position)[0].curves}
    assert lines["steady"].x == list(range(FRAMES))
    assert lines["steady"].mean == pytest.approx([3.5] * FRAMES, abs=MM)
    assert lines["shaky"].mean == pytest.approx([7.0] * FRAMES, abs=MM)
    lines = {curve.method: curve for curve in plots(outcome, velocity)[0].curves}
    assert lines["shaky"].x == list(range(1, FRAMES))
    # It jumps by twice its error from frame to frame.
    assert lines["shaky"].mean == pytest.approx([2 * 7.0 * FPS] * (FRAMES - 1), abs=MM * FPS)
    assert lines["steady"].mean == pytest.approx([0.0] * (FRAMES - 1), abs=MM * FPS)
    assert lines["steady"].n == [2] * (FRAMES - 1)


def test_files_for_papers(outcomes, tmp_path):
    outcome = outcomes[DESIGNS]
    written = {
        path.relative_to(tmp_path).as_posix() for path in write_outcome(outcome, findings(outcome), tmp_path)
    }
    assert "results.json" in written
    assert "tables/unseen-designs.md" in written
    assert "figures/hausdorff-distance-against-body-shape-c.svg" in written
    assert (tmp_path / "figures/hausdorff-distance-against-body-shape-d.png").read_bytes()[1:4] == b"PNG"
    text = (tmp_path / "tables/hausdorff-distance-of-each-design.md").read_text()
    assert "| c | 3.00 | 6.00 | 2 of 3 |" in text
    with (tmp_path / "tables/hausdorff-distance-of-each-design.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert {key: rows[0][key] for key in ("design", "method", "samples", "of", "low")} == {
        "design": "c",
        "method": "steady",
        "samples": "2",
        "of": "3",
        "low": "",
    }
    assert float(rows[0]["mean"]) == pytest.approx(3.0, abs=MM)
    assert "−" in (tmp_path / "tables/paired.md").read_text()


def test_results_tell_where_they_are_from(outcomes, tmp_path):
    outcome = outcomes[DESIGNS]
    write_outcome(outcome, findings(outcome), tmp_path)
    values = json.loads((tmp_path / "results.json").read_text())
    assert values["origin"]["protocol"] == load_protocol(PROTOCOLS / f"{DESIGNS}.toml").hash
    assert len(values["origin"]["dataset"]) == 64
    assert set(values["origin"]["versions"]) >= {"muslin", "numpy", "libigl"}
    assert values["methods"]["shaky"]["missing"] == [LEFT_OUT]
    assert values["groups"]["unseen"]["compared"] == [
        i for i in values["groups"]["unseen"]["samples"] if i != LEFT_OUT
    ]
    sample = next(entry for entry in values["samples"] if entry["id"] == "d-s4-t0")
    assert sample["figures"]["shaky"]["hausdorff_mm"] == pytest.approx(8.0, abs=MM)
    assert sample["beta"] == [0.0, 1.5]
    assert sample["labels"]["split"] == "designs"


def test_page_shows_everything_and_needs_nothing(outcomes):
    page = bench_report(outcomes[DESIGNS], findings(outcomes[DESIGNS]))
    assert "shaky lacks 1 samples: c-s2-t0" in page
    assert "2 of 3" in page
    for cost in ("12.5", "7,100,000", "14.2"):
        assert f'<td class="">{cost}</td>' in page
    assert page.count("<svg") == 3
    assert 'class="muslin-viewer"' in page
    for what in ("worst", "median", "best"):
        assert f"unseen designs, {what}" in page
    for outside in ('src="http', 'href="http', "@import", "url(http"):
        assert outside not in page


def test_page_plays_sequences_of_both_methods_in_a_browser(outcomes, tmp_path):
    outcome = outcomes[ANIMATED]
    (tmp_path / "report.html").write_text(bench_report(outcome, findings(outcome)), encoding="utf-8")
    with browser(tmp_path / "profile", viewport={"width": 760, "height": 620}) as opened:
        page, wrong = opened.new_page(), []
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("requestfailed", lambda request: wrong.append(request.url))
        page.goto((tmp_path / "report.html").as_uri())
        page.locator(".muslin-viewer").scroll_into_view_if_needed()  # it starts when it is seen
        page.wait_for_function("document.querySelectorAll('.muslin-viewer canvas').length >= 3")
        text = page.inner_text("body")
    assert not wrong
    # Two samples, so that a worst and a best are told apart and nothing is between them.
    for words in (
        "unseen designs, held-out sequences",
        "truth",
        "steady",
        "shaky",
        "Velocity error over frames: c",
    ):
        assert words in text
