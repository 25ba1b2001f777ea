"""What hands hold, and what is on meanwhile, over random orders of procedures.

`python -m tests.studies.hands --plans N --seed S`

Each plan is a random order of randomly chosen procedures, end of line included, carried out by the real drivers on a virtual bench with
every role. Every single change of a lead is followed, and looked at with rules of the study's own: two sources, or two leads of
one source, are never on one terminal; a lead is put on only where it is off, and taken off only where it is on; meters are on before a
source; whenever something is switched on, only what may see its voltage is on the motor; and while something is on, hands are asked
to the shaft alone. A plan goes on after a procedure that fails, as hands do not know what comes next.
"""

import argparse
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bench.journal.events.instruments import Commanding, DeEnergised, Energising, ReadingTaken
from bench.motor.motor_file import load_motor
from bench.operators.virtual import VirtualOperator
from bench.plugins.catalogues import installed
from bench.run.feeding import FeedingRoles
from bench.run.plan import make_plan
from bench.safety.shutdown import shut_down
from bench.safety.station_instruments import StationInstruments
from bench.station.shutdown_sequence import ShutdownSequence
from bench.station.visa_library import StationVisa
from bench.virtual.virtual_station import dq_inverter_for, virtual_station
from drivers.interfaces import InstrumentError
from procedures.core.bench import Bench, ProcedureError
from procedures.core.events import ActionStarted, Event, StepStarted
from procedures.core.parameter_set import merge
from procedures.core.result import ProcedureResult
from procedures.core.setup_change import Change, ChangeSetup
from procedures.estimation.fitting.fit import EstimationError
from sim_instruments.bench import VirtualBench
from sim_instruments.catalogue import standard_units
from tests.studies.faulty.fault_cases import DRIVEN_MOTOR, SETTINGS
from tests.studies.worlds.measured_motor import NoRecord

#: A motor with Hall sensors and a six-step drive, so that every procedure can be carried out.
MOTOR = DRIVEN_MOTOR
#: What may be on the motor while a role is on, by the first letters of its leads.
_BESIDE: Mapping[str, frozenset[str]] = {
    "supply": frozenset({"supply", "voltmeter", "channel"}),
    "inverter": frozenset({"inverter", "channel"}),
    "drive": frozenset({"drive", "channel"}),
    "dynamometer": frozenset({"inverter", "drive", "channel", "link"}),
    "insulation_tester": frozenset({"insulation"}),
    "lcr_meter": frozenset({"lcr"}),
}
_METERS = frozenset({"voltmeter", "channel"})
#: Leads that feed nothing by themselves.
_PASSIVE = _METERS | {"link"}


def kind_of(lead: str) -> str:
    """Return what a lead belongs to, as the rules here call it."""
    return next(
        kind for kind in ("supply", "lcr", "inverter", "drive", "insulation", "link", *_METERS) if lead.startswith(kind)
    )


@dataclass
class Watch(NoRecord):
    """Hears the events of a plan; `violations` are sentences."""

    contacts: set[tuple[str, str]] = field(default_factory=set)
    coupled: bool = False
    known: bool = False
    on: Counter[str] = field(default_factory=Counter)
    violations: list[str] = field(default_factory=list)
    changes: int = 0
    switched_on: int = 0
    step: str = ""
    feeding: FeedingRoles = field(default_factory=FeedingRoles)

    def record(self, event: Event) -> None:
        """Look at an event."""
        self.feeding.hear(event)
        match event:
            case StepStarted():
                self.step = event.step
            case ActionStarted(details=action):
                if any(count > 0 for count in self.on.values()) and not getattr(action, "at_shaft", False):
                    self._say(f"{type(action).__name__} while {dict(self.on)} is on: no page lets it be confirmed")
                if isinstance(action, ChangeSetup):
                    self._follow(action)
            case Energising():
                self.on[event.instrument] += 1
                self._look(event.instrument)
            case DeEnergised():
                self.on[event.instrument] -= 1
            case Commanding() if event.instrument == "insulation_tester":
                self._look(event.instrument)
            case ReadingTaken() if event.instrument == "lcr_meter" and self.contacts:
                self._look(event.instrument)

    def lost(self) -> None:
        """Count nothing as known, as after a procedure that failed."""
        self.contacts.clear()
        self.known, self.on = False, Counter()

    def _say(self, words: str) -> None:
        self.violations.append(f"{self.step}: {words}")

    def _look(self, role: str) -> None:
        self.switched_on += 1
        if role == "dynamometer" and not self.coupled:
            return
        if not self.known:
            self._say(f"{role} on, and nobody knows what is on the motor")
        for lead, place in sorted(self.contacts):
            if kind_of(lead) not in _BESIDE.get(role, frozenset()):
                self._say(f"{role} on with {lead} on {place}")

    def _follow(self, action: ChangeSetup) -> None:
        if [change.number for change in action.changes] != sorted(change.number for change in action.changes):
            self._say("lines out of order")
        sources_on = False
        for change in action.changes:
            self.changes += 1
            if any(count > 0 for count in self.on.values()) and (change.lead or "couple" in change.kind.value):
                self._say(f"{change.kind.value} {change.lead} while {dict(self.on)} is on")
            self._apply(change)
            source = change.kind.value in ("put on", "move") and kind_of(change.lead) not in _PASSIVE
            if sources_on and change.kind.value == "put on" and not source:
                self._say(f"{change.lead} put on after a source")
            sources_on = sources_on or source
            self._together()
        if {(contact.lead, contact.place) for contact in action.after.contacts} != self.contacts and self.known:
            self._say(f"the changes lead to {sorted(self.contacts)}, told was {action.after.contacts}")

    def _apply(self, change: Change) -> None:
        here = (change.lead, change.place)
        match change.kind.value:
            case "clear":
                self.contacts.clear()
                self.known = True
            case "take off":
                if here not in self.contacts:
                    self._say(f"{here} taken off, where it is not")
                self.contacts.discard(here)
            case "put on" | "move":
                if change.origin and (change.lead, change.origin) not in self.contacts:
                    self._say(f"{change.lead} moved from {change.origin}, where it is not")
                self.contacts.discard((change.lead, change.origin))
                if here in self.contacts:
                    self._say(f"{here} put on twice")
                self.contacts.add(here)
            case "couple":
                self.coupled = True
                for lead, place in sorted(self.contacts):
                    if kind_of(lead) in ("supply", "lcr", "insulation", "voltmeter"):
                        self._say(f"coupled with {lead} on {place}")
            case "uncouple":
                self.coupled = False

    def _together(self) -> None:
        wires = [(lead, place) for lead, place in self.contacts if kind_of(lead) not in _METERS]
        if len({kind_of(lead) for lead, _ in wires}) > 1:
            self._say(f"two sources: {sorted(wires)}")
        if len({place for _, place in wires}) < len(wires):
            self._say(f"two leads on one terminal: {sorted(wires)}")
        if any(kind_of(lead) in ("lcr", "insulation") for lead, _ in wires) and len(wires) < len(self.contacts):
            self._say(f"company for one that is to be alone: {sorted(self.contacts)}")


