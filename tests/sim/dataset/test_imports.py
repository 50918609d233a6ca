"""Reading, checking and exporting a dataset needs no simulator."""

from __future__ import annotations

import subprocess
import sys


def test_no_warp_and_no_torch() -> None:
    code = (
        "import importlib, pkgutil, sys, muslin.sim.dataset as package\n"
        "for entry in pkgutil.iter_modules(package.__path__):\n"
        "    importlib.import_module(f'{package.__name__}.{entry.name}')\n"
        "print(sorted({'warp', 'torch', 'pxr', 'muslin.sim.run'} & sys.modules.keys()))"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "[]"
