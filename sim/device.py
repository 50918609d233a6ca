"""The device that kernels run on."""

from __future__ import annotations

import warp as wp

from muslin.garments.errors import InputError


def open_device(name: str) -> None:
    """Start Warp without its banner and its line for every loaded module; its warnings stay.

    Raises InputError unless `name` is a device of this machine.
    """
    # While it starts, Warp warns of every machine without a CUDA driver; the check below says what counts.
    wp.config.log_level = wp.LOG_ERROR
    names = [str(device) for device in wp.get_devices()]
    wp.config.log_level = wp.LOG_WARNING
    if name not in names:
        raise InputError(f"device {name!r}: not available here; choose one of {', '.join(names)}")