def names() -> list[str]:
    """Return the procedures that plans are drawn from."""
    return [name for name, kind in installed().procedures.items() if not kind.manual]


def random_plan(random: np.random.Generator, longest: int) -> list[str]:
    """Return some procedures in a random order."""
    known = names()
    return [known[k] for k in random.permutation(len(known))[: int(random.integers(2, longest + 1))]]


def settings_of(plan: Sequence[str]) -> list[str]:
    """Return settings for what procedures need of others, which a short plan seldom has before them."""
    return [f"{name}.{setting}" for name in plan for setting in SETTINGS.get(name, ())]


def carried_out(plan: Sequence[str], seed: int) -> tuple[Watch, list[str], list[str]]:
    """Carry a plan out; return what was seen, the procedures that came to their end, and why others did not."""
    file, watch = load_motor(MOTOR), Watch()
    plate = replace(file.nameplate, insulation_test_voltage=500.0)
    ended, refused, results = list[str](), list[str](), list[ProcedureResult]()
    # One inverter turns a field at a frequency, the other regulates d and q: each plan has one of them.
    dq = dq_inverter_for(plate) if seed % 2 else None
    units = standard_units(six_step=True, fixture=True, dq_inverter=dq)
    with VirtualBench(
        file.virtual_motor(), units, seed=seed, six_step=file.six_step, sockets=False, fixture=True
    ) as virtual:
        instruments = StationInstruments(
            virtual_station(virtual.addresses(), dq),
            plate,
            virtual.clock,
            watch,
            watch,
            StationVisa(virtual.visa_library),
            lambda _: None,
            in_process=virtual,
        )
        available, hands = instruments.available(), VirtualOperator(virtual.world, seed)
        bench = Bench(available, hands, virtual.clock, watch, feeding=watch.feeding)
        for planned in make_plan(plan, settings_of(plan), installed().procedures):
            procedure = planned.procedure(bench, plate, planned.settings, merge(results).parameters)
            try:
                results.append(procedure.run())
                ended.append(planned.name)
            except (ProcedureError, EstimationError, InstrumentError) as reason:
                refused.append(f"{planned.name}: {reason}")
                shut_down(ShutdownSequence(), instruments.opened(), watch, virtual.clock)
                bench.state.forget()
                watch.lost()
        instruments.close()
    return watch, ended, refused


def main() -> None:
    """Carry plans out and print what was seen."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plans", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--longest", type=int, default=6, help="procedures of a plan at most")
    wanted = parser.parse_args()
    violations, counts, ended_by, reasons = 0, Counter[str](), Counter[str](), Counter[str]()
    for index in range(wanted.plans):
        plan = random_plan(np.random.default_rng([wanted.seed, index]), wanted.longest)
        watch, ended, refused = carried_out(plan, index)
        counts.update(changes=watch.changes, switched_on=watch.switched_on, procedures=len(plan), refused=len(refused))
        ended_by.update(ended)
        for violation in watch.violations:
            violations += 1
            print(f"plan {index} ({', '.join(plan)}): {violation}")
        reasons.update(refused)
    print(
        f"{wanted.plans} plans, {counts['procedures']} procedures ({counts['refused']} refused or failed), {counts['changes']} changes, "
        f"{counts['switched_on']} times on: {violations} violations"
    )
    for reason, count in reasons.most_common():
        print(f"{count} × {reason}")
    print("never to its end:", ", ".join(name for name in names() if not ended_by[name]) or "none")


if __name__ == "__main__":
    main()
