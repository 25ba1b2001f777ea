"""Hall sensors: order, polarity and place of three against the EMF."""

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
from GTC import ureal
from pydantic import Field

from drivers.interfaces import ProbeKind
from drivers.interfaces.text import Text, text
from procedures.core.actions import ALL_OPEN, ConnectProbes, CoupleDynamometer, Node, ReleaseRotor, VoltageProbe
from procedures.core.bench import Bench, ProcedureError, Role
from procedures.core.demand import Demand, Demands
from procedures.core.nameplate import Nameplate
from procedures.core.procedure import Procedure
from procedures.core.result import MISSING_PART, Notice
from procedures.core.settings import Settings
from procedures.core.steps import step
from procedures.estimation.emf.hall import SENSORS, HallFault, HallFinding, HallJudgement, Switching, judge, switching
from procedures.estimation.fitting.misfit import NO_MISFIT, Answer, Cause, Finding, Misfit
from procedures.techniques.acquisition import ranged_record
from procedures.techniques.shaft.driven_shaft import driving_speed_rad

_NODES = {1: Node.HALL_1, 2: Node.HALL_2, 3: Node.HALL_3}
#: First full-scale range (V) for a sensor's signal.
_LOGIC = 12.5
#: A lag (rad) between EMF and sensor that is told, beyond so many of its standard uncertainties.
_LATE, _BEYOND = math.radians(1.0), 4.0
#: An offset (rad) beyond this is nearer to half a turn than to none.
_HALF_TURNED = 0.5 * math.pi
#: Pole pairs that are taken where none are known, so that the record is long enough.
_FEW = 1

_NO_SENSORS = text(
    "by its file this motor has no Hall sensors; leave this procedure out, or write nameplate.hall_sensors = true"
)

Seen = Mapping[int, Switching | None]


class HallSensorsSettings(Settings):
    """Settings of the Hall sensors' check."""

    speed_share: float = Field(default=0.25, gt=0.0, le=1.0, description="speed, share of the rated speed")
    periods: float = Field(default=4.0, ge=2.5, le=1000.0, description="electrical periods of the record")
    points: int = Field(default=2000, ge=500, le=1_000_000, description="points of the record")
    offset: float = Field(
        default=0.0,
        ge=-180.0,
        le=180.0,
        description="where sensor 1 should rise, electrical degrees after the rising zero of the EMF from A to C",
    )
    both_ways: bool = Field(
        default=True, description="drive backwards as well, so that what delays the EMF or a sensor's signal cancels"
    )
    least_swing: float = Field(
        default=1.0, gt=0.0, le=100.0, description="a signal with a smaller swing counts as dead, V"
    )


