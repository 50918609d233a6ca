"""Kernels compiled once a machine, however many processes start together."""

from __future__ import annotations

import fcntl
from pathlib import Path

import warp as wp

from muslin.sim.dataset.header import digest
from muslin.sim.dataset.solver import solver_digest
from muslin.sim.device import open_device


def compile_once(device: str = "cpu") -> None:
    """Compile all kernels for `device` into Warp's cache, unless a process of the same code has done so.

    Of several processes one compiles and the others wait. Loading them is left to their first use.
    """
    open_device(device)
    folder = Path(wp.config.kernel_cache_dir)
    folder.mkdir(parents=True, exist_ok=True)
    done = folder / f"muslin-{digest([solver_digest(), wp.config.version, device])[:16]}.compiled"
    with (folder / "muslin.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not done.exists():
            # Loaded only where it is needed: the client of a cluster simulates nothing itself.
            from muslin.sim.run import compile_kernels

            compile_kernels(device)
            done.touch()
