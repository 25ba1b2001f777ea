"""Every defect that is tried on a plan, at its severities, each graded by what it costs the motor's function."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from bench.eol.defects.function_cost import FAILS, FunctionCost, RatedPoint, function_cost
from bench.eol.line.workers.virtual_socket import Specimen
from drivers.interfaces.text import Text, text
from sim_instruments.faults.description import Description
from sim_instruments.faults.on_bench import OpenPhase, StuckRelay
from sim_instruments.faults.on_hands import MisPlaced
from sim_instruments.physics.motor import defects
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.six_step.drive import SixStepDrive
from sim_instruments.six_step.machine import driven
from sim_instruments.world.fixture.layout import crosspoints

Change = Callable[[VirtualMotor], VirtualMotor]

#: Severities as shares; of drag and cogging of the type's rated torque.
_JOINT, _WEAK, _POLE, _TURNS, _SHORTED = (
    (0.05, 0.15, 0.3, 1.0),
    (0.03, 0.07, 0.12, 0.25),
    (0.2, 0.5, 1.0),
    (0.02, 0.06, 0.15),
    (0.02, 0.05, 0.15),
)
_DRAG, _COGGING = (0.01, 0.025, 0.06, 0.15), (0.01, 0.025, 0.06)
_INSULATION, _HALL_ANGLES, _REWOUND = (5.0e7, 1.0e7, 1.0e6, 1.0e4), (3.0, 8.0, 20.0), (0.87, 0.95, 1.05, 1.15)


@dataclass(frozen=True)
class DefectCase:
    """One defect at one severity: how it is named, what is made of a drawn motor, and what it costs."""

    defect: str
    label: Text
    severity: Text
    specimen: Specimen
    cost: FunctionCost

    @property
    def key(self) -> str:
        """The seed of its random numbers."""
        return f"{self.defect} {self.severity.render()}"


@dataclass(frozen=True)
class DefectCases:
    """The cases of a type, and by label the defects that it cannot have here."""

    cases: tuple[DefectCase, ...]
    left_out: tuple[Text, ...]


def defect_cases(motor: VirtualMotor, drive: SixStepDrive | None, rating: RatedPoint, *, fixture: bool) -> DefectCases:
    """Return what is tried on motors of a type; without a `fixture`, hands leave a probe off."""
    found, left_out = [], dict[str, Text]()
    for defect, label, severity, change in _changes(motor, rating):
        try:
            bad = change(motor)
            if drive is not None:
                driven(drive, bad)
        except ValueError:
            left_out[label.render()] = label
            continue
        found.append(DefectCase(defect, label, severity, Specimen(change), function_cost(motor, bad, rating)))
    if motor.halls is None:
        left_out["Hall"] = text("Hall sensor")
    found += [
        DefectCase(
            "open-phase",
            text("open phase"),
            text("a wire"),
            _faulty(OpenPhase(fault="open_phase", terminal="B")),
            FAILS,
        )
    ]
    found += [
        DefectCase("probe-off", text("probe left off"), severity, _faulty(*faults), FAILS)
        for severity, faults in _probes(fixture=fixture)
    ]
    return DefectCases(tuple(found), tuple(left_out.values()))


def _faulty(*faults: Description) -> Specimen:
    return Specimen(faults=faults)


def _changes(motor: VirtualMotor, rating: RatedPoint) -> Iterator[tuple[str, Text, Text, Change]]:
    torque = rating.torque(motor)

    def each(
        defect: str, label: Text, change: Callable[..., VirtualMotor], severities: Sequence[float], unit: float = 1.0
    ) -> Iterator[tuple[str, Text, Text, Change]]:
        for share in severities:
            yield defect, label, Text("{share:g} %", {"share": 100.0 * share}), partial(_with, change, share * unit)

    yield from each("bad-joint", text("bad joint"), defects.bad_joint, _JOINT)
    yield from each("weak-magnets", text("weak magnets"), defects.weak_magnets, _WEAK)
    yield from each("weak-pole", text("weak pole"), defects.weak_pole, _POLE)
    yield "reversed-magnet", text("reversed magnet"), text("one pole"), partial(_with, defects.weak_pole, 2.0)
    yield from each("missing-turns", text("turns missing, one"), defects.missing_turns, _TURNS)
    yield from each("fewer-turns", text("turns missing, all"), defects.fewer_turns, _TURNS)
    yield from each("shorted-turns", text("shorted turns"), defects.shorted_turns, _SHORTED)
    yield "swapped-wires", text("swapped wires"), text("two"), defects.exchanged
    yield from each("tight-bearing", text("tight bearing"), defects.tight_bearing, _DRAG, torque)
    yield from each("rubbing", text("rotor rubs"), defects.rubbing, _DRAG, 2.0 * torque)
    yield from each("cogging", text("cogging"), defects.cogging, _COGGING, torque)
    for resistance in _INSULATION:
        severity = Text("{resistance:g} MΩ", {"resistance": 1e-6 * resistance})
        yield "insulation", text("insulation"), severity, partial(_with, defects.insulation, resistance)
    for ratio in _REWOUND:
        severity = text("turns × {ratio:g}", ratio=ratio)
        yield "wrong-type", text("wrong type"), severity, partial(_with, defects.rewound, ratio)
    yield "wrong-type", text("wrong type"), text("a pole pair more"), defects.other_poles
    if motor.halls is None:
        return
    halls = text("Hall sensor")
    yield "hall-stuck", halls, text("stuck low"), partial(_with, defects.hall_stuck, "low")
    yield "hall-stuck", halls, text("stuck high"), partial(_with, defects.hall_stuck, "high")
    yield "hall-missing", halls, text("all missing"), defects.hall_missing
    yield "hall-inverted", halls, text("inverted"), defects.hall_inverted
    yield "hall-leads", halls, text("leads exchanged"), defects.hall_exchanged
    for angle in _HALL_ANGLES:
        radians = math.radians(angle)
        misplaced = text("one off by {angle:g}°", angle=angle)
        yield "hall-place", halls, misplaced, partial(_with, defects.hall_misplaced, radians)
        yield (
            "hall-offset",
            halls,
            text("all off by {angle:g}°", angle=angle),
            partial(_with, defects.hall_turned, radians),
        )


def _with(change: Callable[..., VirtualMotor], severity: object, motor: VirtualMotor) -> VirtualMotor:
    return change(motor, severity)


def _probes(*, fixture: bool) -> Iterator[tuple[Text, tuple[Description, ...]]]:
    """Give the leads that can be left off, each with the faults that say so."""
    channels = [text("channel {channel}", channel=channel) for channel in (1, 2, 3)]
    if not fixture:
        yield text("voltmeter"), (MisPlaced(fault="mis_placed", positive="loose"),)
        for channel, label in enumerate(channels, 1):
            yield label, (MisPlaced(fault="mis_placed", channel=channel, positive="loose"),)
        return
    leads = {"voltmeter+": text("voltmeter"), "lcr_high": text("LCR meter")}
    leads |= {f"channel{channel}+": label for channel, label in enumerate(channels, 1)}
    for lead, label in leads.items():
        names = [name for name in crosspoints() if name.endswith(f":{lead}")]
        yield label, tuple(StuckRelay(fault="stuck_relay", crosspoint=name, closed=False) for name in names)
