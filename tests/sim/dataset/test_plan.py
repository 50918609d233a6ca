"""The plan is a function of the configuration alone, and extending one part leaves the rest as it was."""

from __future__ import annotations

import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest

from muslin.garments import catalogue
from muslin.garments.errors import InputError
from muslin.sim.dataset.config import parse_config
from muslin.sim.dataset.plan import TRAIN, Plan, plan


def planned(**values: object) -> Plan:
    return plan(parse_config({"kind": "drape", **values}))


SWEEP = [{"name": "h", "sweep": {"component": 1, "start": -2.0, "stop": 2.0, "count": 5}}]


def test_the_same_ids_in_another_process() -> None:
    code = (
        "from muslin.sim.dataset.config import parse_config; from muslin.sim.dataset.plan import plan;"
        "c = dict(kind='drape', designs=[dict(random=dict(count=3))], shapes=[dict(random=dict(count=2))]);"
        "print([j.id for j in plan(parse_config(c)).jobs])"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    here = planned(designs=[{"random": {"count": 3}}], shapes=[{"random": {"count": 2}}])
    assert told.strip() == str([job.id for job in here.jobs])


def test_ids_follow_all_that_makes_the_geometry() -> None:
    base = {"designs": [{"preset": "top", "name": "a"}], "shapes": SWEEP, "scene": {"fabric": "denim"}}
    first = {job.id for job in planned(**base).jobs}
    for change in (
        {"scene": {"fabric": "silk"}},
        {"designs": [{"preset": "top", "name": "a", "parameters": {"sleeve_length": 0.12}}]},
        {"designs": [{"preset": "top", "name": "a", "edge_length": 0.03}]},
        {"fabrics": ["silk"]},
        {"scene": {"fabric": "denim", "solver": {"dt": 0.01}}},
    ):
        assert first.isdisjoint(job.id for job in planned(**(base | change)).jobs)
    unaffected = {"seed": 9, "name": "other", "splits": {"test": {"shapes": ["h-000"]}}}
    unaffected["expect"] = {"residual": 0.1}
    assert first == {job.id for job in planned(**(base | unaffected)).jobs}
    assert first == {job.id for job in planned(**(base | {"scene": {"fabric": "denim", "expect": {}}})).jobs}


def test_a_drape_is_named_by_the_shapes_that_came_before_it_too() -> None:
    forward = planned(shapes=[{"name": "a", "beta": [1.0]}, {"name": "b", "beta": [2.0]}]).jobs
    backward = planned(shapes=[{"name": "b", "beta": [2.0]}, {"name": "a", "beta": [1.0]}]).jobs
    assert {job.id for job in forward}.isdisjoint(job.id for job in backward)


def test_extending_a_block_keeps_what_was_drawn() -> None:
    def draw(designs: int, shapes: int) -> set[str]:
        blocks = {"designs": [{"random": {"count": designs}}], "shapes": [{"random": {"count": shapes}}]}
        return {job.id for job in planned(**blocks).jobs}

    assert draw(3, 4) < draw(5, 4)
    assert draw(3, 4) < draw(3, 6)


def test_another_seed_draws_otherwise() -> None:
    blocks = {"designs": [{"random": {"count": 3}}]}
    assert {j.id for j in planned(seed=0, **blocks).jobs}.isdisjoint(
        j.id for j in planned(seed=1, **blocks).jobs
    )


def test_random_parameters_are_uniform_in_their_ranges() -> None:
    ranges = {"sleeve_length": [0.15, 0.25]}
    jobs = planned(designs=[{"preset": "tshirt", "random": {"count": 400, "ranges": ranges}}]).jobs
    drawn = np.array([job.scene["garment"]["parameters"]["sleeve_length"] for job in jobs])
    assert drawn.min() >= 0.15
    assert drawn.max() <= 0.25
    # Standard error of the mean of 400 uniform draws from a range of 0.1 is 0.0014.
    assert abs(drawn.mean() - 0.2) < 0.006
    fixed = catalogue.get("tee").preset("tshirt")
    for key in fixed.keys() - ranges.keys():
        assert {job.scene["garment"]["parameters"][key] for job in jobs} == {fixed[key]}


def test_sweeps_are_even_and_zero_elsewhere() -> None:
    betas = [job.scene["body"]["beta"] for job in planned(shapes=SWEEP).jobs]
    assert betas == [[0.0, -2.0], [0.0, -1.0], [0.0, 0.0], [0.0, 1.0], [0.0, 2.0]]


def test_long_lists_of_shapes_are_cut_into_chains() -> None:
    result = planned(shapes=[{"random": {"count": 7, "components": 2}}], chain=3)
    assert [len(chain.jobs) for chain in result.chains] == [3, 3, 1]


def test_a_design_replaces_the_garment_of_the_scene_but_not_its_mesh_size() -> None:
    scene = {"garment": {"mesh": "x.obj", "parameters": {"sleeve_length": 9.0}, "template": 400}}
    (job,) = planned(scene=scene, designs=[{"preset": "top"}]).jobs
    assert job.scene["garment"].keys() == {"design", "parameters", "template"}
    assert planned(scene=scene).jobs[0].scene["garment"] == scene["garment"]


def test_the_first_split_that_names_a_sample_takes_it() -> None:
    splits = {"a": {"shapes": ["h-000"]}, "b": {"shapes": ["h-000", "h-001"], "designs": ["top"]}}
    jobs = planned(designs=[{"preset": "tshirt"}, {"preset": "top"}], shapes=SWEEP, splits=splits).jobs
    by_name = {(job.labels["design"], job.labels["shape"]): job.split for job in jobs}
    assert by_name["tshirt", "h-000"] == by_name["top", "h-000"] == "a"
    assert by_name["tshirt", "h-001"] == by_name["top", "h-004"] == "b"
    assert by_name["tshirt", "h-004"] == TRAIN


def test_a_drawn_split_keeps_designs_whole_and_stays_when_extended() -> None:
    def splits(count: int) -> dict[str, str]:
        blocks = {"designs": [{"name": "r", "random": {"count": count}}], "shapes": SWEEP}
        jobs = planned(**blocks, splits={"test": {"by": "design", "fraction": 0.3}}).jobs
        found: dict[str, set[str]] = {}
        for job in jobs:
            found.setdefault(job.labels["design"], set()).add(job.split)
        assert all(len(names) == 1 for names in found.values())
        return {design: names.pop() for design, names in found.items()}

    sizes = [10, 40, 200]
    for few, many in pairwise(sizes):
        assert splits(few).items() <= splits(many).items()
    share = list(splits(200).values()).count("test") / 200
    assert abs(share - 0.3) < 0.13  # four standard deviations of a binomial share


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"designs": [{"design": "toga"}]}, r"designs\.0: no design 'toga'; allowed: tee"),
        ({"designs": [{"preset": "toga"}]}, r"designs\.0: .*no preset 'toga'; allowed: top"),
        ({"designs": [{"parameters": {"sleeve": 1}}]}, "no parameter 'sleeve'; allowed"),
        ({"designs": [{"parameters": {"sleeve_length": 9}}]}, "sleeve_length = 9.* out of range"),
        ({"designs": [{"random": {"count": 1, "ranges": {"sleeve": [0, 1]}}}]}, r"ranges\.sleeve: unknown"),
        ({"designs": [{"random": {"count": 1, "ranges": {"sleeve_length": [0.3, 0.2]}}}]}, "inside"),
        ({"designs": [{"random": {"count": 1, "ranges": {"sleeve_length": [0.3, 20]}}}]}, "inside"),
        ({"designs": [{"preset": "top"}, {"preset": "top"}]}, "designs: two of them are named 'top'"),
        ({"shapes": [{"name": "a", "beta": [0]}] * 2}, "shapes: two of them are named 'a'"),
        ({"splits": {"test": {"designs": ["gown"]}}}, r"splits\.test\.designs: 'gown' is the name of none"),
        ({"sequences": [{"clip": "walk", "shapes": ["thin"]}]}, r"sequences\.0\.shapes: 'thin'"),
        ({"kind": "sequence"}, "leaves no sample"),
        ({"fabrics": ["silk", "silk"]}, "two samples are the same"),
    ],
)
def test_what_cannot_be_planned(values: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        planned(**values)
