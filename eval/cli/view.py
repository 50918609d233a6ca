"""`muslin view`: look at a sample in a window."""

from __future__ import annotations

from muslin.eval.cli.options import DatasetPlace, SampleId
from muslin.garments.errors import InputError


def view(dataset: DatasetPlace, sample_id: SampleId = None) -> None:
    """Open a window with a sample (the first, unless told): turn it with the mouse, slide through its frames.

    \b
    Examples:
      muslin view out/demo
      muslin view out/demo --sample ID
    """
    from muslin.sim.dataset.reader import open_dataset
    from muslin.sim.view.window import require_display, show

    data = open_dataset(dataset)
    if not len(data):
        raise InputError(f"{dataset}: the dataset holds no sample; run `muslin generate` first")
    require_display()
    show(data[sample_id or 0])
