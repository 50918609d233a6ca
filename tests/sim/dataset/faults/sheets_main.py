"""`python sheets_main.py OUT '{"workers": 1, "lease": [0.2, 2.0]}'`: make the sheets there.

Prints how many samples were made, kept and failed; exit code 2, and why, if that cannot be. The second
argument: what a `Cluster` is made of, and `lease`, seconds between beats, and after which a holder is dead.
"""

import json
import signal
import sys
from functools import partial

if __name__ == "__main__":
    # What a shell starts in the background ignores interrupts, and so would this process.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    # Inside, so that the workers, which import this file too, start without it.
    from sheets import make

    from muslin.garments.errors import InputError
    from muslin.sim.dataset import remote_root
    from muslin.sim.dataset.engine import Cluster

    out, how = sys.argv[1], json.loads(sys.argv[2])
    if "lease" in how:
        beat, dead = how.pop("lease")
        remote_root.hold_lease = partial(remote_root.hold_lease, beat=beat, dead=dead)
    try:
        report = make(out, cluster=Cluster(**how))
    except InputError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
    print(len(report.made), len(report.kept), len(report.failed), flush=True)
