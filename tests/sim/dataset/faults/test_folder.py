"""What befalls the folder of a dataset: a full disk, a bit, a second run."""

from __future__ import annotations

import random
import subprocess
import sys
from pathlib import Path

import pytest
from sheets import HERE, SECONDS, environment_of, make, mend, start, stored

from benchmarks.faults import Contents, contents, flip_bit, truncate, wait_until
from muslin.sim.dataset import store
from muslin.sim.dataset.root import open_root
from muslin.sim.dataset.verify import verify

ON_A_SMALL_DISK = """\
set -e
mount -t tmpfs -o size=64k none "$1/disk"
set +e
"$2" "$3" "$1/disk/data" '{"workers": 1}'
echo "exit code $?"
ls "$1/disk/data/.partial"
cp -r "$1/disk/data" "$1/data"
"""


def test_a_full_disk_ends_a_run_and_leaves_nothing_broken(undisturbed: Contents, tmp_path: Path) -> None:
    if subprocess.run(["unshare", "-Urm", "true"], capture_output=True).returncode:
        pytest.skip("this system lets no user mount a disk of its own (unshare -Urm)")
    (tmp_path / "disk").mkdir()
    ran = subprocess.run(
        [
            "unshare",
            "-Urm",
            "sh",
            "-c",
            ON_A_SMALL_DISK,
            "sh",
            tmp_path,
            sys.executable,
            HERE / "sheets_main.py",
        ],
        env=environment_of(),
        capture_output=True,
        text=True,
        timeout=SECONDS,
    )
    assert ran.stdout == "exit code 2\n", ran.stderr
    assert "No space left on device); make room" in ran.stderr
    out = tmp_path / "data"
    before = stored(out)
    assert 0 < before < 9
    assert verify(out, workers=1).passed
    report = make(out)
    assert (len(report.made), len(report.kept)) == (9 - before, before)
    assert contents(out) == undisturbed


@pytest.mark.parametrize("damage", [flip_bit, truncate])
def test_damage_is_found_and_repaired(undisturbed: Contents, tmp_path: Path, damage: object) -> None:
    out = tmp_path / "data"
    make(out)
    chosen = store.stored_ids(open_root(out))[4]
    damage(store.sample_file(out, chosen), random.Random(2))  # type: ignore[operator]
    assert list(verify(out, workers=1).failed) == [chosen]
    report = mend(out)
    assert (list(report.damaged), report.made) == ([chosen], (chosen,))
    assert contents(out) == undisturbed


def test_the_second_of_two_runs_is_told(undisturbed: Contents, tmp_path: Path) -> None:
    out, hold = tmp_path / "data", tmp_path / "hold"
    hold.touch()
    first = start(out, {"FAULT_HOLD": str(hold)}, workers=1)
    wait_until(lambda: stored(out), "a sample")
    second = start(out, workers=1)
    _, said = second.communicate(timeout=SECONDS)
    assert second.returncode == 2
    assert "another process is writing here; wait for its end" in said
    hold.unlink()
    made, said = first.communicate(timeout=SECONDS)
    assert (made, said.count("Error")) == ("9 0 0\n", 0)
    assert contents(out) == undisturbed
