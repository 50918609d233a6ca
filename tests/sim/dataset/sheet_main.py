"""Generate the dataset of the SIGKILL test: `python sheet_main.py OUT WORKERS`."""

import signal
import sys

if __name__ == "__main__":
    # What a shell starts in the background ignores interrupts, and so would this process.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    # Inside, so that the workers, which import this file too, start without it.
    from sheet_producer import make_scene, sheets_config, simulate

    from muslin.sim.dataset.generate import generate

    out, workers = sys.argv[1], int(sys.argv[2])
    report = generate(
        sheets_config(),
        out,
        workers=workers,
        simulate=simulate,
        make_scene=make_scene,
    )
    print(len(report.made), len(report.kept), len(report.failed), flush=True)
