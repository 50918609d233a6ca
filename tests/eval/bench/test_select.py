"""Which samples a protocol scores: training splits, labels, and what training has seen."""

import pytest

from muslin.eval.bench.protocol import parse_protocol
from muslin.eval.bench.select import Entry, grouped, labels_needed
from muslin.garments.errors import InputError

METRIC = {"figure": "hausdorff_mm", "title": "H"}


def protocol(*groups, **values):
    base = {"name": "p", "title": "P", "source": "S", "metrics": [METRIC]}
    if groups:
        base["groups"] = list(groups)
    return parse_protocol(base | values)


def entry(name: str, split: str, kind: str = "drape", faces: str = "f0") -> Entry:
    design, shape, *rest = name.split("-")
    labels = {"design": design, "shape": shape, "split": split, "kind": kind}
    if rest:
        labels["topology"] = rest[0]
    return Entry(name, labels, 1, None, faces)


SAMPLES = [
    entry("a-s0", "train"),
    entry("b-s1", "train"),
    entry("a-s1", "test"),
    entry("a-s2", "test"),
    entry("c-s0", "test"),
    entry("c-s2", "designs"),
    entry("c-s2m", "designs", "sequence"),
]


def chosen(*groups, samples=SAMPLES, **values) -> list[list[str]]:
    found = grouped(protocol(*groups, **values), samples, "data")
    return [[sample.id for sample in group] for group in found.values()]


def test_training_is_left_out_unless_asked_for():
    assert chosen() == [["a-s1", "a-s2", "c-s0", "c-s2", "c-s2m"]]
    assert chosen({"name": "t", "splits": ["train"]}) == [["a-s0", "b-s1"]]
    assert chosen(train=["train", "test"]) == [["c-s2", "c-s2m"]]


def test_seen_and_unseen_go_by_the_training_splits_and_not_by_names_of_splits():
    assert chosen({"name": "g", "unseen": ["design"]}) == [["c-s0", "c-s2", "c-s2m"]]
    assert chosen({"name": "g", "seen": ["design"], "unseen": ["shape"]}) == [["a-s2"]]
    assert chosen({"name": "g", "unseen": ["design", "shape"]}, select={"kind": "drape"}) == [["c-s2"]]
    # a is seen, s1 is seen, although never together: a combination of what is known is new all the same.
    assert chosen({"name": "g", "seen": ["design", "shape"]}) == [["a-s1"]]


def test_what_counts_as_training_is_the_protocols():
    with pytest.raises(InputError, match="unseen design leaves 0"):
        chosen({"name": "g", "unseen": ["design"]}, train=["train", "designs"])


def test_every_group_narrows_the_selection():
    groups = {"name": "one", "where": {"shape": ["s2"]}}, {"name": "two", "where": {"design": ["c"]}}
    assert chosen(*groups, select={"kind": "drape"}) == [["a-s2", "c-s2"], ["c-s0", "c-s2"]]


def test_topologies_are_known_by_their_faces_and_not_by_their_labels():
    # Both designs number their topologies from 0, and the second's 0 was never trained on.
    samples = [
        entry("a-s0-0", "train", faces="aa"),
        entry("a-s1-0", "test", faces="aa"),
        entry("b-s1-0", "test", faces="bb"),
        entry("a-s1-7", "test", faces="cc"),
    ]
    groups = {"name": "seen", "seen": ["topology"]}, {"name": "unseen", "unseen": ["topology"]}
    assert chosen(*groups, samples=samples) == [["a-s1-0"], ["b-s1-0", "a-s1-7"]]


def test_a_group_without_a_sample_tells_what_left_none():
    with pytest.raises(InputError) as caught:
        chosen({"name": "g", "unseen": ["shape"], "where": {"design": ["b"]}})
    assert str(caught.value) == (
        "data: group 'g' has no sample: 7 samples, every split but train leaves 5, design = ['b'] leaves 0"
    )


@pytest.mark.parametrize(
    ("group", "values", "says"),
    [
        ({"splits": ["tset"]}, {}, "no sample has split 'tset'; there are designs, test, train"),
        ({"where": {"design": ["a", "z"]}}, {}, "no sample has design 'z'; there are a, b, c"),
        ({"unseen": ["design"]}, {"train": ["learn"]}, "no sample of the training splits .learn. is there"),
    ],
)
def test_what_no_sample_has_is_named(group, values, says):
    with pytest.raises(InputError, match=says):
        chosen({"name": "g"} | group, **values)


def test_labels_needed_are_those_that_are_named():
    one = protocol(
        {"name": "g", "seen": ["topology"], "where": {"fabric": ["x"]}},
        tables=[
            {"title": "t", "rows": ["design"], "columns": ["method", "group"], "metrics": ["hausdorff_mm"]}
        ],
        figures=[
            {"title": "t", "x": "beta", "y": "hausdorff_mm", "lines": ["method", "shape"]},
            {"title": "t", "x": "sequence", "y": "hausdorff_mm", "each": "garment"},
            {"title": "t", "x": "time", "y": "vertex_mean", "y_label": "mm"},
        ],
        bootstrap={"cluster": "body"},
    )
    assert labels_needed(one) == {
        *("topology", "fabric", "design", "shape", "sequence", "garment", "body"),
    }
