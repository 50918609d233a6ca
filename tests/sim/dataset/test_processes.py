"""Pools of processes, in processes of their own: what hangs is then seen."""

import subprocess
import sys

import pytest

BEGIN = """
import os, signal
from muslin.sim.dataset.processes import in_processes
if __name__ == "__main__":
"""


def ran(code: str, folder) -> subprocess.CompletedProcess[str]:
    script = folder / "script.py"
    script.write_text(BEGIN + code, encoding="utf-8")
    return subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=60, check=False)


@pytest.mark.parametrize("chunk", [1, 7])
def test_results_come_in_the_order_of_the_tasks(chunk: int, tmp_path) -> None:
    done = ran(f"    print(list(in_processes(abs, list(range(-20, 0)), 2, chunk={chunk})))", tmp_path)
    assert done.stdout.split("]")[0] == str(list(range(20, 0, -1))).rstrip("]"), done.stderr


@pytest.mark.parametrize("attempt", range(3))
def test_a_process_that_dies_over_one_of_many_tasks_is_told_and_nothing_hangs(attempt: int, tmp_path) -> None:
    done = ran("    list(in_processes(os._exit, [7] * 20000, 2))", tmp_path)
    assert done.returncode == 1
    assert done.stderr.rstrip().endswith("run again with fewer --workers than 2")
    assert "Exception in thread" not in done.stderr


def test_an_error_of_a_task_is_raised_and_the_rest_is_left(tmp_path) -> None:
    done = ran("    list(in_processes(os.stat, ['/', '/no such file'] + ['/'] * 5000, 2))", tmp_path)
    assert done.returncode == 1
    assert "FileNotFoundError" in done.stderr


def test_with_one_worker_there_is_no_pool(tmp_path) -> None:
    done = ran("    print(set(in_processes(lambda _: os.getpid(), [1, 2, 3], 1)) == {os.getpid()})", tmp_path)
    assert done.stdout == "True\n"
