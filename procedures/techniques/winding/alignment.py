"""Bring the rotor to a known angle with direct current, and verify that the current flows."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from drivers.interfaces import OutputMode, Reading, Regulated
from drivers.interfaces.text import text
from procedures.core.bench import Bench, ProcedureError

#: The supply regulates when it gives no more than this times the wanted current, besides its meter's error.
_EXCEEDED = 1.05
#: The supply must reach this share of the wanted current, else the path is open or too resistive.
_REACHED = 0.9
#: At this share of its highest voltage an output is at its limit; of this share of the wanted current the path is closed.
_AT_LIMIT, _CLOSED = 0.95, 0.02


@dataclass(frozen=True)
class Alignment:
    """Voltage (V) and current (A) by the supply's meters while the rotor is held, and what the voltage's zero may be off (V)."""

    voltage: float
    current: float
    voltage_offset: float = 0.0

    @property
    def loop_resistance(self) -> float:
        """Resistance (Ω) of the whole loop, leads and contacts with it."""
        return self.voltage / self.current


#: What regulates an output, in words.
_MODES = {
    OutputMode.OFF: text("off"),
    OutputMode.CONSTANT_VOLTAGE: text("constant voltage"),
    OutputMode.CONSTANT_CURRENT: text("constant current"),
    OutputMode.UNREGULATED: text("unregulated"),
    OutputMode.TRIPPED: text("tripped"),
}


def flowing_current(bench: Bench, wanted: float) -> Reading:
    """Return the supply's current (A) where it is the one that was set, within what its setting and its meter may be off.

    Raises ProcedureError where less flows, or more.
    """
    supply = bench.supply
    reading = _not_exceeded(supply.measure_current(), wanted)
    if reading.value >= _REACHED * wanted:
        return reading
    mode, meter = supply.output_mode(), reading.accuracy
    # Setting and meter each err by about the meter's accuracy, which of a small current is a large share.
    slack = 2.0 * (meter.offset + meter.gain * wanted)
    if mode is OutputMode.CONSTANT_CURRENT and reading.value >= _REACHED * wanted - slack:
        return reading
    voltage = supply.measure_voltage().value
    at_limit = mode is OutputMode.CONSTANT_VOLTAGE and voltage >= _AT_LIMIT * supply.maximum_voltage
    if at_limit and reading.value >= _CLOSED * wanted + meter.offset:
        raise ProcedureError(
            text(
                "the supply is set to {wanted:.3g} A and gives {flowing:.3g} A at {voltage:.3g} V, its highest voltage: the loop has "
                "{resistance:.3g} Ω. If the winding has as much, use an output of more volts, or a lower current in the settings; if "
                "it has less, check the connections just made",
                wanted=wanted,
                flowing=reading.value,
                voltage=voltage,
                resistance=voltage / reading.value,
            )
        )
    raise ProcedureError(
        text(
            "the supply is set to {wanted:.3g} A and gives {flowing:.3g} A at {voltage:.3g} V ({mode}): the path is open "
            "or its resistance too high. Check the connections just made",
            wanted=wanted,
            flowing=reading.value,
            voltage=voltage,
            mode=_MODES[mode],
        )
    )


@contextmanager
def aligning(bench: Bench, current: float, settle: float) -> Iterator[Alignment]:
    """Hold the rotor with a direct current (A) for the length of the block; entered `settle` s after switching on.

    Raises ProcedureError where the current does not flow. The output is off after the block, however it ends.
    """
    supply = bench.supply
    bench.thermometer.warmed()
    with supply.energised(supply.maximum_voltage, current, Regulated.CURRENT):
        bench.clock.sleep(settle)
        flowing = flowing_current(bench, current).value
        if supply.output_mode() is not OutputMode.CONSTANT_CURRENT:
            raise ProcedureError(
                text("the supply does not regulate the current although it flows; check its settings and leads")
            )
        yield _read(bench, flowing)


def at_rest(bench: Bench, swinging: Alignment) -> Alignment:
    """Return what the supply's meters show now that the shaft is locked: a heavy rotor swings on for seconds, and its EMF is in what was
    read while it did. What a person reads is not asked for again.
    """
    if bench.supply.read_by_hand:
        return swinging
    return _read(bench, bench.supply.measure_current().value)


def _read(bench: Bench, current: float) -> Alignment:
    voltage = bench.supply.measure_voltage()
    return Alignment(voltage.value, current, voltage.accuracy.offset)


def _not_exceeded(reading: Reading, wanted: float) -> Reading:
    """Return a current's reading. Raises ProcedureError where the supply gives more than the current (A) it is set to.

    Nothing else would notice: an output that regulates its current cannot trip at its limit.
    """
    meter = reading.accuracy
    if reading.value > _EXCEEDED * wanted + 2.0 * (meter.offset + meter.gain * wanted):
        raise ProcedureError(
            text(
                "the supply is set to {wanted:.3g} A and gives {flowing:.3g} A: it does not regulate its current",
                wanted=wanted,
                flowing=reading.value,
            )
        )
    return reading
