"""The InfiniiVision's screen as a picture (programmer's guide, :DISPlay:DATA?)."""

import io
from typing import TYPE_CHECKING

import numpy as np

from sim_instruments.instruments.oscilloscope.record import DIVISIONS, FloatArray, Record
from sim_instruments.scpi.parameters import choice, choices, exactly
from sim_instruments.scpi.tree import Call

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw

_FORMATS, _PALETTES = choices(("BMP", "BMP8bit", "PNG")), choices(("COLor", "GRAYscale"))
_WIDTH, _HEIGHT, _HEADING = 800, 480, 20
_COLUMNS = 10
_GRATICULE, _TEXT = "#606060", "#ffffff"
#: Colours of the channels, as the keys beside the screen have them.
COLOURS = {1: "#ffff00", 2: "#00ff00", 3: "#4080ff", 4: "#ff4080"}
_POINTS = 4 * _WIDTH


def screen_block(call: Call, record: Record | None, shown: list[int]) -> bytes:
    """Return the screen as a block, in the format and the palette asked for. Raises ScpiError."""
    exactly(call.arguments, 0, 2)
    form = choice(call.arguments[0], _FORMATS) if call.arguments else "BMP"
    palette = choice(call.arguments[1], _PALETTES) if len(call.arguments) == 2 else "COL"
    picture = _drawn(record, shown)
    if palette == "GRAY":
        picture = picture.convert("L")
    elif form == "BMP8":
        picture = picture.convert("P")
    target = io.BytesIO()
    picture.save(target, "PNG" if form == "PNG" else "BMP")
    content = target.getvalue()
    return b"#8%08d" % len(content) + content


def _drawn(record: Record | None, shown: list[int]) -> "Image":
    """Return the graticule with the traces of a record."""
    # A picture is seldom asked for, and the library takes its time to load.
    from PIL import Image, ImageDraw

    picture = Image.new("RGB", (_WIDTH, _HEIGHT))
    draw = ImageDraw.Draw(picture)
    for column in range(_COLUMNS + 1):
        across = column * (_WIDTH - 1) // _COLUMNS
        draw.line([(across, _HEADING), (across, _HEIGHT)], fill=_GRATICULE)
    for down in _down(np.arange(DIVISIONS + 1.0) - DIVISIONS / 2).tolist():
        draw.line([(0, down), (_WIDTH, down)], fill=_GRATICULE)
    if record is not None:
        _draw_traces(draw, record, shown)
    return picture


def _draw_traces(draw: "ImageDraw", record: Record, shown: list[int]) -> None:
    points = record.points(_POINTS)
    across = np.linspace(0.0, _WIDTH, points, endpoint=False)
    for channel in shown:
        vertical = record.verticals[channel]
        codes = record.words(channel, points).astype(np.float64) / 256.0 - 128.0
        down = np.clip(_down(codes * vertical.step / vertical.scale), _HEADING, _HEIGHT - 1)
        draw.line(list(zip(across.tolist(), down.tolist(), strict=True)), fill=COLOURS[channel])
        draw.text((10 + 150 * (channel - 1), 4), f"{channel}  {vertical.scale:g}/", fill=COLOURS[channel])
    draw.text((_WIDTH - 120, 4), f"{record.span / _COLUMNS:g} s/", fill=_TEXT)


def _down(divisions: FloatArray) -> FloatArray:
    """Return how far down (pixels) what is so many divisions above the middle stands."""
    height = _HEIGHT - 1 - _HEADING
    return _HEADING + height * (0.5 - divisions / DIVISIONS)
