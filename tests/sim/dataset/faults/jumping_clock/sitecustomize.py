"""A wall clock that is wrong by as many seconds as a file says; clocks that only go forward are right."""

import os
import time

_time, _time_ns, _monotonic = time.time, time.time_ns, time.monotonic
_looked, _wrong = 0.0, 0.0


def _error() -> float:
    global _looked, _wrong
    if _monotonic() - _looked > 0.02:
        _looked = _monotonic()
        with open(os.environ["FAULT_CLOCK"]) as stream:
            _wrong = float(stream.read() or _wrong)
    return _wrong


time.time = lambda: _time() + _error()
time.time_ns = lambda: _time_ns() + int(_error() * 1e9)