class HallSensors(Procedure[HallSensorsSettings]):
    """Order, polarity, offset, spacing and duty of three Hall sensors against one line EMF of the driven motor.

    Where block commutation switches A to plus, 30° after its phase's EMF has crossed zero, the EMF from A to C crosses
    zero itself: that is where sensor 1 of an ideal motor rises, sensors 2 and 3 a third and two thirds of a turn later.
    A delay of a channel, and a sensor's hysteresis, move the places one way when driven forwards and the other way backwards.
    """

    name: ClassVar[str] = "hall-sensors"
    title: ClassVar[str] = "Hall sensors"
    section: ClassVar[str] = "L6"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.DYNAMOMETER, Role.OSCILLOSCOPE})
    gives: ClassVar[tuple[str, ...]] = ("hall_faults", "hall_offset", "hall_spacing_deviation", "hall_duty_deviation")
    needs: ClassVar[Demands] = {Role.OSCILLOSCOPE: Demand(waveforms=True, probes={ProbeKind.VOLTAGE: 2})}
    end_of_line: ClassVar[bool] = True

    @classmethod
    def check_capability(cls, bench: Bench, nameplate: Nameplate, settings: HallSensorsSettings) -> Sequence[Notice]:
        """Report before the run that the motor has no Hall sensors."""
        if nameplate.hall_sensors is not False:
            return ()
        return (Notice("cannot-support", Text("{name}: {why}", {"name": cls.name, "why": _NO_SENSORS})),)

    def measure(self) -> None:
        """Record all three, judge their leads, and measure their places."""
        self.prepare()
        seen = self.record()
        found = self.judge_leads(seen)
        self.places(seen, found)

    @step("L6/1", "Open the terminals, couple the drive motor", by_hand=True)
    def prepare(self) -> None:
        """Leave nothing on the terminals but a probe. Raises ProcedureError where the motor's file says that there are no sensors."""
        if self.nameplate.hall_sensors is False:
            raise ProcedureError(_NO_SENSORS)
        self.bench.perform(ALL_OPEN, ReleaseRotor(), CoupleDynamometer())

    @step(
        "L6/2",
        "Probe the EMF from A to C, and the Hall sensors against their ground; drive forwards, then backwards, and record",
        by_hand=True,
    )
    def record(self) -> Seen:
        """Return where each sensor switches; as many of them are recorded at a time as there are channels beside the EMF's."""
        scope = self.bench.oscilloscope
        channels = list(scope.channels(ProbeKind.VOLTAGE))
        if len(channels) < 2 or not scope.gives_waveforms:
            raise ProcedureError(
                text(
                    "each sensor's signal is compared with the EMF, for which an oscilloscope with waveform readout and "
                    "two voltage probes are needed; the station has {n} probes",
                    n=len(channels),
                )
            )
        seen: dict[int, Switching | None] = {}
        room = len(channels) - 1
        for first in range(0, len(SENSORS), room):
            sensors = SENSORS[first : first + room]
            seen |= self._recorded(channels[0], dict(zip(channels[1:], sensors, strict=False)))
        self._tell_lag([switched for switched in seen.values() if switched is not None])
        return seen

    @step("L6/3", "Order and polarity: each lead that is dead, swapped or inverted")
    def judge_leads(self, seen: Seen) -> HallJudgement:
        """Report the number of faults, and name each."""
        result = judge(seen, math.radians(self.settings.offset))
        self.findings |= {
            "leads": {
                f"H{lead}": None
                if switched is None
                else {"rise": math.degrees(switched.rise), "fall": math.degrees(switched.fall), "duty": switched.duty}
                for lead, switched in seen.items()
            },
            "faults": [f"H{fault.lead}: {fault.fault.value}" for fault in result.faults],
        }
        for fault in result.faults:
            self.notice("hall", self._said(fault))
        if not result.explained:
            self.notice("hall", text("two of the Hall sensors' leads show the same sensor"))
        self._half_turn = self._turned_by_half(seen, result)
        count = len({fault.lead for fault in result.faults}) or (0 if result.explained else 1)
        self.report(
            "hall_faults",
            ureal(float(count), 0.0),
            section=self.section,
            estimator="leads that are dead, swapped or inverted",
            misfit=self._half_turn.of("hall_faults"),
        )
        return result

    @staticmethod
    def _turned_by_half(seen: Seen, judged: HallJudgement) -> Misfit:
        """Return what is to be told of sensors that look half a turn off, as with an EMF's probe that is the wrong way round."""
        inverted = sum(fault.fault is HallFault.INVERTED for fault in judged.faults)
        all_inverted = 1 < inverted == sum(switched is not None for switched in seen.values())
        if not all_inverted and abs(judged.offset) <= _HALF_TURNED:
            return NO_MISFIT
        doubted = ("hall_offset", "hall_faults") if all_inverted else ("hall_offset",)
        figures: dict[str, float | str] = {"record": "hall", "offset": math.degrees(judged.offset)}
        return Misfit((Finding(Cause.PROBE_FACTOR, Answer.WITHHELD, doubted, figures=figures),))

    @step("L6/4", "Offset of all sensors from {offset:g}°, their spacing of 120° and their duty of one half")
    def places(self, seen: Seen, found: HallJudgement) -> None:
        """Report what the sensors that switch allow, in electrical degrees."""
        alive = [switched for switched in seen.values() if switched is not None]
        if not alive:
            self.findings[MISSING_PART] = "Hall sensors"
            return
        unc, edge = self.bench.uncertainties, math.degrees(max(switched.uncertainty for switched in alive))
        # An edge's error is its own; a sensor's place is the mean of two.
        self.report(
            "hall_offset",
            unc.statistical("Hall edges: offset", math.degrees(found.offset), edge / math.sqrt(2.0 * len(alive))),
            section=self.section,
            estimator="mean of the sensors' edges against the EMF's zero, order and polarity put right",
            misfit=self._half_turn.of("hall_offset"),
        )
        if math.isfinite(found.spacing):
            self.report(
                "hall_spacing_deviation",
                unc.statistical("Hall edges: spacing", math.degrees(found.spacing), edge),
                section=self.section,
                estimator="largest deviation of two sensors' spacing from 120°",
            )
        self.report(
            "hall_duty_deviation",
            unc.statistical("Hall edges: duty", 100.0 * found.duty, 100.0 * edge * math.sqrt(2.0) / 360.0),
            section=self.section,
            estimator="largest deviation of a sensor's share of high time from one half",
        )

    def _recorded(self, emf: int, sensors: Mapping[int, int]) -> Seen:
        """Return where the sensors (by channel) switch, from one record."""
        probes = [VoltageProbe(channel, _NODES[sensor], Node.HALL_GROUND) for channel, sensor in sensors.items()]
        self.bench.perform(ConnectProbes((VoltageProbe(emf, Node.A, Node.C), *probes)))
        scope, settings = self.bench.oscilloscope, self.settings
        speed = driving_speed_rad(self.bench, self.nameplate, settings.speed_share)
        known = self.known_value("pole_pairs") or self.nameplate.pole_pairs or self.nameplate.expected.get("pole_pairs")
        record_time = settings.periods * 2.0 * math.pi / ((known or _FEW) * speed)
        scope.configure_acquisition(record_time, settings.points, 0.0)
        rated = self.nameplate.rated_voltage
        ranges = {emf: 2.5 * settings.speed_share * rated if rated else 50.0, **dict.fromkeys(sensors, _LOGIC)}
        found = []
        for way in (speed, -speed) if settings.both_ways else (speed,):
            with self.bench.dynamometer.driving_speed(way):
                waves = ranged_record(self.bench, ranges, 10.0 + record_time)
            self.bench.dynamometer.stop()
            signals = np.vstack([waves[channel].values for channel in sensors])
            switched, frequency = switching(waves[emf].time, waves[emf].values, signals, settings.least_swing)
            found.append(switched)
        self.findings["frequency"] = frequency
        forwards, backwards = found[0], found[-1]
        if settings.both_ways:
            forwards = [
                None if there is None or back is None else there.with_backwards(back)
                for there, back in zip(forwards, backwards, strict=True)
            ]
        return dict(zip(sensors.values(), forwards, strict=True))

    def _tell_lag(self, alive: Sequence[Switching]) -> None:
        """Tell the largest time by which the EMF was shown later than a sensor, or earlier, where both ways of turning show one."""
        late = [each for each in alive if abs(each.lag) > max(_LATE, _BEYOND * each.uncertainty)]
        if late:
            lag = max((each.lag for each in late), key=abs)
            self.findings["lag"] = math.degrees(lag)
            self.notice(
                "channel-delay",
                text(
                    "the EMF and the Hall sensors are shown {time:.3g} µs apart ({angle:.2g}° electrical): a probe, its filter or AC "
                    "coupling delays one of them, or the sensors switch with a hysteresis. Turning both ways takes this out of the "
                    "figures",
                    time=1e6 * abs(lag) / (2.0 * math.pi * self.findings["frequency"]),
                    angle=math.degrees(abs(lag)),
                ),
            )

    def _said(self, found: HallFinding) -> Text:
        match found.fault:
            case HallFault.DEAD:
                return text(
                    "H{lead} is dead: it does not switch by {least:g} V or more once an electrical turn; check its supply, its lead, and "
                    "the factor of the probe on it",
                    lead=found.lead,
                    least=self.settings.least_swing,
                )
            case HallFault.SWAPPED:
                return text("H{lead} shows sensor {sensor}: leads are swapped", lead=found.lead, sensor=found.carries)
            case HallFault.INVERTED:
                return text("H{lead} is inverted: high where it should be low", lead=found.lead)
