"""A dask scheduler and its workers, as processes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from benchmarks.faults import descendants, send, wait_until


class DaskProcesses:
    """Processes of dask on this machine, each told where the others are by a file."""

    def __init__(self, folder: Path, environment: Mapping[str, str]) -> None:
        self.folder, self.environment = folder, environment
        self.begun: list[subprocess.Popen[bytes]] = []

    def scheduler(self) -> tuple[str, subprocess.Popen[bytes]]:
        """Start a scheduler; its address."""
        file = self._file
        file.unlink(missing_ok=True)
        process = self._start("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        wait_until(lambda: file.exists() and file.read_text().strip(), "the scheduler")
        return json.loads(file.read_text())["address"], process

    def worker(self) -> subprocess.Popen[bytes]:
        """Start a worker of the last scheduler, with its nanny; returns that."""
        return self._start(
            "dask_worker", "--nthreads", "1", "--no-dashboard", "--local-directory", self.folder
        )

    @property
    def _file(self) -> Path:
        return self.folder / "scheduler.json"

    def _start(self, name: str, *arguments: str | Path) -> subprocess.Popen[bytes]:
        command = [
            sys.executable,
            "-m",
            f"distributed.cli.{name}",
            "--scheduler-file",
            self._file,
            *arguments,
        ]
        with (self.folder / f"{name}.log").open("ab") as log:
            process = subprocess.Popen(command, env=self.environment, cwd=self.folder, stdout=log, stderr=log)
        self.begun.append(process)
        return process

    def end(self) -> None:
        """Kill whatever of them still runs."""
        for process in self.begun:
            for pid in descendants(process.pid):
                send(pid, signal.SIGKILL)
            process.kill()
            process.wait()


@contextmanager
def dask_processes(folder: Path, environment: Mapping[str, str] = os.environ) -> Iterator[DaskProcesses]:
    """Processes of dask, none of which survives the block."""
    folder.mkdir(parents=True, exist_ok=True)
    processes = DaskProcesses(folder, environment)
    try:
        yield processes
    finally:
        processes.end()
