"""The command itself is killed, interrupted or asked to end, with workers of its own."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

from sheets import HERE, SECONDS, environment_of, stored

from benchmarks.faults import Contents, alive, contents, descendants, wait_until
from muslin.sim.dataset.schema import PARTIAL

CONFIG = """\
name = "sheets"
chain = 4
[[shapes]]
name = "s"
sweep = { component = 0, start = -1.0, stop = 1.0, count = 8 }
[[sequences]]
clip = "wave"
end = 1.0
[splits.test]
shapes = ["s-003"]
sequences = ["wave"]
"""


def command(folder: Path, **environment: str) -> subprocess.Popen[str]:
    """`muslin generate` of the sheets, by two workers, as a process."""
    config = folder / "sheets.toml"
    config.write_text(CONFIG)
    return subprocess.Popen(
        [
            sys.executable,
            HERE / "sheets_cli.py",
            "generate",
            config,
            "--out",
            folder / "data",
            "--workers",
            "2",
        ],
        env=environment_of(environment),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_an_ended_command_leaves_no_process_and_goes_on(undisturbed: Contents, tmp_path: Path) -> None:
    out, hold = tmp_path / "data", tmp_path / "hold"
    hold.touch()
    for number, code in ((signal.SIGKILL, -9), (signal.SIGTERM, 143), (signal.SIGINT, 130)):
        before = stored(out)
        run = command(tmp_path, FAULT_HOLD=str(hold), FAULT_DELAY="0.1")
        # Two samples are held, so that no run can end by itself.
        wait_until(lambda: stored(out) >= min(7, before + 1) and descendants(run.pid), "a sample")  # noqa: B023
        others = descendants(run.pid)
        run.send_signal(number)
        _, said = run.communicate(timeout=SECONDS)
        assert run.returncode == code, said
        assert code < 0 or "what was finished is kept; run again to go on" in said
        wait_until(lambda: not any(map(alive, others)), "the workers to end", 30.0)  # noqa: B023
    hold.unlink()
    run = command(tmp_path)
    said, errors = run.communicate(timeout=SECONDS)
    assert run.returncode == 0, errors
    assert contents(out) == undisturbed
    assert not list((out / PARTIAL).iterdir())
