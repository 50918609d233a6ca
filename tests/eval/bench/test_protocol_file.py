"""Protocol files: what is read, what is refused and how that is said, and what the hash depends on."""

import copy

import pytest

from muslin.eval.bench.protocol import load_protocol, parse_protocol
from muslin.garments.errors import InputError

GOOD = {
    "name": "mine",
    "title": "Mine",
    "source": "Me 2026",
    "metrics": [{"figure": "hausdorff_mm", "title": "Hausdorff", "unit": "mm"}],
    "tables": [{"title": "All", "rows": ["design"], "metrics": ["hausdorff_mm"]}],
    "figures": [{"title": "Shape", "x": "beta.0", "y": "hausdorff_mm"}],
}


def changed(path: str, value) -> dict:
    values = copy.deepcopy(GOOD)
    place, (*keys, last) = values, path.split(".")
    for key in keys:
        place = place[int(key)] if key.isdigit() else place.setdefault(key, {})
    place[last] = value
    return values


def test_defaults():
    protocol = parse_protocol(GOOD)
    assert [group.label for group in protocol.groups] == ["all"]
    assert protocol.train == ["train"]
    assert protocol.tables[0].columns == ["method"]
    assert protocol.figures[0].component == 0
    assert protocol.bootstrap.resamples == 10_000


@pytest.mark.parametrize(
    ("path", "value", "says"),
    [
        ("name", "a b", 'name = "a b"'),
        ("metrics", [], "metrics = "),
        ("colour", "red", "unknown key colour; allowed here are bootstrap, dataset"),
        ("metrics.0.beter", "higher", r"unknown key metrics\.0\.beter; allowed here are better, figure"),
        ("metrics.0.better", "more", "'lower', 'higher' or 'one'"),
        ("select.kind", "drapes", "select.kind = \"drapes\": Input should be 'drape' or 'sequence'"),
        ("select.seen", ["desing"], r"select\.seen\.0 = \"desing\": .*'design'"),
        ("select.where", {"design": "tee"}, r"select\.where\.design = \"tee\""),
        ("groups", [], "groups is empty"),
        ("groups", [{"name": "g"}, {"name": "g"}], "'g' is there twice"),
        ("groups", [{"name": "g", "seen": ["design"], "unseen": ["design"]}], "both seen and unseen"),
        ("tables.0.metrics", ["vertex"], r"'vertex' is not in \[\[metrics\]\]; it has hausdorff_mm"),
        ("tables.0.columns", ["shape"], "methods are never pooled"),
        ("tables.0.rows", ["method"], "'method' is there twice"),
        ("tables.0.groups", ["h"], r"'h' is not in \[\[groups\]\]"),
        ("figures.0.y", "vertex", r"'vertex' is not in \[\[metrics\]\]"),
        ("figures.0.x", "beta.x", "must be beta.K"),
        ("figures.0.x", "frame", "y_label is missing"),
        ("figures.0.lines", ["design"], "methods are never pooled"),
        ("bootstrap.confidence", 95, r"bootstrap\.confidence = 95"),
        ("surface_frames", 0, "surface_frames = 0"),
        ("families", [], "families = "),
    ],
)
def test_wrong_values_are_named(path, value, says):
    with pytest.raises(InputError, match=says):
        parse_protocol(changed(path, value))


def test_several_metrics_need_a_place():
    values = changed("metrics", [{"figure": name, "title": name} for name in "ab"])
    values["figures"] = []
    values["tables"][0]["metrics"] = ["a", "b"]
    with pytest.raises(InputError, match="metric must be among rows or columns"):
        parse_protocol(values)
    values["tables"][0]["rows"] = ["metric"]
    assert parse_protocol(values).tables[0].metrics == ["a", "b"]


def test_missing_keys_and_files_are_named(tmp_path):
    with pytest.raises(InputError, match=r"title is missing; add it.*source is missing"):
        parse_protocol({"name": "x", "metrics": GOOD["metrics"]})
    with pytest.raises(InputError, match="give the TOML file of a protocol"):
        load_protocol(tmp_path / "none.toml")
    (tmp_path / "bad.toml").write_text("name = \n")
    with pytest.raises(InputError, match=r"bad\.toml: not TOML"):
        load_protocol(tmp_path / "bad.toml")


def test_hash_is_of_the_meaning(tmp_path):
    (tmp_path / "a.toml").write_text(
        'name = "m"\ntitle = "t"\nsource = "s"\ndataset = "x"\n[[metrics]]\nfigure = "a"\ntitle = "A"\n'
    )
    (tmp_path / "b.toml").write_text(
        '# other order, other place\nsource = "s"\ntitle = "t"\nname = "m"\ntrain = ["train"]\n'
        'metrics = [{ title = "A", figure = "a", better = "lower" }]\n'
    )
    one = load_protocol(tmp_path / "a.toml")
    assert one.hash == load_protocol(tmp_path / "b.toml").hash
    assert one.hash != one.model_copy(update={"train": ["other"]}).hash
    assert len(one.hash) == 64
