"""The reports' fonts: Noto Sans, and Noto Sans CJK SC cut down to GB 2312 (README.md beside them says how)."""

from collections.abc import Iterable
from functools import cache
from pathlib import Path

FOLDER = Path(__file__).parent
REGULAR, BOLD = FOLDER / "NotoSans-Regular.ttf", FOLDER / "NotoSans-Bold.ttf"
CHINESE = FOLDER / "NotoSansCJKsc-GB2312.otf"
LATIN_FAMILY, CHINESE_FAMILY = "Noto Sans", "Noto Sans CJK SC"


@cache
def covered(font: Path) -> frozenset[int]:
    """Return the code points that a font has."""
    from fontTools.ttLib import TTFont

    with TTFont(font, lazy=True) as opened:
        return frozenset(opened.getBestCmap())


def characters(words: Iterable[str]) -> set[str]:
    """Return the characters that words hold, other than blanks and line ends."""
    return {character for word in words for character in word if not character.isspace()}


def uncovered(words: Iterable[str]) -> set[str]:
    """Return the characters of these words that no font here has."""
    return {c for c in characters(words) if ord(c) not in covered(REGULAR) and ord(c) not in covered(CHINESE)}


def chinese_subset(words: Iterable[str]) -> bytes:
    """Return a font of what these words need beyond Latin and Greek, for a page that carries its own letters; empty for nothing."""
    import io

    from fontTools import subset
    from fontTools.ttLib import TTFont

    needed = {c for c in characters(words) if ord(c) not in covered(REGULAR) and ord(c) in covered(CHINESE)}
    if not needed:
        return b""
    # The font has no hints, and its bounds are those of all its letters: looking for either takes as long as all the rest.
    options = subset.Options(layout_features=[], name_IDs=[0, 1, 2, 13, 14], hinting=True, notdef_outline=True)
    options.drop_tables += ["GPOS", "GSUB"]
    with TTFont(CHINESE, lazy=True, recalcBBoxes=False) as font:
        cutter = subset.Subsetter(options)
        cutter.populate(text="".join(sorted(needed)))
        cutter.subset(font)
        stream = io.BytesIO()
        font.save(stream)
    return stream.getvalue()
