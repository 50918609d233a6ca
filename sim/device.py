"""The device that kernels run on."""

from __future__ import annotations

import os

import warp as wp

from muslin.garments.errors import InputError


def open_device(name: str) -> None:
    """Start Warp without its banner and its line for every loaded module; its warnings stay.

    Raises InputError unless `name` is a device of this machine.
    """
    wp.config.log_level = wp.LOG_WARNING
    _start()
    names = [str(device) for device in wp.get_devices()]
    if name not in names:
        raise InputError(f"device {name!r}: not available here; choose one of {', '.join(names)}")


def _start() -> None:
    """Start Warp, without the line that its native part writes on every machine that has no CUDA driver.

    Errors of the start are exceptions; a device that is missing is told by `open_device`.
    """
    kept = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        wp.init()
    finally:
        os.dup2(kept, 2)
        os.close(nowhere)
        os.close(kept)
