"""The reports' fonts, cut from Noto's: `python -m tests.studies.report_font FOLDER`.

FOLDER is where Debian's packages fonts-noto-core and fonts-noto-cjk lie, /usr/share/fonts. GB 2312 holds every character of modern
standard Chinese that a name or a remark is likely to have; arrows, mathematics and full-width forms go with it. Latin and
Greek have fonts of their own: the Chinese one sets a middle dot or an ellipsis as wide as a character.
"""

import sys
from pathlib import Path
from typing import Any

from fontTools import subset
from fontTools.ttLib import TTCollection, TTFont

from reports.fonts import BOLD, CHINESE, CHINESE_FAMILY, REGULAR

#: Unicode ranges that engineers write in.
LATIN = ((0x20, 0x17F), (0x370, 0x3FF), (0x2000, 0x20BF), (0x2100, 0x214F))
#: And those beside GB 2312.
CHINESE_RANGES = (
    *LATIN,
    (0x2150, 0x23FF),
    (0x2460, 0x2473),
    (0x2500, 0x257F),
    (0x25A0, 0x266F),
    (0x3000, 0x303F),
    (0xFF00, 0xFFEF),
)


def gb2312() -> set[str]:
    """Return the 6763 Chinese characters of GB 2312."""
    found = set()
    for lead in range(0xB0, 0xF8):
        for trail in range(0xA1, 0xFF):
            try:
                found.add(bytes((lead, trail)).decode("gb2312"))
            except UnicodeDecodeError:
                continue
    return found


def characters(*ranges: tuple[int, int]) -> set[str]:
    """Return the characters of these ranges, ends included."""
    return {chr(code) for low, high in ranges for code in range(low, high + 1)}


def cut(font: Any, kept: set[str], target: Path, features: list[str]) -> None:
    """Write a font of these characters."""
    options = subset.Options(layout_features=features, name_IDs=["*"], hinting=False, notdef_outline=True)
    options.drop_tables += ["VORG", "vhea", "vmtx", "BASE"]
    cutter = subset.Subsetter(options)
    cutter.populate(text="".join(sorted(kept)))
    cutter.subset(font)
    font.save(target)


def main(folder: Path) -> None:
    """Write the three fonts."""
    collection = TTCollection(folder / "opentype" / "noto" / "NotoSansCJK-Regular.ttc")
    (chinese,) = (font for font in collection.fonts if font["name"].getDebugName(4) == CHINESE_FAMILY)
    cut(chinese, gb2312() | characters(*CHINESE_RANGES), CHINESE, [])
    for weight, target in (("Regular", REGULAR), ("Bold", BOLD)):
        cut(
            TTFont(folder / "truetype" / "noto" / f"NotoSans-{weight}.ttf"),
            characters(*LATIN),
            target,
            ["kern", "mark"],
        )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
