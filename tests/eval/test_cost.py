"""Cost of a method: times, memory, parameters, sizes, and the file that keeps them."""

import json
import subprocess
import sys
import time

import numpy as np
import pytest

from muslin.eval.cost import (
    COST_FILE,
    Cost,
    cost_of,
    count_parameters,
    folder_bytes,
    measure,
    read_cost,
    write_cost,
)
from muslin.eval.memory import INTERVAL, PeakMemory, family
from muslin.garments.errors import InputError

MB = 1_000_000


def test_times_of_known_length():
    calls = []
    timing = measure(lambda: time.sleep(0.05), lambda i: (calls.append(i), time.sleep(0.01)), 5, warm_up=7)
    assert calls == [0, 1, 2, 3, 4, 0, 1, 0, 1, 2, 3, 4]
    assert timing.repeats == 5
    assert 10.0 <= timing.quartiles[0] <= timing.median <= timing.quartiles[1] < 40.0
    assert 50.0 <= timing.preprocessing < 200.0
    # Sleeping takes no processor time.
    assert timing.process_median < 5.0
    assert timing.preprocessing_process < 25.0


def test_processor_time_of_work():
    def work(_: int) -> None:
        until = time.process_time() + 0.02
        while time.process_time() < until:
            pass

    timing = measure(lambda: None, work, 3, warm_up=0)
    assert 20.0 <= timing.process_median < 25.0
    assert timing.median >= 0.99 * timing.process_median


def test_peak_memory_of_process_and_children():
    with PeakMemory() as nothing:
        pass
    with PeakMemory() as array:
        held = np.ones(10 * MB)  # 80 MB, freed before the end
        time.sleep(20 * INTERVAL)  # a process that once had more is only sampled
        del held
    assert array.peak - nothing.peak > 60 * MB
    script = "import time; held = bytearray(b'x') * 150_000_000; time.sleep(0.3)"
    with PeakMemory() as child:
        process = subprocess.Popen([sys.executable, "-c", script])
        assert process.pid in family(process.pid)
        process.wait()
    assert child.peak - nothing.peak > 140 * MB


def test_parameters_of_arrays_and_modules():
    class Tensor:
        def numel(self) -> int:
            return 5

    shared = Tensor()

    class Module:
        def parameters(self):
            return iter([shared, Tensor(), shared])

    assert count_parameters(Module()) == 10
    arrays = {"w": np.zeros((3, 4)), "layers": [np.zeros(7), (np.float64(1.0), shared)]}
    assert count_parameters(arrays) == 12 + 7 + 1 + 5
    assert count_parameters([]) == 0
    for bad in ("weights.pt", None, 3):
        with pytest.raises(InputError, match="cannot count the parameters of a"):
            count_parameters(bad)


def test_parameters_of_torch():
    torch = pytest.importorskip("torch")
    model = torch.nn.Sequential(torch.nn.Linear(3, 4), torch.nn.Linear(4, 2))
    assert count_parameters(model) == 3 * 4 + 4 + 4 * 2 + 2
    assert count_parameters(model.state_dict()) == count_parameters(model)


def test_size_of_files(tmp_path):
    (tmp_path / "part").mkdir()
    (tmp_path / "part" / "a.bin").write_bytes(b"x" * 1000)
    (tmp_path / "b.bin").write_bytes(b"x" * 24)
    (tmp_path / "c.bin").hardlink_to(tmp_path / "b.bin")
    assert folder_bytes(tmp_path) == 1024
    assert folder_bytes(tmp_path / "b.bin") == 24
    with pytest.raises(InputError, match="does not exist"):
        folder_bytes(tmp_path / "none")


def test_file_keeps_what_was_written(tmp_path):
    timing = measure(lambda: None, lambda i: None, 4)
    cost = cost_of(timing, model={"w": np.zeros(10)}, folder=__file__, device="one core")
    assert (cost.parameters, cost.repeats, cost.device) == (10, 4, "one core")
    assert cost.milliseconds_per_frame == timing.median
    write_cost(cost, tmp_path)
    assert read_cost(tmp_path) == cost
    assert set(json.loads((tmp_path / COST_FILE).read_text())) == {
        "milliseconds_per_frame",
        "milliseconds_preprocessing",
        "peak_memory_bytes",
        "parameters",
        "file_bytes",
        "device",
        "repeats",
    }
    write_cost(Cost(parameters=3), tmp_path)
    assert read_cost(tmp_path) == Cost(parameters=3)
    assert read_cost(tmp_path / "none") is None


def test_preprocessing_shared_among_frames():
    cost = Cost(milliseconds_per_frame=4.0, milliseconds_preprocessing=600.0)
    assert cost.milliseconds_with_preprocessing(120) == 9.0
    assert Cost(milliseconds_per_frame=4.0).milliseconds_with_preprocessing(120) is None
    with pytest.raises(InputError, match="frames = 0"):
        cost.milliseconds_with_preprocessing(0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "not JSON"),
        ("[1]", "a list; give an object"),
        ('{"milliseconds": 3}', "unknown key 'milliseconds'"),
        ('{"milliseconds_per_frame": "3"}', "give a number"),
        ('{"milliseconds_per_frame": true}', "give a number"),
        ('{"milliseconds_per_frame": NaN}', "must be finite"),
        ('{"milliseconds_per_frame": -1}', "not negative"),
        ('{"parameters": 1.5}', "whole number"),
        ('{"device": 3}', "name the device"),
    ],
)
def test_bad_files_are_named(tmp_path, text, message):
    (tmp_path / COST_FILE).write_text(text)
    with pytest.raises(InputError, match=message):
        read_cost(tmp_path)


def test_bad_use_is_named(tmp_path):
    with pytest.raises(InputError, match="frames = 0"):
        measure(lambda: None, lambda i: None, 0)
    with pytest.raises(InputError, match="is no folder"):
        write_cost(Cost(), tmp_path / "none")
    with pytest.raises(InputError, match="finite"):
        write_cost(Cost(milliseconds_per_frame=float("inf")), tmp_path)
    assert not (tmp_path / COST_FILE).exists()
