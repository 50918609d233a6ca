"""Runs that make the dataset of sheets: in this process, or as one of their own that can be killed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from faulty_producer import simulate
from sheet_producer import make_scene, sheets_config

from muslin.sim.dataset import store
from muslin.sim.dataset.generate import GenerateReport, generate
from muslin.sim.dataset.repair import RepairReport, repair
from muslin.sim.dataset.root import open_root

HERE = Path(__file__).parent
ROOT = HERE.parents[3]
SECONDS = 600.0
"""More than anything here takes on any machine."""


def make(out: str | Path, **how: Any) -> GenerateReport:
    """`generate` in this process; one worker unless `cluster` is given."""
    how = how if "cluster" in how else {"workers": 1} | how
    return generate(sheets_config(), out, simulate=simulate, make_scene=make_scene, **how)


def mend(out: str | Path) -> RepairReport:
    """`repair` in this process, by one worker."""
    return repair(out, workers=1, simulate=simulate, make_scene=make_scene)


def start(
    out: str | Path, environment: dict[str, str] | None = None, before: Path | None = None, **how: Any
) -> subprocess.Popen[str]:
    """A process that makes the dataset; see `sheets_main` for `how`. Modules are found in `before` first."""
    return subprocess.Popen(
        [sys.executable, str(HERE / "sheets_main.py"), str(out), json.dumps(how)],
        env=environment_of(environment, before),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def environment_of(more: dict[str, str] | None = None, before: Path | None = None) -> dict[str, str]:
    """In which processes find what this one finds."""
    found = [before, HERE, HERE.parent, os.environ.get("PYTHONPATH")]
    paths = os.pathsep.join(str(path) for path in found if path)
    return os.environ | {"PYTHONPATH": paths} | (more or {})


def stored(out: str | Path) -> int:
    """How many samples are there."""
    return len(store.stored_ids(open_root(out)))
