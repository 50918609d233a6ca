"""Topologies of a design are the same in all its drapes, and splits can go by them."""

from __future__ import annotations

import pytest

from muslin.garments.errors import InputError
from muslin.sim.dataset.config import parse_config
from muslin.sim.dataset.plan import Plan, plan

DESIGNS = [{"preset": "top"}, {"preset": "tshirt"}]
SHAPES = [{"name": "h", "sweep": {"component": 0, "start": -1.0, "stop": 1.0, "count": 4}}]
ASKED = {"count": 3, "target_area": [4e-4, 8e-4]}


def planned(asked: dict | None = None, **values: object) -> Plan:
    base = {"kind": "drape", "designs": DESIGNS, "shapes": SHAPES, "topologies": asked or ASKED}
    return plan(parse_config(base | values))


def tables(result: Plan) -> dict[tuple[str, str], set[str]]:
    found: dict[tuple[str, str], set[str]] = {}
    for job in result.jobs:
        place = (job.labels["design"], job.labels["topology"])
        found.setdefault(place, set()).add(str(job.scene.get("topology")))
    return found


def test_every_shape_is_given_on_the_source_and_all_topologies_side_by_side() -> None:
    first = planned(fabrics=["denim", "silk"], chain=2).chains[0]
    assert [(job.labels["shape"], job.labels["topology"]) for job in first.jobs] == [
        (shape, topology) for shape in ("h-000", "h-001") for topology in ("source", "t00", "t01", "t02")
    ]


def test_a_topology_belongs_to_its_design_alone() -> None:
    found = tables(planned(fabrics=["denim", "silk"], chain=2))
    assert all(len(drawn) == 1 for drawn in found.values())
    assert len({drawn for (_, topology), (drawn,) in found.items() if topology != "source"}) == 6


def test_target_areas_are_in_their_range() -> None:
    jobs = planned({"count": 50, "target_area": [4e-4, 8e-4]}).jobs
    areas = {job.scene["topology"]["target_area"] for job in jobs if "topology" in job.scene}
    assert 4e-4 <= min(areas) < 4.4e-4
    assert 7.6e-4 < max(areas) <= 8e-4


def test_more_topologies_change_none() -> None:
    few, many = (tables(planned(ASKED | {"count": count})) for count in (2, 5))
    assert few.items() <= many.items()
    few_ids, many_ids = ({j.id for j in planned(ASKED | {"count": n}).jobs} for n in (2, 5))
    assert few_ids < many_ids


def test_the_source_is_the_drape_of_a_dataset_without_topologies() -> None:
    bare = plan(parse_config({"kind": "drape", "designs": DESIGNS, "shapes": SHAPES}))
    sources = [job for job in planned().jobs if job.labels["topology"] == "source"]
    assert [job.scene for job in sources] == [job.scene for job in bare.jobs]
    assert all("topology" not in job.labels for job in bare.jobs)


def test_the_source_can_be_left_out() -> None:
    assert {job.labels["topology"] for job in planned(ASKED | {"keep_source": False}).jobs} == {
        "t00",
        "t01",
        "t02",
    }


def test_simulated_topologies_have_chains_of_their_own() -> None:
    chains = planned(ASKED | {"mode": "simulate"}).chains
    assert len(chains) == 2 * 4
    for chain in chains:
        assert len({job.labels["topology"] for job in chain.jobs}) == 1
        assert all(not job.scene["topology"]["fit"] for job in chain.jobs if "topology" in job.scene)


def test_splits_by_names_of_topologies_and_by_patterns() -> None:
    splits = {"test-topologies": {"topologies": ["t0[12]"]}, "test-shapes": {"shapes": ["h-*[13]"]}}
    for job in planned(splits=splits).jobs:
        unseen = job.labels["topology"] in ("t01", "t02")
        odd = job.labels["shape"] in ("h-001", "h-003")
        assert job.split == ("test-topologies" if unseen else "test-shapes" if odd else "train")


def test_a_drawn_split_keeps_topologies_whole() -> None:
    jobs = planned(ASKED | {"count": 30}, splits={"test": {"by": "topology", "fraction": 0.3}}).jobs
    test, train = ({j.labels["topology"] for j in jobs if j.split == name} for name in ("test", "train"))
    assert not test & train
    assert 2 < len(test) < 20


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"splits": {"a": {"topologies": ["t9?"]}}}, r"splits\.a\.topologies: 't9\?' is the name of none"),
        ({"topologies": {"count": 2, "target_area": [2e-4, 1e-4]}}, r"must be \[low, high\]"),
        ({"topologies": {"count": 2}}, r"topologies\.target_area"),
        ({"topologies": {"count": 0, "target_area": 1e-3}}, "greater than or equal to 1"),
        ({"topologies": {"number": 2}}, "number: unknown key; allowed here: count, target_area"),
    ],
)
def test_what_cannot_be_planned(values: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        planned(**values)
