"""Reads a six-step drive at one load; values that contradict the others or the current's frequency are read or asked for again."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from drivers.interfaces import Instrument, Reading
from drivers.interfaces.text import Text, text
from procedures.core.actions import DRIVE, CurrentProbe, DoubtReading
from procedures.core.bench import ProcedureError
from procedures.core.procedure import Procedure
from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.six_step.line_record import separated_line
from procedures.six_step.load_points import Averaged, LoadPoint, averaged
from procedures.six_step.settings import EquivalentResistanceSettings
from procedures.techniques.acquisition import ranged_record
from procedures.techniques.repeated_readings import TYPED_SHARE, RepeatedReading, repeated_readings

_POINTS = 50_000
#: How often a person is asked about one speed.
_QUESTIONS = 5
_RPM = 30.0 / math.pi


def read_point(
    procedure: Procedure[EquivalentResistanceSettings],
    torque: float,
    probe: CurrentProbe,
    begun: float,
    *,
    first: bool,
    pole_pairs: int | None,
) -> LoadPoint:
    """Return the readings at a load (N·m) that came at `begun` (s), the `first` of which proves the probe.

    Raises ProcedureError where the motor does not turn.
    """
    bench, settings, channel = procedure.bench, procedure.settings, probe.channel
    frequency = bench.drive.measure_frequency().value
    if frequency <= 0.0:
        raise ProcedureError(text("the motor does not turn at {torque:.3g} N·m; lower the load", torque=torque))
    record_time = settings.periods / frequency
    bench.oscilloscope.configure_acquisition(record_time, _POINTS, 0.0)
    wave = ranged_record(bench, {channel: 4.0 * procedure.nameplate.current_bound}, 10.0 + record_time)[channel]

    gives = tuple(procedure.parameters)

    def mean(name: Text, unit: str, instrument: Instrument, take: Callable[[], Reading]) -> Averaged:
        quantity = RepeatedReading(f"{torque:.3g} N·m", name, unit, gives, take, instrument.read_by_hand)
        return averaged(repeated_readings(procedure, quantity, settings.readings))

    bus_current = mean(text("DC link current"), "A", bench.drive, bench.drive.measure_bus_current)
    if first:
        procedure.wiring.inverter.running(DRIVE, probe, wave, bus_current.value)
    fit = fit_back_emf(wave.time, np.atleast_2d(wave.values), harmonics=(1, 5, 7, 11, 13), frequency=frequency)
    return LoadPoint(
        torque=torque,
        shaft_torque=mean(text("torque"), "N·m", bench.dynamometer, lambda: _shaft_torque(procedure)),
        speed=_speed(procedure, torque, fit.frequency, pole_pairs),
        bus_voltage=mean(text("DC link voltage"), "V", bench.drive, bench.drive.measure_bus_voltage),
        bus_current=bus_current,
        electrical_frequency=fit.frequency,
        line=separated_line(procedure, torque, wave, fit.frequency),
        current_accuracy=wave.accuracy,
        begun=begun,
        read=bench.clock.now(),
    )


def _speed(procedure: Procedure[Any], torque: float, frequency: float, pole_pairs: int | None) -> Reading:
    """Return the speed (rad/s); a typed one that is not that of the current's frequency (Hz) is asked for again, or confirmed."""
    tachometer = procedure.bench.tachometer
    read = tachometer.measure_speed()
    if not tachometer.read_by_hand or pole_pairs is None:
        return read
    turned = 2.0 * math.pi * frequency / pole_pairs
    for _ in range(_QUESTIONS):
        doubt = text(
            "speed at {torque:.3g} N·m: {read:.5g} rpm was typed, and the current's frequency gives {turned:.5g} rpm with {pairs} "
            "pole pairs",
            torque=torque,
            read=read.value * _RPM,
            turned=turned * _RPM,
            pairs=pole_pairs,
        )
        if abs(read.value / turned - 1.0) <= TYPED_SHARE or not procedure.bench.doubted(DoubtReading(doubt)):
            break
        read = tachometer.measure_speed()
    return read


def _shaft_torque(procedure: Procedure[Any]) -> Reading:
    """Return the load (N·m) as the dynamometer shows it now."""
    shown = procedure.bench.dynamometer.measure()
    return Reading(-shown.torque, "N·m", shown.torque_accuracy, shown.time)
