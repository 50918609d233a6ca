"""Contact sheets: pictures side by side, with captions."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from muslin.garments.errors import InputError

DARK = (52, 52, 56)
CAPTION_HEIGHT = 24
GAP = 4


@cache
def font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """Pillow's own typeface: no font of the system is needed."""
    return ImageFont.load_default(size)


def captioned(picture: np.ndarray, caption: str) -> np.ndarray:
    """The picture below a strip, in the colour of its upper left corner, that holds a line of text."""
    height, width = picture.shape[:2]
    canvas = Image.new("RGB", (width, height + CAPTION_HEIGHT), tuple(int(c) for c in picture[0, 0]))
    canvas.paste(Image.fromarray(picture), (0, CAPTION_HEIGHT))
    place = (width / 2, CAPTION_HEIGHT / 2 + 1)
    ImageDraw.Draw(canvas).text(place, caption, fill=DARK, font=font(14), anchor="mm")
    return np.asarray(canvas)


def contact_sheet(
    pictures: Sequence[np.ndarray], columns: int, captions: Sequence[str] | None = None
) -> np.ndarray:
    """Pictures of one size in rows of `columns`; (height, width, 3) uint8."""
    if not pictures or columns < 1 or len({p.shape for p in pictures}) != 1:
        raise InputError("contact sheet: give one picture or more, all of one size, and at least one column")
    if captions is not None:
        pictures = [captioned(p, c) for p, c in zip(pictures, captions, strict=True)]
    height, width = pictures[0].shape[:2]
    columns = min(columns, len(pictures))
    rows = -(-len(pictures) // columns)
    sheet = np.full(
        (rows * height + (rows - 1) * GAP, columns * width + (columns - 1) * GAP, 3), 255, dtype=np.uint8
    )
    for i, picture in enumerate(pictures):
        y, x = (i // columns) * (height + GAP), (i % columns) * (width + GAP)
        sheet[y : y + height, x : x + width] = picture
    return sheet
