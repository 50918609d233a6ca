"""`muslin_regression`: a fixture that fails a test where a prediction got worse than it was.

def test_walk(muslin_regression, tmp_path):
    predict_walk(out=tmp_path / "walk")
    muslin_regression.check(tmp_path / "walk", "data/walk", name="walk")

`pytest --muslin-regenerate` writes the baselines that `pytest` then compares with.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

# pytest loads this module in every run, also of tests that never use it: everything else is imported later.

FOLDER = "muslin_baselines"
OPTION = "--muslin-regenerate"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that writes baselines anew."""
    parser.getgroup("muslin").addoption(
        OPTION, action="store_true", help="write the baselines of muslin_regression instead of checking"
    )


class Regression:
    """Baselines of the tests in one file, in a folder beside it."""

    def __init__(self, folder: Path, test: str, regenerate: bool) -> None:
        """folder: of the baselines; test: names those without a name of their own."""
        self.folder = folder
        self._test = test
        self._regenerate = regenerate

    def check(
        self,
        prediction: str | Path,
        truth: str | Path,
        name: str | None = None,
        *,
        tolerance: float | None = None,
        tolerances: Mapping[str, float] | None = None,
        fps: float | None = None,
        metrics: Sequence[str] = ("standard",),
    ) -> None:
        """Fail the test if a figure of prediction against truth is worse than its baseline.

        prediction, truth   what `muslin eval` takes: datasets, samples, mesh files, folders of them
        name         of the baseline; by default the test's
        tolerance    relative, of every error; by default 1%
        tolerances   {path of a figure: relative tolerance}, such as {"vertex_error_mm.mean": 0.05}
        fps          of files that do not tell
        metrics      families of metrics, as `muslin eval --metrics`
        """
        __tracebackhide__ = True
        from muslin.eval.compare import compare
        from muslin.eval.regression import (
            TOLERANCE,
            Tolerances,
            measured,
            read_baseline,
            regressions,
            write_baseline,
        )
        from muslin.garments.errors import InputError

        path = self.folder / f"{_file_name(name or self._test)}.json"
        again = f"run pytest {OPTION} to write it"
        if not self._regenerate and not path.is_file():
            pytest.fail(f"{path}: no baseline yet; {again}", pytrace=False)
        found = measured(compare(prediction, truth, fps=fps, metrics=metrics).to_dict())
        if self._regenerate:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_baseline(path, found)
            return
        limits = Tolerances(tolerances or {}, TOLERANCE if tolerance is None else tolerance)
        try:
            worse = regressions(read_baseline(path), found, limits)
        except InputError as error:
            pytest.fail(f"{path}: {error} ({again} anew)", pytrace=False)
        if worse:
            rows = "\n".join(f"  {row}" for row in worse)
            pytest.fail(f"{prediction} got worse than {path}:\n{rows}", pytrace=False)


@pytest.fixture
def muslin_regression(request: pytest.FixtureRequest) -> Regression:
    """Compares predictions with baselines in muslin_baselines/NAME_OF_TEST_FILE/, beside the test file."""
    file = request.path
    return Regression(
        file.parent / FOLDER / file.stem, request.node.name, bool(request.config.getoption(OPTION))
    )


def _file_name(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9._-]+", "-", name).strip("-.") or "baseline"
