"""Same configuration, same bytes: with any number of workers, in one go or killed and resumed."""

from __future__ import annotations

import json
import math
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sheet_producer import files_of, make_scene, sheets_config, simulate

from muslin.garments.errors import InputError
from muslin.sim.dataset import store
from muslin.sim.dataset.config import DatasetConfig, parse_config
from muslin.sim.dataset.engine import Cluster
from muslin.sim.dataset.generate import GenerateReport, generate, solver_digest
from muslin.sim.dataset.header import installed_versions
from muslin.sim.dataset.plan import plan
from muslin.sim.dataset.quarantine import quarantined_ids, read_quarantined
from muslin.sim.dataset.reader import open_dataset
from muslin.sim.dataset.repair import repair
from muslin.sim.dataset.root import open_root
from muslin.sim.dataset.schema import FAILED, INDEX, PARTIAL, SAMPLES

MAIN = Path(__file__).parent / "sheet_main.py"


def run(config: DatasetConfig, out: Path, workers: int = 1, **more: Any) -> GenerateReport:
    return generate(config, out, workers=workers, simulate=simulate, make_scene=make_scene, **more)


def stored_ids(out: Path) -> list[str]:
    return store.stored_ids(open_root(out))


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The dataset made in one go by one worker."""
    out = tmp_path_factory.mktemp("whole") / "data"
    report = run(sheets_config(), out)
    assert (len(report.made), len(report.kept), report.failed) == (9, 0, {})
    return out


def test_more_workers_make_the_same_bytes(whole: Path, tmp_path: Path) -> None:
    out = tmp_path / "data"
    told: list[tuple[float, int]] = []
    report = generate(
        sheets_config(),
        out,
        workers=2,
        simulate=simulate,
        make_scene=make_scene,
        progress=lambda done, total, message: told.append((done, total)),
    )
    assert files_of(out) == files_of(whole)
    assert report.made == tuple(job.id for job in plan(sheets_config()).jobs)
    assert told[-1] == (9.0, 9)
    assert [done for done, _ in told] == sorted(done for done, _ in told)


def test_what_is_there_is_kept_and_what_is_gone_is_made_again(whole: Path, tmp_path: Path) -> None:
    out = shutil.copytree(whole, tmp_path / "data")
    ids = open_dataset(out).ids
    before = files_of(out)
    assert run(sheets_config(), out).kept == ids
    # The third of a chain of four: it must be made from the start of its chain, the others must not be
    # touched.
    for name in (ids[2], ids[8]):
        store.sample_file(out, name).unlink()
    stamps = {name: store.sample_file(out, name).stat().st_mtime_ns for name in stored_ids(out)}
    report = run(sheets_config(), out)
    assert report.made == (ids[2], ids[8])
    assert files_of(out) == before
    assert stamps == {name: store.sample_file(out, name).stat().st_mtime_ns for name in stamps}


def test_extension_adds_and_keeps(tmp_path: Path) -> None:
    def config(count: int, **more: object) -> DatasetConfig:
        shapes = [{"name": "s", "random": {"count": count, "components": 2}}]
        return parse_config({"kind": "drape", "shapes": shapes, **more})

    first = run(config(2), tmp_path / "data")
    second = run(config(3), tmp_path / "data")
    assert second.kept == first.made
    assert len(second.made) == 1
    assert open_dataset(tmp_path / "data").ids == (*second.kept, *second.made)
    splits = {"test": {"shapes": ["s-001"]}}
    assert run(config(3, splits=splits), tmp_path / "data").made == ()
    assert [row["split"] for row in open_dataset(tmp_path / "data").rows] == ["train", "test", "train"]
    before = files_of(tmp_path / "data")
    with pytest.raises(InputError, match=r"another config.*shapes\[0\].random.count: 3 -> 2"):
        run(config(2), tmp_path / "data")
    assert files_of(tmp_path / "data") == before


@pytest.fixture
def faults(monkeypatch: pytest.MonkeyPatch) -> Callable[[dict[str, float]], None]:
    """faults({"fail_at": beta}): what goes wrong in simulations that begin after it; nothing with {}."""
    return lambda found: monkeypatch.setenv("SHEET_FAULTS", json.dumps(found))


def second_beta() -> float:
    """Of the second drape of the first chain."""
    return float(plan(sheets_config()).chains[0].jobs[1].scene["body"]["beta"][0])


def test_a_chain_that_fails_is_told_and_left_alone_until_asked_for(
    whole: Path, tmp_path: Path, faults: Callable[[dict[str, float]], None]
) -> None:
    out = tmp_path / "data"
    first, failed, *behind = (job for job in plan(sheets_config()).chains[0].jobs)
    faults({"fail_at": second_beta()})
    report = run(sheets_config(), out)
    rest = {job.id: f"comes after {failed.id} in its chain" for job in behind}
    assert report.failed == {failed.id: f"InputError: cannot dress shape {second_beta()}"} | rest
    assert (len(report.made), report.held) == (6, ())
    assert first.id in report.made
    assert open_dataset(out).missing == tuple(report.failed)
    assert quarantined_ids(open_root(out)) == {failed.id}
    entry = read_quarantined(open_root(out), failed.id)
    assert (entry.id, entry.reason, entry.seed) == (failed.id, report.failed[failed.id], failed.seed)
    assert entry.log[0].startswith("Traceback")
    assert entry.log[-1].endswith(entry.reason)
    assert entry.scenes == (first.scene, failed.scene)
    assert (entry.command, entry.state) == (f"muslin repair {out} --sample {failed.id} --workers 1", "")
    assert entry.versions == installed_versions()

    faults({})
    before = files_of(out)
    again = run(sheets_config(), out)
    assert (again.made, again.failed, again.held) == ((), {}, (failed.id, *rest))
    assert files_of(out) == before
    assert read_quarantined(open_root(out), failed.id) == entry
    lifted = run(sheets_config(), out, retry=True)
    assert (lifted.made, lifted.failed, lifted.held) == ((failed.id, *rest), {}, ())
    assert not quarantined_ids(open_root(out))
    assert files_of(out) == files_of(whole)


def test_a_chain_that_is_stuck_leaves_its_last_good_state_until_it_is_repaired(
    whole: Path, tmp_path: Path, faults: Callable[[dict[str, float]], None]
) -> None:
    out = tmp_path / "data"
    failed = plan(sheets_config()).chains[0].jobs[1].id
    faults({"stuck_at": second_beta()})
    report = run(sheets_config(), out)
    assert (len(report.made), len(report.failed)) == (6, 3)
    kept = out / FAILED / f"{failed}.npz"
    assert report.failed[failed] == (
        f"SimulationError: frame 3: cloth [7] is stuck; the last good state is in {kept}"
    )
    assert read_quarantined(open_root(out), failed).state == str(kept)
    with np.load(kept) as state:
        assert state["faces"].max() < len(state["positions"]) == len(state["velocity"])
    assert len(open_dataset(out)) == 6

    faults({})
    mended = repair(out, workers=1, simulate=simulate, make_scene=make_scene)
    assert mended.passed
    assert mended.made == tuple(report.failed)
    assert not list((out / FAILED).iterdir())
    assert files_of(out) == files_of(whole)


def test_a_worker_that_dies_is_replaced_and_its_sample_given_up_in_the_end(
    whole: Path, tmp_path: Path, faults: Callable[[dict[str, float]], None]
) -> None:
    """What was committed before counts as made, and chains beside it are finished."""
    out = tmp_path / "data"
    first, failed, *behind = (job.id for job in plan(sheets_config()).chains[0].jobs)
    faults({"die_at": second_beta()})
    report = run(sheets_config(), out, workers=None, cluster=Cluster(workers=1, retries=1))
    assert list(report.failed) == [failed, *behind]
    assert "the worker process died, 2 times" in report.failed[failed]
    assert len(report.made) == 6
    assert first in report.made
    entry = read_quarantined(open_root(out), failed)
    assert (entry.reason, len(entry.scenes), entry.state) == (report.failed[failed], 2, "")
    assert entry.log, "what nannies said of it"
    assert f"repair {out} --sample {failed}" in entry.command
    faults({})
    assert run(sheets_config(), out).held == (failed, *behind)
    assert run(sheets_config(), out, retry=True).made == (failed, *behind)
    assert files_of(out) == files_of(whole)


def test_a_scene_that_cannot_be_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    config = parse_config({"kind": "drape", "scene": {"gravty": 9.81}})
    with pytest.raises(InputError, match=r"scene of sample garment_base_\w+: unknown key gravty"):
        run(config, tmp_path / "data")
    with pytest.raises(InputError, match="workers = 0"):
        run(sheets_config(), tmp_path / "data", workers=0)
    assert not (tmp_path / "data").exists()


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"scene": {"body": {"model": "none.pkl"}}}, r"none\.pkl does not exist"),
        (
            {"scene": {"body": {"model": "female"}, "garment": {"pattern": "none.json"}}},
            r"none\.json: cannot be",
        ),
        ({"scene": {"body": {"model": "female"}, "garment": {"preset": "cape"}}}, "no preset 'cape'"),
        ({"kind": "sequence", "sequences": [{"clip": "stroll"}]}, "motion 'stroll' is unknown"),
        ({"kind": "sequence", "sequences": [{"clip": "walk", "end": 900.0}]}, "cannot clip from 0"),
    ],
)
def test_what_a_scene_names_must_be_there_before_anything_is_written(
    tmp_path: Path, values: dict[str, Any], says: str
) -> None:
    config = parse_config({"kind": "drape", "scene": {"body": {"model": "female"}}} | values)
    with pytest.raises(InputError, match=says):
        generate(config, tmp_path / "data")
    assert not (tmp_path / "data").exists()


def other_simulate(*arguments: object) -> object:
    return simulate(*arguments)  # type: ignore[arg-type]


def test_samples_of_two_solvers_are_not_mixed(whole: Path, tmp_path: Path) -> None:
    out = shutil.copytree(whole, tmp_path / "data")
    assert solver_digest(simulate) != solver_digest(other_simulate)
    complete = generate(sheets_config(), out, simulate=other_simulate, make_scene=make_scene)
    assert (len(complete.made), len(complete.kept)) == (0, 9)
    before = files_of(out)
    values = sheets_config().model_dump()
    longer = parse_config(values | {"sequences": [*values["sequences"], {"clip": "hop", "end": 0.5}]})
    with pytest.raises(InputError, match=r"another solver.*another folder"):
        generate(longer, out, simulate=other_simulate, make_scene=make_scene)
    assert files_of(out) == before


def test_the_index_is_rebuilt_when_missing(whole: Path) -> None:
    rows = open_dataset(whole).rows
    index = (whole / INDEX).read_bytes()
    (whole / INDEX).unlink()
    assert open_dataset(whole).rows == rows
    run(sheets_config(), whole)
    assert (whole / INDEX).read_bytes() == index


def test_killed_at_any_moment_it_completes_to_the_same_dataset(whole: Path, tmp_path: Path) -> None:
    delay = 0.1
    out = tmp_path / "killed"
    moments = random.Random(4)
    kept = 0
    # Held at a shape, a run cannot end before it is killed, however long this process is kept waiting:
    # the first leaves the second chain of drapes undone, the second at least its last drape.
    for how, workers, hold in ((signal.SIGKILL, 2, 0.1), (signal.SIGINT, 1, 0.9)):
        process = start(out, delay, workers, hold)
        wait_for_samples(out, kept + 1)
        time.sleep(moments.uniform(0.0, 2 * delay))
        orphans = descendants(process.pid)
        assert len(orphans) >= workers
        process.send_signal(how)
        process.communicate(timeout=120)
        wait_until_gone(orphans)
        before, kept = kept, len(stored_ids(out))
        assert before < kept
        for name in stored_ids(out):
            store.read_sample(open_root(out), name)
    last = start(out, 0.0)
    told, _ = last.communicate(timeout=120)
    assert told.split() == [str(9 - kept), str(kept), "0"]
    assert files_of(out) == files_of(whole)
    assert not list((out / PARTIAL).iterdir())
    assert [row["id"] for row in open_dataset(out).rows] == list(open_dataset(whole).ids)


def start(out: Path, delay: float, workers: int = 1, hold: float = math.inf) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, str(MAIN), str(out), str(workers)],
        env=os.environ | {"SHEET_DELAY": str(delay), "SHEET_HOLD": str(hold)},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )


def wait_for_samples(out: Path, count: int) -> None:
    end = time.monotonic() + 120.0
    while not (out / SAMPLES).is_dir() or len(stored_ids(out)) < count:
        assert time.monotonic() < end
        time.sleep(0.002)


def descendants(pid: int) -> list[int]:
    """Workers, whichever thread started them, and what they start."""
    try:
        threads = list(Path(f"/proc/{pid}/task").iterdir())
        found = [int(child) for thread in threads for child in (thread / "children").read_text().split()]
    except (FileNotFoundError, ProcessLookupError):
        return []
    return [each for child in found for each in (child, *descendants(child))]


def wait_until_gone(pids: list[int]) -> None:
    """The workers of a killed parent must end by themselves, and soon."""
    end = time.monotonic() + 20.0
    while alive := [pid for pid in pids if os.path.exists(f"/proc/{pid}") and not zombie(pid)]:
        assert time.monotonic() < end, f"orphans: {alive}"
        time.sleep(0.01)


def zombie(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z"
    except FileNotFoundError:
        return True
