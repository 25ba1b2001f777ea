"""The motor's line resistances as this run knows them; they distinguish one connection from another."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from procedures.core.result import Parameter
from procedures.estimation.fitting.intervals import Interval, around
from procedures.estimation.winding.wiring import Poles, loop_resistance

#: A winding may be warmer or colder by about 20 K than when its resistance was read in this run.
_WARMING = 0.08
#: A figure of 25 °C from an earlier run holds for 0 to 55 °C, and says nothing of the phases' unbalance.
_ANY_TEMPERATURE, _UNBALANCE = 0.12, 0.03
#: Beyond this share of contacts a resistance is not given, and nothing is held against it.
_MOST_CONTACTS = 0.05
#: Of one instrument's limit of error, so much may differ between a reading and a like one.
_DIFFERING = 1.0 / 3.0
#: Contacts made anew: leads that were seen once may come out so much better or worse, and by this (Ω) in any case.
_CONTACTS, _CONTACT = (0.5, 1.5), 2e-3
#: A winding at an ordinary room's temperature (°C) may cool by this (K) while others are measured; a warmer one, to that below it.
_ROOM, _COOLING = 25.0, 2.0
#: By this share a kelvin, 1/K, copper's resistance falls. (The estimators' constant would load what a panel's start does without.)
_PER_KELVIN = 0.00393
_NONE = Interval(0.0, 0.0)
_ALIKE = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Reference:
    """The reference that a reading between two poles is compared with.

    Legs (Ω) of the equivalent wye with the relative half-width within which they hold now, and the leads (Ω) in series. With
    `before`, the legs are what a reading on those poles gives, its leads taken for part of them: whether that connection was as
    told is not known either. With `own`, it was read by the instrument whose reading is held against it, so that what that one
    is off by is in both.
    """

    phases: tuple[float, float, float]
    tolerance: float
    leads: Interval
    before: Poles | None = None
    own: bool = True

    def loop(self, poles: Poles) -> Interval:
        """Return the resistance (Ω) to be read between these poles, which have a path."""
        resistance = around(loop_resistance(self.phases, poles), gain=self.tolerance)
        if self.before is None:
            return resistance.plus(self.leads)
        # The leads are the same in both readings; as part of the legs they were scaled with them.
        share = 1.0 - loop_resistance(_ALIKE, poles) / loop_resistance(_ALIKE, self.before)
        return resistance.plus(self.leads.scaled(share))

    def had_it_been(self, poles: Poles) -> "Reference":
        """Return the reference with the reading before on other poles than told, which have a path."""
        scale = loop_resistance(_ALIKE, self.before or poles) / loop_resistance(_ALIKE, poles)
        a, b, c = (scale * leg for leg in self.phases)
        return replace(self, phases=(a, b, c), before=poles)


@dataclass(frozen=True)
class _Read:
    phases: tuple[float, float, float]
    error: float
    frequency: float
    scatter: float = 0.0
    contacts: float = 0.0
    cooling: float = 0.0

    @property
    def tolerance(self) -> float:
        """Relative half-width within which the legs hold for a reading that is made of them later, but for the instrument."""
        return _WARMING + self.contacts

    @property
    def holds(self) -> bool:
        """True if the legs are more than what contacts may have made of them."""
        return self.contacts <= _MOST_CONTACTS


@dataclass(frozen=True)
class LineValues:
    """Readings (Ω) of AB, BC and CA, how one of them scatters and by how much the instrument may be off, both relative.

    By `contacts`, a share, a line may be too large, as one that differed when it was connected again.
    """

    values: tuple[float, float, float]
    scatter: float
    error: float
    contacts: float


class Lines:
    """Line resistances as instruments of this run read them; what is not known is not guessed."""

    def __init__(self) -> None:
        self._bridge: _Read | None = None
        self._direct: _Read | None = None
        self._leads: Interval | None = None
        self._supposed: dict[str, tuple[Poles, Interval]] = {}

    @property
    def bridge_frequency(self) -> float | None:
        """Test frequency (Hz) at which the bridge has read the lines."""
        return self._bridge.frequency if self._bridge else None

    @property
    def by_bridge(self) -> LineValues | None:
        """The bridge's readings; None where it has read none."""
        if self._bridge is None:
            return None
        a, b, c = self._bridge.phases
        return LineValues((a + b, b + c, c + a), self._bridge.scatter, self._bridge.error, self._bridge.contacts)

    def read_by_bridge(
        self, lines: Sequence[float], error: float, frequency: float, scatter: float = 0.0, *, contacts: float = 0.0
    ) -> None:
        """Keep the bridge's readings (Ω) of AB, BC, CA at a frequency (Hz), with its limit of error and their scatter, both relative.

        By `contacts`, a share, a line may be too large, as one that differed when it was connected again.
        """
        read = _read(lines, error, frequency)
        self._bridge = replace(read, scatter=scatter, contacts=contacts) if read else None

    def read_by_four_wires(
        self, lines: Sequence[float], error: float, *, temperature: float = _ROOM, contacts: float = 0.0
    ) -> None:
        """Keep four-wire readings (Ω) of AB, BC, CA with their relative limit of error, the winding's temperature (°C), and by what share
        contacts may have added.
        """
        read = _read(lines, error, 0.0)
        cooling = _PER_KELVIN * (max(temperature - _ROOM, 0.0) + _COOLING)
        self._direct = replace(read, contacts=contacts, cooling=cooling) if read else None

    def direct(self, poles: Poles) -> Interval | None:
        """Return the resistance (Ω) to direct current between two poles; None where four wires have not read it in this run.

        From a winding that has cooled since then to one that has not: an alignment may have warmed it.
        """
        if self._direct is None:
            return None
        read, value = self._direct, loop_resistance(self._direct.phases, poles)
        return Interval(value * max(1.0 - read.error - read.contacts - read.cooling, 0.0), value * (1.0 + read.error))

    def seen_leads(self, resistance: Interval) -> None:
        """Keep what two- and four-wire readings show of the supply's leads (Ω)."""
        low, high = _CONTACTS
        self._leads = Interval(max(0.0, low * resistance.low - _CONTACT), high * max(resistance.high, 0.0) + _CONTACT)

    def suppose(self, by: str, poles: Poles, resistance: Interval) -> None:
        """Keep the first reading (Ω) of an instrument whose connection could not be verified, to hold the next ones against."""
        if resistance.low > 0.0:
            self._supposed.setdefault(by, (poles, resistance))

    def for_bridge(self, known: Mapping[str, Parameter]) -> Reference | None:
        """Return what a bridge's reading is held against, its leads being corrected; None where nothing is known."""
        if self._bridge and self._bridge.holds:
            return Reference(self._bridge.phases, self._bridge.tolerance + _DIFFERING * self._bridge.error, _NONE)
        if self._direct and self._direct.holds:
            return Reference(self._direct.phases, self._direct.tolerance + self._direct.error, _NONE, own=False)
        return _from_parameter(known, _NONE)

    def supposed_for_bridge(self) -> Reference | None:
        """Return what the first reading of this run supposes, where nothing else is known."""
        return self._supposed_for("lcr_meter", _NONE)

    def for_supply(self, known: Mapping[str, Parameter], leads: float) -> Reference | None:
        """Return what a supply's V over I is held against; its leads have up to `leads` (Ω) where they were not seen yet."""
        between = self._leads or Interval(0.0, leads)
        best = next((read for read in (self._direct, self._bridge) if read and read.holds), None)
        if best:
            return Reference(best.phases, best.tolerance + best.error, between)
        return _from_parameter(known, between) or self._supposed_for("supply", between)

    def _supposed_for(self, by: str, leads: Interval) -> Reference | None:
        # A first reading has the contacts in it that were seen to differ.
        if by not in self._supposed or any(read and not read.holds for read in (self._direct, self._bridge)):
            return None
        poles, read = self._supposed[by]
        middle = 0.5 * (read.low + read.high)
        leg = middle / loop_resistance(_ALIKE, poles)
        error = 0.5 * (read.high - read.low) / middle
        return Reference((leg, leg, leg), _WARMING + _UNBALANCE + error, leads, poles)


def _read(lines: Sequence[float], error: float, frequency: float) -> _Read | None:
    ab, bc, ca = lines
    phases = ((ab + ca - bc) / 2.0, (ab + bc - ca) / 2.0, (bc + ca - ab) / 2.0)
    return _Read(phases, error, frequency) if min(phases) > 0.0 else None


def _from_parameter(known: Mapping[str, Parameter], leads: Interval) -> Reference | None:
    parameter = known.get("stator_resistance")
    if parameter is None or parameter.value <= 0.0:
        return None
    low, high = parameter.coverage_interval
    error = 0.5 * (high - low) / parameter.value
    return Reference((parameter.value,) * 3, _ANY_TEMPERATURE + _UNBALANCE + error, leads, own=False)
