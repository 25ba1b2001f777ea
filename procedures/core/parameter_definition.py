"""Definition of a parameter, and tables of such definitions."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import KW_ONLY, dataclass
from enum import Enum
from unicodedata import normalize

from drivers.interfaces.text import Text
from procedures.core.units import ALLOWED_UNITS, is_unit


class FactorErrors(Enum):
    """The factor errors that are considered if a figure deviates from its type value."""

    IMPEDANCE = "impedance"
    FLUX = "flux"
    TORQUE = "torque"


@dataclass(frozen=True)
class Bounds:
    """The range of possible values of a parameter, in its unit; `open` excludes the low bound itself."""

    low: float
    high: float | None = None
    open: bool = False


_PREFIXES = frozenset("pnuµmkMGT")
ABOVE_ZERO, NOT_NEGATIVE = Bounds(0.0, open=True), Bounds(0.0)


@dataclass(frozen=True)
class ParameterDefinition:
    """Definition of a parameter, wherever it is measured, shown, judged or exported.

    `symbol` is plain text, what follows `_` being the index, empty where the field has none; `convention` says per what,
    peak or rms, at which temperature. `unit` is that of results (`1` for none), `reader_unit` another name of it, as large, in tables
    for readers.
    Values make sense within `bounds`; counts are `whole` numbers.
    `restates` names the parameter of which it is the same quantity in another unit or convention.
    `type_value`: whether a motor file may expect a value. `controller_uncertainty` is the largest relative standard
    uncertainty with which the figure goes into a controller. `true_value` says where a virtual motor has it: `motor.` or
    `drive.` and an attribute, or the name of a formula of `bench.virtual.true_values`; empty where it depends on the test.
    """

    name: str
    symbol: str
    unit: str
    label: Text
    convention: str = ""
    _: KW_ONLY
    bounds: Bounds = ABOVE_ZERO
    whole: bool = False
    reader_unit: str = ""
    type_value: bool = True
    factor_errors: FactorErrors | None = None
    controller_uncertainty: float = math.inf
    true_value: str = ""
    restates: str = ""

    def __post_init__(self) -> None:
        if not self.name.isidentifier() or self.name != self.name.lower():
            raise ValueError(
                f"parameter {self.name!r}: a name is small letters, digits and underscores, as stator_resistance"
            )
        if not self.unit:
            raise ValueError(f"parameter {self.name}: the unit is missing; 1 stands for none")
        for key in ("unit", "reader_unit"):
            # The ohm sign looks like the omega that all others write, and is another character.
            unit = normalize("NFC", getattr(self, key))
            object.__setattr__(self, key, unit)
            if unit and not is_unit(unit):
                raise ValueError(f"parameter {self.name}: {key} {unit!r} is no unit; allowed are {ALLOWED_UNITS}")
        if _prefixed(self.unit, self.reader_unit):
            raise ValueError(
                f"parameter {self.name}: reader_unit {self.reader_unit} is not of the size of {self.unit}; leave it out: tables choose the "
                "prefix by the figure"
            )

    def for_readers(self) -> dict[str, str]:
        """Return what a record needs to show the parameter after its definition has been removed."""
        return {"symbol": self.symbol, "label": self.label.render(), "reader_unit": self.reader_unit}


def _prefixed(unit: str, other: str) -> bool:
    """Tell whether a unit is another one with a prefix before one of its factors."""
    ours, theirs = re.split("[·/]", unit), re.split("[·/]", other)
    return len(ours) == len(theirs) and any(
        a != b and ((a[:1] in _PREFIXES and a[1:] == b) or (b[:1] in _PREFIXES and b[1:] == a))
        for a, b in zip(ours, theirs, strict=True)
    )


class ParameterTable(Mapping[str, ParameterDefinition]):
    """Definitions by name, in order; never changed, only extended to another table."""

    def __init__(self, definitions: Iterable[ParameterDefinition]) -> None:
        """Take the definitions. Raises ValueError for two of one name that differ."""
        self._rows: dict[str, ParameterDefinition] = {}
        for definition in definitions:
            if self._rows.setdefault(definition.name, definition) != definition:
                raise ValueError(f"parameter {definition.name} is defined twice, and differently; choose another name")

    def __getitem__(self, name: str) -> ParameterDefinition:
        if name not in self._rows:
            raise KeyError(f"{name!r} is none of the parameters {', '.join(self._rows)}")
        return self._rows[name]

    def __contains__(self, name: object) -> bool:
        # Without the sentence of the error: a plug-in's parameter is asked for often.
        return name in self._rows

    def __iter__(self) -> Iterator[str]:
        return iter(self._rows)

    def __len__(self) -> int:
        return len(self._rows)

    def extended(self, definitions: Iterable[ParameterDefinition]) -> "ParameterTable":
        """Return a table with further definitions. Raises ValueError for one that contradicts a row."""
        return ParameterTable((*self._rows.values(), *definitions))

    def resolved(self, given: Iterable[str | ParameterDefinition]) -> "ParameterTable":
        """Return the table of what a procedure gives: names of rows, and definitions of its own.

        Raises ValueError for a name without a row, and for a definition that contradicts one.
        """
        result = []
        for each in given:
            if isinstance(each, str) and each not in self._rows:
                raise ValueError(
                    f"{each!r} is no known parameter; give a ParameterDefinition of it instead of its name"
                )
            result.append(self._rows[each] if isinstance(each, str) else each)
        self.extended(result)
        return ParameterTable(result)
