"""Devices: a machine without a GPU starts in silence, and a device that is not there is named."""

import subprocess
import sys

import pytest

from muslin.garments.errors import InputError
from muslin.sim.device import open_device


def test_warp_starts_without_a_word():
    code = "from muslin.sim.device import open_device as start; start('cpu'); raise SystemExit('on')"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (answer.stdout, answer.stderr) == ("", "on\n")


def test_a_device_that_is_not_there_is_refused():
    with pytest.raises(InputError, match=r"device 'cuda:99': not available here; choose one of cpu"):
        open_device("cuda:99")
