"""Make the helpers importable, here and in the processes that the tests start; the undisturbed dataset."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import pytest

from benchmarks.faults import Contents, contents


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Contents:
    """What the dataset of sheets holds when nothing happens to its making."""
    from sheets import make

    out = tmp_path_factory.mktemp("undisturbed") / "data"
    assert len(make(out).made) == 9
    return contents(out)
