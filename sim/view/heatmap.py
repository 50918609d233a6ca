"""Numbers on a garment as colours, with a bar that tells their size."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

from muslin.garments.errors import InputError
from muslin.sim.view.sheet import DARK, font

# viridis (van der Walt and Smith 2015, public domain) at 9 equal steps
STOPS = (
    np.array(
        [
            [68, 1, 84],
            [71, 44, 122],
            [59, 81, 139],
            [44, 113, 142],
            [33, 144, 141],
            [39, 173, 129],
            [92, 200, 99],
            [170, 220, 50],
            [253, 231, 37],
        ]
    )
    / 255.0
)
BAR_WIDTH = 14
BAR_SPACE = 74


def colours(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """Viridis colours (V, 3) in [0, 1] of values (V,); at or below `low` dark, at or above `high` bright.

    Raises InputError for NaN or an empty range.
    """
    if not np.isfinite(values).all() or not (np.isfinite([low, high]).all() and low < high):
        raise InputError(f"heat map: values must be finite and the range [{low}, {high}] must not be empty")
    t = np.clip((values - low) / (high - low), 0.0, 1.0) * (len(STOPS) - 1)
    i = np.minimum(t.astype(int), len(STOPS) - 2)
    return STOPS[i] + (t - i)[:, None] * (STOPS[i + 1] - STOPS[i])


def with_bar(picture: np.ndarray, low: float, high: float, title: str) -> np.ndarray:
    """The picture with a colour bar, from `low` to `high` in the unit that `title` names, to its right."""
    height, width = picture.shape[:2]
    canvas = Image.new("RGB", (width + BAR_SPACE, height), (246, 245, 243))
    canvas.paste(Image.fromarray(picture), (0, 0))
    top, bottom = int(0.14 * height), int(0.9 * height)
    ramp = colours(np.linspace(high, low, bottom - top), low, high)
    bar = np.repeat(np.rint(255 * ramp).astype(np.uint8)[:, None], BAR_WIDTH, axis=1)
    canvas.paste(Image.fromarray(bar), (width + 8, top))
    draw = ImageDraw.Draw(canvas)
    draw.text((width + BAR_SPACE / 2, top - 18), title, fill=DARK, font=font(13), anchor="mm")
    for t in (0.0, 0.25, 0.5, 0.75, 1.0):
        y = bottom - t * (bottom - top)
        label = f"{low + t * (high - low):.3g}"
        draw.line([(width + 8 + BAR_WIDTH, y), (width + 12 + BAR_WIDTH, y)], fill=DARK)
        draw.text((width + 15 + BAR_WIDTH, y), label, fill=DARK, font=font(12), anchor="lm")
    return np.asarray(canvas)
