"""One thread a process, no display, no waiting for disks, the same random examples; `gpu` tests with one."""

import os

# Before anything imports numpy: its BLAS reads these once.
for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"
os.environ["MPLBACKEND"] = "Agg"
os.environ["PYVISTA_OFF_SCREEN"] = "true"
# Thousands of files are made here that no power failure need survive, and other machines share the disk.
os.environ.setdefault("MUSLIN_NO_SYNC", "1")

import pytest
from hypothesis import settings

# A shared machine may stall any one example for longer than a deadline.
settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip the tests marked `gpu` where Warp finds no CUDA device."""
    needing_gpu = [item for item in items if item.get_closest_marker("gpu")]
    if not needing_gpu:
        return
    import warp as wp

    if wp.get_cuda_device_count() == 0:
        for item in needing_gpu:
            item.add_marker(pytest.mark.skip(reason="Warp finds no CUDA device"))
