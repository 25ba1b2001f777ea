"""One public class name, one thing: a name that needs its folder to be understood is not finished.

`python -m tests.test_class_names` prints every name that several modules define.
"""

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("bench", "drivers", "procedures", "reports", "sim_instruments")
#: A public class at the top of a module; parsing them all would take seconds.
_CLASS = re.compile(r"^class ([A-Za-z]\w*)", re.MULTILINE)

#: The driver of an instrument and its simulated counterpart bear the instrument's name: they never meet in one file.
INSTRUMENTS = frozenset(
    {
        "Cia402Inverter",
        "Cia402SixStep",
        "Dyn200",
        "Keysight34461A",
        "Keysight34970A",
        "KeysightE4980A",
        "KeysightInfiniiVision",
        "LutronTachometer",
        "ModbusLine",
    }
)


@cache
def duplicates() -> Mapping[str, Sequence[str]]:
    """Return the public classes that several modules define, with these modules."""
    found: dict[str, list[str]] = defaultdict(list)
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            for name in _CLASS.findall(path.read_text(encoding="utf-8")):
                found[name].append(str(path.relative_to(ROOT)))
    return {name: places for name, places in sorted(found.items()) if len(places) > 1}


def test_no_public_class_bears_the_name_of_another() -> None:
    fresh = {name: places for name, places in duplicates().items() if name not in INSTRUMENTS}
    assert not fresh, "\n".join(f"{name}: {', '.join(places)}" for name, places in fresh.items())


def test_the_list_of_instruments_only_shrinks() -> None:
    unique = sorted(INSTRUMENTS - duplicates().keys())
    assert not unique, f"no longer defined twice, take out of the list: {', '.join(unique)}"


if __name__ == "__main__":
    for name, places in duplicates().items():
        print(f"{name}: {', '.join(places)}")
