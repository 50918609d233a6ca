"""A drape of the real simulator whose steps do not converge within their budget."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from benchmarks.faults import contents
from muslin.sim.dataset.config import parse_config
from muslin.sim.dataset.generate import GenerateReport, generate
from muslin.sim.dataset.quarantine import read_quarantined
from muslin.sim.dataset.root import open_root
from muslin.sim.dataset.sample import Sample
from muslin.sim.run import simulate_chain
from muslin.sim.scene import Scene, SolverTable

CONFIG = parse_config(
    {
        "kind": "drape",
        "scene": {
            "fabric": "gray-interlock",
            "garment": {"position": [0.0, 0.258, 0.0]},
            "colliders": [{"shape": "sphere", "radius": 0.25}],
        },
        "designs": [
            {"name": "stubborn", "design": "sheet", "edge_length": 0.2},
            {"name": "other", "design": "sheet", "edge_length": 0.15},
        ],
    }
)


def simulate(
    scenes: list[Scene], device: str, progress: Callable[[int, int], None] | None
) -> Iterator[Sample]:
    """The real simulator; the coarser drape gets one Newton iteration a step where FAULT_BUDGET is set."""
    if "FAULT_BUDGET" in os.environ and scenes[0].garment.edge_length == 0.2:
        scenes = [scene.model_copy(update={"solver": SolverTable(max_work=1)}) for scene in scenes]
    return simulate_chain(scenes, device, progress)


def make(out: Path, retry: bool = False) -> GenerateReport:
    return generate(CONFIG, out, workers=1, simulate=simulate, retry=retry)


def test_what_never_converges_is_given_up_with_its_last_good_state(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "data"
    monkeypatch.setenv("FAULT_BUDGET", "1")
    report = make(out)
    (given_up,) = report.failed
    assert (given_up.split("_")[0], len(report.made)) == ("stubborn", 1)
    entry = read_quarantined(open_root(out), given_up)
    assert "the budget of Newton iterations is spent" in entry.reason
    assert entry.command == f"muslin repair {out} --sample {given_up} --workers 1"
    with np.load(entry.state) as state:
        assert np.isfinite(state["positions"]).all()
        assert state["faces"].max() < len(state["positions"])
    assert make(out).held == (given_up,)
    monkeypatch.delenv("FAULT_BUDGET")
    assert make(out, retry=True).made == (given_up,)
    assert len(make(tmp_path / "undisturbed").made) == 2
    assert contents(out) == contents(tmp_path / "undisturbed")
