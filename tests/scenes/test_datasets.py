"""The datasets of scenes/datasets: what their presets hold, and the smallest really made."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from muslin.sim.dataset.config import load_config
from muslin.sim.dataset.plan import Plan, plan
from muslin.sim.dataset.sources import check_sources
from muslin.sim.scene import parse_scene

FOLDER = Path(__file__).parents[2] / "scenes/datasets"
STATIC, ANIMATED = FOLDER / "thesis_static.toml", FOLDER / "thesis_animated.toml"


def planned(file: Path, preset: str) -> Plan:
    return plan(load_config(file, preset=preset))


def members(result: Plan, label: str, split: str | None = None) -> set[str]:
    return {job.labels[label] for job in result.jobs if split in (None, job.split)}


@pytest.mark.parametrize(
    ("preset", "shapes", "fabrics", "topologies"), [("small", 9, 2, 13), ("tiny", 3, 1, 3)]
)
def test_static_presets(preset: str, shapes: int, fabrics: int, topologies: int) -> None:
    result = planned(STATIC, preset)
    designs = len(members(result, "design"))
    assert len(result.jobs) == designs * shapes * fabrics * topologies
    assert members(result, "design", "test-designs") == {
        name for name in members(result, "design") if name.startswith("unseen")
    }
    assert not members(result, "topology", "train") & members(result, "topology", "test-topologies")
    assert not members(result, "shape", "train") & members(result, "shape", "test-shapes")
    check_sources(parse_scene(job.scene) for job in result.jobs)


def test_the_static_dataset_of_the_thesis() -> None:
    config = load_config(STATIC, preset="thesis")
    assert config == load_config(STATIC)
    assert config.topologies is not None
    # One topology stands for all 20 here: the number of samples is a product.
    result = plan(config.model_copy(update={"topologies": None, "splits": {}}))
    designs = members(result, "design")
    assert (len(designs), sum(name.startswith("unseen") for name in designs)) == (19, 6)
    assert len(result.jobs) == 19 * 2 * 201
    assert config.topologies.count == 20
    small = planned(STATIC, "small")
    assert members(small, "design") == designs
    two = config.model_copy(update={"designs": [config.designs[0], config.designs[-1]], "fabrics": []})
    train = plan(two).jobs
    assert len(train) == 2 * 201 * 21
    assert {job.labels["shape"][-1] for job in train if job.split == "train"} == set("02468")
    assert [job.scene["body"]["beta"] for job in result.jobs[:3]] == [[-3.0], [-2.97], [-2.94]]


def test_the_animated_dataset_of_the_thesis() -> None:
    result = planned(ANIMATED, "thesis")
    names = members(result, "design")
    assert Counter(name.split("-")[1] for name in names) == {"length": 7, "sleeve": 6, "neck": 4}
    assert sum(name.startswith("unseen") for name in names) == 6
    assert len(members(result, "sequence")) == 52
    assert len(members(result, "sequence", "test-sequences")) == 5
    assert len(result.jobs) == 17 * 52 * 3
    check_sources(parse_scene(job.scene) for job in result.jobs)
    small = planned(ANIMATED, "small")
    assert members(small, "design") == names
    assert members(small, "sequence", "test-sequences") == {"held-kick"}
    assert members(small, "sequence", "test-designs") >= {"held-kick", "held-walk-right-sharp"}
    at_rest = planned(ANIMATED, "small-at-rest")
    assert {job.scene["motion"]["mode"] for job in at_rest.jobs} == {"quasi-static"}
    assert members(at_rest, "sequence") == members(small, "sequence")
