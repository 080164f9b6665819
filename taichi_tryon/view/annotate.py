"""Words and colour bars on finished pictures: GGUI's own widgets are not drawn off the screen."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from taichi_tryon.view.appearance import Scale

_INK = (45, 48, 56)
_TICKS = 5


def annotate(image: np.ndarray, title: str = "", scale: Scale | None = None) -> np.ndarray:
    """A copy of a picture, uint8 (h, w, 3), with a title (top left) and the colour bar of ``scale`` (bottom)."""
    picture = Image.fromarray(image)
    draw = ImageDraw.Draw(picture)
    size = max(10, picture.height // 44)
    font = ImageFont.load_default(size)
    if title:
        draw.text((size, size * 0.8), title, fill=_INK, font=font)
    if scale is not None:
        _color_bar(picture, draw, font, size, scale)
    return np.asarray(picture)


def _color_bar(picture: Image.Image, draw: ImageDraw.ImageDraw, font, size: int, scale: Scale) -> None:
    """A horizontal bar with the values below and the label above."""
    width, height = int(0.5 * picture.width), size
    left, top = (picture.width - width) // 2, picture.height - int(3.2 * size)
    values = np.linspace(scale.low, scale.high, width)
    bar = (np.repeat(scale.colors(values)[None], height, axis=0) * 255 + 0.5).astype(np.uint8)
    picture.paste(Image.fromarray(bar), (left, top))
    draw.rectangle((left - 1, top - 1, left + width, top + height), outline=_INK)
    draw.text((picture.width // 2, top - 0.4 * size), scale.label, fill=_INK, font=font, anchor="mb")
    for part in np.linspace(0, 1, _TICKS):
        x = left + part * (width - 1)
        draw.line((x, top + height, x, top + height + size // 4), fill=_INK)
        value = scale.low + part * (scale.high - scale.low)
        draw.text((x, top + height + 0.4 * size), _short(value, scale), fill=_INK, font=font, anchor="mt")


def _short(value: float, scale: Scale) -> str:
    """A tick's value with as many decimals as tell the ticks apart."""
    step = (scale.high - scale.low) / (_TICKS - 1)
    decimals = int(np.clip(np.ceil(1 - np.log10(max(step, 1e-12))), 0, 6))
    return f"{value + 0.0:.{decimals}f}"
