"""A dataset of real drapes made while everything goes wrong, against the same dataset made in peace."""

from __future__ import annotations

import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path

from benchmarks.dask_processes import dask_processes
from benchmarks.faults import (
    alive,
    contents,
    descendants,
    flip_bit,
    send,
    table,
    truncate,
    wait_until,
    workers_of,
)
from muslin.sim.dataset import store
from muslin.sim.dataset.header import read_header
from muslin.sim.dataset.root import open_root
from muslin.sim.dataset.schema import HEADER, INDEX, PARTIAL, SAMPLES

MUSLIN_COMMAND = Path(sys.executable).with_name("muslin")
CHAIN, SEQUENCES = 12, 8
CONFIG = """\
name = "soak"
chain = {chain}
[scene]
fabric = "gray-interlock"
garment = {{ edge_length = 0.06 }}
body = {{ model = "female" }}
[[designs]]
name = "top"
preset = "top"
[[shapes]]
name = "s"
sweep = {{ component = 0, start = -1.5, stop = 1.5, count = {shapes} }}
[[sequences]]
name = "walk"
clip = "walk"
end = 0.1
shapes = {among}
"""

RUNNING = (
    "worker SIGKILL",
    "client SIGKILL",
    "worker SIGTERM",
    "client SIGINT",
    "scheduler SIGKILL",
    "client SIGTERM",
    "second generator",
)
"""Faults of the processes of a run."""
RESTING = ("bit flipped", "sample truncated", "index deleted", "index damaged", "half-written file")
"""Faults of the files, whether a run goes on or not."""
_ENDS = {
    "client SIGINT": {130, 1, -signal.SIGINT},
    "client SIGTERM": {143, -signal.SIGTERM},
    "client SIGKILL": {-signal.SIGKILL},
    "scheduler SIGKILL": {2},
}
"""Exit codes; the later ones are of processes that have not begun yet."""
_BY_THEMSELVES = {0, 1, 2, 3}
"""Exit codes of runs that end by themselves, having made all, or met damage."""
_PATIENCE_S = 1800.0


@dataclass(frozen=True)
class Soak:
    """faults: {kind: how many}; runs: of `generate` and `repair`; seconds: of the clock."""

    samples: int
    faults: dict[str, int]
    runs: int
    lost: int
    duplicated: int
    different: int
    other_rows: int
    peaceful_s: float
    disturbed_s: float

    @property
    def passed(self) -> bool:
        return not (self.lost or self.duplicated or self.different or self.other_rows)

    def table(self) -> str:
        """Markdown."""
        lines = ["| fault | times |", "| --- | --- |"]
        lines += [f"| {kind} | {times} |" for kind, times in self.faults.items()]
        lines += [f"| all | {sum(self.faults.values())} |", ""]
        lines += ["| samples | lost | duplicated | different | other rows in the index |", "| --- " * 5 + "|"]
        counts = (self.samples, self.lost, self.duplicated, self.different, self.other_rows)
        lines += ["| " + " | ".join(str(count) for count in counts) + " |", ""]
        lines.append(
            f"{self.peaceful_s:.0f} s in peace, {self.disturbed_s:.0f} s and {self.runs} runs amid faults"
        )
        return "\n".join(lines) + "\n"


