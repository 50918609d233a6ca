"""The shipped protocols on a dataset that the simulator made, with a baseline that learns nothing."""

from dataclasses import replace

import numpy as np
import pytest

from muslin.eval.bench.protocol import load_protocol
from muslin.eval.bench.run import bench
from muslin.sim.dataset.config import parse_config
from muslin.sim.dataset.generate import generate
from muslin.sim.dataset.reader import open_dataset, write_dataset
from muslin.sim.remesh.topology import remesh
from tests.eval.bench.conftest import PROTOCOLS

CONFIG = {
    "kind": "both",
    "scene": {"fabric": "gray-interlock", "garment": {"edge_length": 0.055}, "body": {"model": "female"}},
    "designs": [{"name": "seen", "preset": "top"}, {"name": "unseen", "preset": "tshirt"}],
    "shapes": [{"name": "slim", "beta": [-0.5]}, {"name": "full", "beta": [0.5]}],
    "sequences": [
        {"name": "learned", "clip": "cmu_01_03", "end": 0.05, "designs": ["seen"]},
        {"name": "new", "clip": "walk", "end": 0.15, "designs": ["unseen"]},
    ],
    "splits": {"test": {"designs": ["unseen"], "shapes": ["full"], "sequences": ["new"]}},
}


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    """Drapes of two designs on two shapes, a sequence each; that of the seen design and unseen shape in other
    triangles as well."""
    folder = tmp_path_factory.mktemp("generated")
    report = generate(parse_config(CONFIG), folder / "made", workers=2)
    assert not report.failed
    made = open_dataset(folder / "made")
    samples = [made[i] for i in made.ids]
    splits = {row["id"]: row["split"] for row in made.rows}
    samples = [replace(s, labels=s.labels | {"split": splits[s.id]}) for s in samples]
    (drape,) = [
        s for s in samples if s.kind == "drape" and s.labels["design"] == "seen" and splits[s.id] == "test"
    ]
    other = remesh(drape.garment, drape.positions[0].astype(np.float64), 2e-3, seed=1)
    positions = other.positions.astype(np.float32)[None]
    samples.append(replace(drape, id="other", garment=other.mesh, positions=positions, masked_faces=()))
    write_dataset(folder / "truth", samples)
    return folder / "truth"


@pytest.fixture(scope="module")
def lifted(dataset):
    """A method: the truth, 4 mm higher."""
    truth = open_dataset(dataset)
    up = np.array([0.0, 4e-3, 0.0], dtype=np.float32)
    tested = [truth[row["id"]] for row in truth.rows if row["split"] == "test"]
    write_dataset(dataset.parent / "lifted", [replace(s, positions=s.positions + up) for s in tested])
    return dataset.parent / "lifted"


@pytest.mark.parametrize(
    ("protocol", "groups"),
    [
        ("static_topologies", {"seen": 1, "unseen": 1}),
        ("static_designs", {"unseen": 1}),
        ("animated_designs", {"unseen": 1}),
    ],
)
def test_protocol_on_what_the_simulator_made(dataset, lifted, protocol, groups):
    outcome = bench(load_protocol(PROTOCOLS / f"{protocol}.toml"), {"lifted": lifted}, dataset, workers=1)
    assert {name: len(ids) for name, ids in outcome.groups.items()} == groups
    for ids in outcome.groups.values():
        (sample,) = ids
        (vertex,) = outcome.values("lifted", [sample], "vertex_error_mm.mean")
        assert vertex == pytest.approx(4.0, abs=1e-3)
        if protocol == "animated_designs":
            (velocity,) = outcome.values("lifted", [sample], "velocity_error_mm_s.mean")
            assert velocity == pytest.approx(0.0, abs=0.02)
        else:
            (hausdorff,) = outcome.values("lifted", [sample], "hausdorff_mm")
            assert 1.0 < hausdorff <= 4.0 + 1e-3
