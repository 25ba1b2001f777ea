"""Verification of the oscilloscope's probes and channels against the supply's reading, or a voltmeter's beside it."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

from GTC.lib import UncertainReal
from pydantic import Field

from drivers.interfaces import ChannelSettings, ProbeKind, Reading, Regulated, SetpointError, Trigger, Waveform
from drivers.interfaces.text import text
from procedures.core.actions import (
    ALL_OPEN,
    ConnectProbes,
    ConnectVoltmeterToSupply,
    CurrentProbe,
    DisconnectVoltmeter,
    LockRotor,
    Node,
    Terminal,
    UncoupleDynamometer,
    VoltageProbe,
    supply_across,
)
from procedures.core.bench import ProcedureError, Role
from procedures.core.demand import LOOP, Demand, Demands
from procedures.core.procedure import Procedure
from procedures.core.settings import Settings
from procedures.core.steps import step
from procedures.techniques.probe_gain import ShownLevel, gain_between, less_zero, shown_level, steady
from procedures.techniques.winding.alignment import flowing_current
from procedures.verification.verified_channels import VerifiedChannels, VerifiedGain

#: A level fills this share of the half screen.
_FILL = 0.9
#: A range of which the level fills less than this share of the half screen is left out.
_LEAST_FILL = 0.1
#: A gain off by more than this is a wrong factor or a wrong connection, not an error of gain.
_WRONG = 0.2
#: Readings of the reference, whose scatter is its noise.
_READINGS = 6
#: Current limit (A) of the supply while only probes are on it.
_PROBES_ONLY = 0.1
#: Full scales of eight divisions of 1, 2, 5 in the decades of motors of a few volts.
_RANGES = (0.08, 0.16, 0.4, 0.8, 1.6, 4.0, 8.0, 16.0, 40.0)
#: Those that follow, for motors of a higher voltage.
_HIGH_RANGES = (80.0, 160.0, 400.0, 800.0, 1600.0)
#: A record's signal fills at most this share of the screen.
_FILL_OF_RECORD = 0.8
_CHANNELS = (1, 2, 3, 4)


def ranges_for(voltage: float | None) -> tuple[float, ...]:
    """Return the full-scale ranges (V) that records of a motor take, up to both half waves of its largest voltage (V), if known."""
    needed = 2.0 * (voltage or 0.0) / _FILL_OF_RECORD
    # The first that is wide enough, and those below it.
    below = sum(each < needed for each in (_RANGES[-1], *_HIGH_RANGES))
    return (*_RANGES, *_HIGH_RANGES[:below])


Levels = dict[tuple[int, float], ShownLevel]


class ProbeVerificationSettings(Settings):
    """Settings of the probes' verification."""

    voltage_ranges: tuple[float, ...] | None = Field(
        default=None,
        max_length=20,
        description="full-scale ranges of voltage channels, V; where not given, steps of 1, 2, 5 from 0.08 V to what a record of the "
        "nameplate's largest voltage takes, 40 V at least; [] leaves them out",
    )
    current_ranges: tuple[float, ...] = Field(
        default=_RANGES, max_length=20, description="full-scale ranges of current channels, A; none leaves them out"
    )
    current_share: float = Field(default=0.5, gt=0.0, le=1.0, description="largest current, share of the rated current")
    record_time: float = Field(
        default=0.1, ge=1e-3, le=10.0, description="length of the record, s; averages 50 Hz hum over five periods"
    )
    points: int = Field(default=2000, ge=100, le=1_000_000, description="points of a record")
    settle: float = Field(default=0.2, gt=0.0, le=60.0, description="time at each level before reading, s")