def soak(out: Path, samples: int, faults: int, seed: int, tell: Callable[[str], None]) -> Soak:
    """Make the dataset twice, the second time with so many faults at least, and compare."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    shapes = max(2, samples - SEQUENCES)
    among = [f"s-{n:03d}" for n in range(0, shapes, -(-shapes // SEQUENCES))]
    config = out / "soak.toml"
    config.write_text(CONFIG.format(chain=CHAIN, shapes=shapes, among=among), encoding="utf-8")
    peaceful, disturbed = _Run(out, config, "peaceful"), _Run(out, config, "disturbed")
    begun = time.monotonic()
    peaceful.complete()
    middle = time.monotonic()
    tell(f"made in peace in {middle - begun:.0f} s")
    trouble = _Trouble(disturbed, random.Random(seed), tell)
    trouble.make(faults)
    disturbed.complete()
    end = time.monotonic()
    wanted, found = contents(peaceful.data), contents(disturbed.data)
    names = open_root(disturbed.data).names(SAMPLES)
    listed = Counter(row["id"] for row in table(disturbed.data))
    return Soak(
        samples=len(wanted),
        faults=dict(sorted(trouble.made.items())),
        runs=disturbed.runs,
        lost=len(wanted.keys() - found.keys()),
        duplicated=len(names)
        - len(wanted.keys() & found.keys())
        + sum(times - 1 for times in listed.values()),
        different=sum(wanted[i] != found[i] for i in wanted.keys() & found.keys()),
        other_rows=int(table(peaceful.data) != table(disturbed.data)),
        peaceful_s=middle - begun,
        disturbed_s=end - middle,
    )


class _Run:
    """The commands over one dataset."""

    def __init__(self, out: Path, config: Path, name: str) -> None:
        self.out, self.config, self.data = out, config, out / name
        self.log = out / f"{name}.log"
        self.runs = 0

    def generate(self, *more: str) -> subprocess.Popen[bytes]:
        return self._start("generate", self.config, "--out", self.data, "--retry", *more)

    def repair(self, *more: str) -> subprocess.Popen[bytes]:
        return self._start("repair", self.data, *more)

    def complete(self) -> None:
        """Generate and repair until all is there and well."""
        for _ in range(3):
            made = self.generate("--workers", "2").wait(_PATIENCE_S)
            if made == 0 and self.repair("--workers", "2").wait(_PATIENCE_S) == 0:
                return
        raise RuntimeError(f"{self.data}: does not come to an end; see {self.log}")

    def stored(self) -> list[str]:
        return store.stored_ids(open_root(self.data))

    def planned(self) -> bool:
        """Whether a run has come far enough to write the header."""
        return (self.data / HEADER).exists()

    def _start(self, *arguments: str | Path) -> subprocess.Popen[bytes]:
        self.runs += 1
        with self.log.open("ab") as log:
            log.write(f"\n== {' '.join(map(str, arguments))}\n".encode())
            log.flush()
            return subprocess.Popen(
                [MUSLIN_COMMAND, *arguments],
                stdout=log,
                stderr=log,
                # What a shell starts in the background ignores interrupts.
                preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
            )


class _Trouble:
    """Faults in an order drawn from a seed, and the run that they befall."""

    def __init__(self, run: _Run, draw: random.Random, tell: Callable[[str], None]) -> None:
        self.run, self.draw, self.tell = run, draw, tell
        self.made: Counter[str] = Counter()
        self.process: subprocess.Popen[bytes] | None = None
        self.damaged = self.repairing = False
        self.before: list[str] = []

    def make(self, count: int) -> None:
        """All faults, spread over the making of the dataset: the n-th comes when n / count of it is there."""
        kinds = [(RUNNING + RESTING)[n % len(RUNNING + RESTING)] for n in range(count)]
        self.draw.shuffle(kinds)
        for number, kind in enumerate(kinds):
            begun = time.monotonic()
            self._come_to(number / count)
            if kind in RESTING:
                self._rest(kind)
            elif kind == "scheduler SIGKILL":
                self._scheduler()
            else:
                self._running(kind)
            self.made[kind] += 1
            self.tell(
                f"{sum(self.made.values())}: {kind}, after {time.monotonic() - begun:.0f} s; "
                f"{len(self.run.stored())} samples"
            )
        self._stop()

    def _come_to(self, share: float) -> None:
        """Let runs go on until such a share of the samples is there, or all that can be without a repair."""
        while not self.run.planned() or len(self.run.stored()) < share * planned(self.run.data):
            if self.complete():
                return
            self.before = self.run.stored()
            self._until(self._going(), lambda _: self.run.stored() != self.before, "another sample")

    def _rest(self, kind: str) -> None:
        wait_until(self._some_stored, "the first samples", _PATIENCE_S)
        chosen = self.draw.choice(self.run.stored())
        file = store.sample_file(self.run.data, chosen)
        if kind == "bit flipped":
            flip_bit(file, self.draw)
            self.damaged = True
        elif kind == "sample truncated":
            truncate(file, self.draw)
            self.damaged = True
        elif kind == "index deleted":
            (self.run.data / INDEX).unlink(missing_ok=True)
        elif kind == "index damaged":
            (self.run.data / INDEX).write_bytes(self.draw.randbytes(1000))
        else:
            partial = self.run.data / PARTIAL
            (partial / f"{SAMPLES}-{chosen}.zarr.zip.1").write_bytes(self.draw.randbytes(1000))

    def _some_stored(self) -> bool:
        if not self.run.stored():
            self._going()
        return bool(self.run.stored())

    def _running(self, kind: str) -> None:
        while True:
            process = self._going()
            if kind in _ENDS and self.draw.random() < 0.3:
                time.sleep(self.draw.uniform(0.2, 8.0))  # while it starts, perhaps
            else:
                self._until(process, lambda pid: bool(workers_of(pid)), "workers")
                time.sleep(self.draw.uniform(0.0, 6.0))
            if process.poll() is None and self._befall(kind, process):
                return

    def _befall(self, kind: str, process: subprocess.Popen[bytes]) -> bool:
        """Do it. False if the run was over before."""
        if kind == "second generator":
            return self._second(process)
        target, name = kind.split()
        number = getattr(signal, name)
        if target == "worker":
            found = workers_of(process.pid)
            return bool(found) and send(self.draw.choice(found), number)
        others = descendants(process.pid)
        process.send_signal(number)
        self._ended(process, _ENDS[kind])
        wait_until(lambda: not any(map(alive, others)), "the processes of a run that was ended", 60.0)
        return True

    def _second(self, first: subprocess.Popen[bytes]) -> bool:
        """Whether one of two generators is told of the other, which goes on."""
        second = self.run.generate("--workers", "2")
        both = (first, second)
        wait_until(lambda: any(one.poll() is not None for one in both), "an end of one of two", _PATIENCE_S)
        self.process = second if first.poll() is not None else first
        ended = first if self.process is second else second
        self.tell(f"   exit code {ended.returncode}")
        if self.process is second:
            self.repairing = False
        return ended.returncode == 2

    def _scheduler(self) -> None:
        self._stop()
        while True:
            with dask_processes(self.run.out / "dask") as dask:
                address, scheduler = dask.scheduler()
                dask.worker()
                dask.worker()
                process = self.process = self._start("--scheduler", address)
                self.before = self.run.stored()
                self._until(process, lambda pid: self.run.stored() != self.before, "a sample")
                time.sleep(self.draw.uniform(0.0, 3.0))
                over = process.poll() is not None
                scheduler.kill()
                self._ended(process, _ENDS["scheduler SIGKILL"])
            if not over:
                return

    def _until(self, process: subprocess.Popen[bytes], met: Callable[[int], bool], what: str) -> None:
        """Wait until something is so of a run, or the run is over."""
        wait_until(lambda: met(process.pid) or process.poll() is not None, what, _PATIENCE_S)

    def _going(self) -> subprocess.Popen[bytes]:
        """The run that goes on, or a new one that has something to do."""
        if self.process is not None and self.process.poll() is not None:
            self._ended(self.process)
        if self.process is None:
            self.process = self._start("--workers", "2")
        return self.process

    def _start(self, *how: str) -> subprocess.Popen[bytes]:
        if not self.damaged and self.complete():
            self._rest("bit flipped")
            self.made["bit flipped"] += 1
        self.repairing = self.damaged
        return self.run.repair(*how) if self.damaged else self.run.generate(*how)

    def complete(self) -> bool:
        """Whether no sample is missing."""
        return self.run.planned() and not missing(self.run.data)

    def _ended(self, process: subprocess.Popen[bytes], expected: Collection[int] = ()) -> None:
        code = process.wait(_PATIENCE_S)
        self.process = None
        self.tell(f"   exit code {code}")
        if self.repairing and code == 0:
            self.damaged = False
        if code == 2 and 2 not in expected:
            self.damaged = True  # it met damage that only `repair` mends
        if code not in _BY_THEMSELVES.union(expected):
            raise RuntimeError(f"exit code {code}, not {expected}; see {self.run.log}")

    def _stop(self) -> None:
        if self.process is not None and self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            self._ended(self.process, _ENDS["client SIGTERM"])
            self.made["client SIGTERM"] += 1
        self.process = None


def planned(data: Path) -> int:
    """Number of samples that a dataset shall have."""
    return len(read_header(open_root(data)).splits)


def missing(data: Path) -> bool:
    """Whether a dataset lacks any planned sample."""
    root = open_root(data)
    return bool(read_header(root).splits.keys() - set(store.stored_ids(root)))
