"""`muslin`, of which `generate` makes sheets: the command itself, with another simulator."""

import signal
from functools import partial

if __name__ == "__main__":
    # What a shell starts in the background ignores interrupts, and so would this process.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    # Inside, so that the workers, which import this file too, start without it.
    from faulty_producer import simulate
    from sheet_producer import make_scene

    from muslin.eval.cli.app import main
    from muslin.sim.dataset import generate

    generate.generate = partial(generate.generate, simulate=simulate, make_scene=make_scene)
    main()