class ProbeVerification(Procedure[ProbeVerificationSettings]):
    """Gain of each channel with its probe, in the ranges that later measurements use, which then correct by it.

    The supply gives a level in both polarities; its own meters are the reference, of voltage the voltmeter where there is one.
    """

    name: ClassVar[str] = "probe-verification"
    title: ClassVar[str] = "Verification of the probes"
    section: ClassVar[str] = "S2"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.SUPPLY, Role.OSCILLOSCOPE})
    gives: ClassVar[tuple[str, ...]] = tuple(f"channel_{channel}_gain" for channel in _CHANNELS)
    corrects: ClassVar[frozenset[Role]] = frozenset({Role.OSCILLOSCOPE})
    needs: ClassVar[Demands] = {Role.SUPPLY: LOOP, Role.OSCILLOSCOPE: Demand(waveforms=True)}
    end_of_line: ClassVar[bool] = True

    def measure(self) -> None:
        """Verify the voltage channels, then the current channels, and keep their gains for what follows."""
        self.prepare()
        gains = [*self.voltage_channels(), *self.current_channels()]
        self.conclude(gains)

    @step("S2/1", "Open the terminals, lock the shaft", by_hand=True)
    def prepare(self) -> None:
        """Leave nothing on the supply; forget an earlier verification. Raises ProcedureError where no samples can be read."""
        self.bench.state.verified_channels = VerifiedChannels()
        if not self.bench.bare_oscilloscope.gives_waveforms:
            raise ProcedureError(
                text(
                    "the channels' gains come from samples, and this oscilloscope gives none: use one with waveform readout"
                )
            )
        self.bench.perform(UncoupleDynamometer(), LockRotor(), ALL_OPEN)

    @step(
        "S2/2",
        "All voltage probes on the supply's output, then with their leads exchanged: a level in each range",
        by_hand=True,
    )
    def voltage_channels(self) -> list[tuple[VerifiedGain, UncertainReal]]:
        """Return the voltage channels' gains in every range that the supply fills."""
        channels = self.bench.bare_oscilloscope.channels(ProbeKind.VOLTAGE)
        ranges = self.settings.voltage_ranges
        if ranges is None:
            ranges = ranges_for(self.nameplate.voltage_bound)
        if not channels or not ranges:
            return []
        metered = self.bench.has(Role.VOLTMETER)
        meter = (ConnectVoltmeterToSupply(),) if metered else ()
        ends = []
        for sign, tip, reference in (
            (1.0, Node.SUPPLY_POSITIVE, Node.SUPPLY_NEGATIVE),
            (-1.0, Node.SUPPLY_NEGATIVE, Node.SUPPLY_POSITIVE),
        ):
            probes = ConnectProbes(tuple(VoltageProbe(channel, tip, reference) for channel in channels))
            self.bench.perform(*meter, probes)
            ends.append(self._levels(channels, ranges, sign, ProbeKind.VOLTAGE))
        return self._gains(ends, "voltmeter" if metered else "supply, voltage")

    @step(
        "S2/3",
        "All current probes round the wire of A, the supply from A to B, then from B to A: a current in each range",
        by_hand=True,
    )
    def current_channels(self) -> list[tuple[VerifiedGain, UncertainReal]]:
        """Return the current channels' gains in every range that the motor's current fills."""
        channels = self.bench.bare_oscilloscope.channels(ProbeKind.CURRENT)
        if not channels or not self.settings.current_ranges:
            return []
        self.bench.perform(
            DisconnectVoltmeter(), ConnectProbes(tuple(CurrentProbe(channel, Terminal.A) for channel in channels))
        )
        ends, zero = [], self._zero()
        for sign, plus, minus in ((1.0, Terminal.A, Terminal.B), (-1.0, Terminal.B, Terminal.A)):
            self.bench.perform(supply_across(plus, minus))
            ends.append(self._levels(channels, self.settings.current_ranges, sign, ProbeKind.CURRENT, zero))
        self.bench.perform(ALL_OPEN)
        return self._gains(ends, "supply, current")

    @step("S2/4", "Gain of each channel in each range, shown over true; later measurements are corrected by it")
    def conclude(self, gains: Sequence[tuple[VerifiedGain, UncertainReal]]) -> None:
        """Report each channel's gain that is known best, and keep all of them."""
        if not gains:
            raise ProcedureError(
                text(
                    "the supply and the motor's current fill none of the ranges; give narrower ones with --set voltage_ranges=[…] and "
                    "current_ranges=[…]"
                )
            )
        for number in sorted({gain.channel for gain, _ in gains} & set(_CHANNELS)):
            best, quantity = min((each for each in gains if each[0].channel == number), key=lambda each: each[0].limit)
            self.report(
                f"channel_{number}_gain",
                quantity,
                section=self.section,
                estimator=f"shown over true between both polarities, range {best.range:.4g}",
            )
        verified = VerifiedChannels([gain for gain, _ in gains], self.bench.bare_oscilloscope.identity.serial_number)
        self.findings |= verified.findings()
        self.bench.state.verified_channels = verified

    def _zero(self) -> Reading:
        """Return what the supply's ammeter shows of no current (A), the output being on and nothing connected."""
        supply = self.bench.supply
        with supply.energised(min(1.0, supply.maximum_voltage), min(_PROBES_ONLY, supply.maximum_current)):
            self.bench.clock.sleep(self.settings.settle)
            return steady([supply.measure_current() for _ in range(_READINGS)])

    def _levels(
        self,
        channels: Sequence[int],
        ranges: Sequence[float],
        sign: float,
        kind: ProbeKind,
        zero: Reading | None = None,
    ) -> Levels:
        """Return what the channels show of one polarity, by channel and range; ranges that cannot be set or filled are left out."""
        scope, settings = self.bench.bare_oscilloscope, self.settings
        scope.configure_acquisition(settings.record_time, settings.points)
        largest = self._largest(kind)
        result: Levels = {}
        for full_scale in ranges:
            level = min(_FILL * 0.5 * full_scale, largest)
            if level < _LEAST_FILL * 0.5 * full_scale:
                continue
            try:
                for channel in channels:
                    scope.configure_channel(channel, ChannelSettings(full_scale))
            except SetpointError as refused:
                if refused.low <= full_scale <= refused.high:
                    raise
                continue
            reference, waves = self._held(level, channels, kind)
            if zero is not None:
                reference = less_zero(reference, zero)
            for channel, wave in waves.items():
                result[channel, wave.full_scale] = shown_level(wave, reference, sign)
        return result

    def _held(self, level: float, channels: Sequence[int], kind: ProbeKind) -> tuple[Reading, Mapping[int, Waveform]]:
        """Return the reference's reading and the records of a level (V or A) while the supply holds it."""
        bench, timeout = self.bench, 10.0 + 2.0 * self.settings.record_time
        voltage = kind is ProbeKind.VOLTAGE
        current = min(_PROBES_ONLY, bench.supply.maximum_current) if voltage else level
        volts = level if voltage else bench.supply.maximum_voltage
        with bench.supply.energised(volts, current, Regulated.VOLTAGE if voltage else Regulated.CURRENT):
            bench.clock.sleep(self.settings.settle)
            if not voltage:
                flowing_current(bench, level)
                reference = steady([bench.supply.measure_current() for _ in range(_READINGS)])
            elif bench.has(Role.VOLTMETER):
                bench.voltmeter.configure(level)
                reference = steady([bench.voltmeter.measure_voltage() for _ in range(_READINGS)])
            else:
                reference = steady([bench.supply.measure_voltage() for _ in range(_READINGS)])
            bench.bare_oscilloscope.configure_trigger(Trigger(None))
            bench.bare_oscilloscope.initiate()
            waves = bench.bare_oscilloscope.fetch(channels, timeout)
        return reference, waves

    def _largest(self, kind: ProbeKind) -> float:
        if kind is ProbeKind.VOLTAGE:
            return self.bench.supply.maximum_voltage
        return self.aligning_current(self.settings.current_share)

    def _gains(self, ends: Sequence[Levels], reference: str) -> list[tuple[VerifiedGain, UncertainReal]]:
        high, low = ends
        result = []
        for channel, full_scale in high:
            gain, scatter, meter = gain_between(high[channel, full_scale], low[channel, full_scale])
            if abs(gain - 1.0) > _WRONG:
                raise ProcedureError(
                    text(
                        "channel {channel} shows {gain:.3g} times the true value: its probe's factor, range or "
                        "connection is wrong. Correct it (the station file has the factors) and verify again",
                        channel=channel,
                        gain=gain,
                    )
                )
            quantity = self.bench.uncertainties.statistical(
                text("level on channel {channel}", channel=channel), gain, scatter
            )
            quantity = self.bench.uncertainties.instrument(reference, quantity, meter)
            low_end, high_end = self.bench.uncertainties.interval(quantity)
            limit = 0.5 * (high_end - low_end) / gain
            # A reference that is worse than the data sheet helps nobody.
            if limit >= high[channel, full_scale].stated:
                continue
            result.append((VerifiedGain(channel, full_scale, gain, limit, f"{reference}: {meter.source}"), quantity))
        return result
