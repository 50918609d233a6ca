"""A clock that jumps forth and back while samples are made, in every process."""

from __future__ import annotations

from pathlib import Path

from sheets import HERE, SECONDS, start, stored

from benchmarks.faults import Contents, contents, wait_until

HOUR = 3600.0


def test_jumps_of_the_clock_change_nothing(undisturbed: Contents, tmp_path: Path) -> None:
    clock, hold, out = tmp_path / "clock", tmp_path / "hold", tmp_path / "data"
    clock.write_text("0")
    hold.touch()
    environment = {"FAULT_CLOCK": str(clock), "FAULT_HOLD": str(hold), "FAULT_DELAY": "0.2"}
    run = start(out, environment, before=HERE / "jumping_clock", workers=2)
    for count, wrong in ((1, HOUR), (3, 0.0), (5, -HOUR), (6, HOUR), (7, -HOUR)):
        wait_until(lambda: stored(out) >= count, f"{count} samples")  # noqa: B023
        clock.write_text(str(wrong))
    hold.unlink()
    made, said = run.communicate(timeout=SECONDS)
    assert made == "9 0 0\n", said
    assert contents(out) == undisturbed
