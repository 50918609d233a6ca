"""One small dataset, two methods and the outcomes of the shipped protocols, for all tests of benchmarks."""

from __future__ import annotations

from pathlib import Path

import pytest

from muslin.eval.bench.outcome import Outcome
from muslin.eval.bench.protocol import load_protocol
from muslin.eval.bench.run import bench
from muslin.eval.cost import Cost, write_cost
from tests.eval.bench.data import predict_files, write_truth

PROTOCOLS = Path(__file__).resolve().parents[3] / "scenes" / "protocols"
DESIGN_MM = {"a": 1.0, "b": 2.0, "c": 3.0, "d": 4.0}
LEFT_OUT = "c-s2-t0"


@pytest.fixture(scope="session")
def truth(tmp_path_factory) -> Path:
    return write_truth(tmp_path_factory.mktemp("bench") / "truth")


@pytest.fixture(scope="session")
def methods(truth) -> dict[str, Path]:
    """steady: too high by 1 to 4 mm by design, 2 mm more on topology t2. shaky: twice as much by design, up
    and down by turns; a sample is lacking."""
    steady = predict_files(
        truth,
        truth.parent / "steady",
        lambda s, t: 1e-3 * (DESIGN_MM[s.labels["design"]] + 2.0 * (s.labels["topology"] == "t2")),
    )
    shaky = predict_files(
        truth,
        truth.parent / "shaky",
        lambda s, t: 2e-3 * (-1) ** t * DESIGN_MM[s.labels["design"]],
        leave_out=(LEFT_OUT,),
    )
    write_cost(Cost(milliseconds_per_frame=12.5, parameters=7_100_000, file_bytes=14_200_000), shaky)
    return {"steady": steady, "shaky": shaky}


@pytest.fixture(scope="session")
def outcomes(truth, methods) -> dict[str, Outcome]:
    """The shipped protocols, by name."""
    files = sorted(PROTOCOLS.glob("*.toml"))
    return {file.stem: bench(load_protocol(file), methods, truth, workers=1) for file in files}
