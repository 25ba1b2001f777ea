"""Wires and probes elsewhere than told: every procedure says so before anything rests on it, through the real drivers."""

from dataclasses import dataclass, field
from typing import Any

import pytest

from bench.journal.codec import data_of
from bench.motor.motor_file import load_motor
from bench.operators.virtual import VirtualOperator
from bench.plugins.catalogues import installed
from bench.run.plan import make_plan
from bench.safety.station_instruments import StationInstruments
from bench.station.visa_library import StationVisa
from bench.virtual.virtual_station import virtual_station
from procedures.core.actions import Action, Mend
from procedures.core.bench import Bench
from procedures.core.events import Event
from procedures.core.nameplate import Nameplate
from procedures.estimation.fitting.intervals import Interval
from procedures.verification.verifier import WiringError
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.disturbances.bench import Disturbances
from sim_instruments.disturbances.channel import ChannelPath
from tests.studies.worlds.measured_motor import NoRecord

MOTOR = "lg-400w"
#: Lines (Ω) of this motor and the leads of the virtual bench, as a run that has measured them knows them.
LINES, LEADS = (0.0322, 0.0317, 0.0321), Interval(0.0035, 0.0045)


class Record(NoRecord):
    def __init__(self) -> None:
        self.events: list[tuple[str, dict[str, Any]]] = []

    def record(self, event: Event) -> None:
        self.events.append((event.kind, data_of(event)))


@dataclass
class Mending:
    """Hands that mend what they are told to, by having every slip gone, and do all else on the virtual bench."""

    hands: VirtualOperator
    mend: Any
    asked: list[Mend] = field(default_factory=list)

    def perform(self, action: Action) -> object:
        if isinstance(action, Mend):
            self.asked.append(action)
            self.mend()
            return True
        return self.hands.perform(action)


@pytest.fixture
def motor():
    return MOTOR


@pytest.fixture
def disturbances():
    return Disturbances()


@pytest.fixture
def bench(motor, disturbances):
    file, setting = load_motor(motor), BenchSetting(disturbances=disturbances)
    with VirtualBench(file.virtual_motor(), setting=setting, seed=2, sockets=False, six_step=file.six_step) as virtual:
        yield virtual


class Measuring:
    """Runs one procedure at a time on the bench as it was prepared; `taught` is a run that has measured the lines before."""

    def __init__(self, bench: VirtualBench, instruments: StationInstruments, record: Record, plate: Nameplate) -> None:
        self._bench = bench
        self._instruments = instruments
        self._record = record
        self._plate = plate

    @property
    def events(self) -> list[tuple[str, dict[str, Any]]]:
        return self._record.events

    def __call__(self, name: str, *, taught: bool = True, operator: Any = None, settings: tuple[str, ...] = ()) -> Any:
        (planned,) = make_plan([name], settings, installed().procedures)
        hands = operator or VirtualOperator(self._bench.world, 2)
        bench = Bench(self._instruments.available(), hands, self._bench.clock, self._record)
        if taught:
            bench.state.lines.read_by_bridge(LINES, 0.1, 20.0)
            bench.state.lines.read_by_four_wires(LINES, 0.005)
            bench.state.lines.seen_leads(LEADS)
        return planned.procedure(bench, self._plate, planned.settings, {}).run()


@pytest.fixture
def measure(bench, motor):
    record, plate = Record(), load_motor(motor).nameplate
    instruments = StationInstruments(
        virtual_station(bench.addresses()),
        plate,
        bench.clock,
        record,
        record,
        StationVisa(bench.visa_library),
        lambda _: None,
        in_process=bench,
    )
    yield Measuring(bench, instruments, record, plate)
    instruments.close()


def refused(measure, name, **how) -> str:
    with pytest.raises(WiringError) as found:
        measure(name, **how)
    return str(found.value)


def on_channel_1(**path: float) -> Disturbances:
    return Disturbances({1: ChannelPath(**path)})


def outcomes(result) -> list[str]:
    return [entry["outcome"] for entry in result.findings["wiring"]]


SUPPLY_AND_BRIDGE = (
    "pole-pairs-static",
    "stator-resistance",
    "stator-resistance-dc",
    "dq-inductance-extremes",
    "dq-inductance-aligned",
    "dq-inductance-time-constant",
)


@pytest.mark.parametrize("name", SUPPLY_AND_BRIDGE)
def test_an_open_phase_that_carries_all_current_stops_every_procedure(bench, measure, name):
    bench.world.set_open_phase("A")
    said = refused(measure, name)
    assert "A (white)" in said
    assert "open" in said
    assert not bench.world.truth()["energised"]
    # Nothing beyond a few per cent of the rated 29 A was ever set.
    levels = [data["arguments"][1] for kind, data in measure.events if kind == "energising"]
    assert all(level <= 0.051 * 29.0 for level in levels)


@pytest.mark.parametrize("terminal", ["B", "C"])
@pytest.mark.parametrize("name", ["dq-inductance-aligned", "dq-inductance-time-constant"])
def test_one_of_two_parallel_wires_missing_is_named_before_anything_is_read(bench, measure, name, terminal):
    bench.world.miswirings.wire(terminal, "open")
    said = refused(measure, name)
    assert "B (green), C (black)" in said
    assert "the supply reads 0.036" in said


def test_the_open_terminal_that_is_connected(bench, measure):
    bench.world.miswirings.wire("A", "supply+", 5)
    assert "A (white) is connected, and should be open" in refused(measure, "dq-inductance-aligned")


@pytest.mark.parametrize(
    ("occasion", "terminal", "socket", "said"),
    [(2, "B", "open", "B (green), C (black)"), (3, "C", "lcr_low", "C (black) is connected, and should be open")],
)
@pytest.mark.parametrize("taught", [True, False])
def test_bridge_on_an_aligned_rotor(bench, measure, occasion, terminal, socket, said, taught):
    bench.world.miswirings.wire(terminal, socket, occasion)
    found = refused(measure, "dq-inductance-aligned", taught=taught)
    if taught:
        assert said in found
    else:
        # Two readings differ as they should not: it is one or the other.
        assert "C (black) is connected" in found
        assert "in the previous connection, B (green) is open" in found


def test_bridge_between_two_lines(bench, measure):
    bench.world.miswirings.wire("C", "lcr_low")
    assert "C (black) is connected" in refused(measure, "dq-inductance-extremes")


@pytest.mark.parametrize(("occasion", "third"), [(1, "C (black)"), (2, "A (white)"), (3, "B (green)")])
def test_three_lines_tell_each_other(bench, measure, occasion, third):
    bench.world.miswirings.wire("CAB"[occasion - 1], "lcr_low", occasion)
    assert f"{third} is connected, and should be open" in refused(measure, "stator-resistance", taught=False)


def test_clipped_bridge_leads_are_no_winding(bench, measure):
    bench.world.connect({"A": "lcr_high", "B": "lcr_low"})
    clip = bench.world.short_leads
    # Nobody takes them apart.
    bench.world.short_leads = lambda _shorted: clip(True)
    assert "two leads touch each other" in refused(measure, "stator-resistance")


@pytest.mark.parametrize("taught", [True, False])
def test_voltmeter_the_wrong_way_round(bench, measure, taught):
    bench.world.miswirings.voltage_leads(None, "B", "A")
    said = refused(measure, "stator-resistance-dc", taught=taught)
    assert "voltmeter" in said
    assert "are interchanged" in said


def test_voltmeter_on_the_open_terminal_or_nothing(bench, measure):
    bench.world.miswirings.voltage_leads(None, "C", None)
    assert "the voltmeter's high lead is on C (black) instead of A (white)" in refused(measure, "stator-resistance-dc")
    bench.world.miswirings.voltage_leads(None, None, "loose")
    assert "the voltmeter's low lead does not touch B (green)" in refused(measure, "stator-resistance-dc")


@pytest.mark.parametrize(
    ("leads", "said"),
    [
        (("B", "A"), "channel 1: tip and reference, or high and low, are interchanged"),
        ((None, "loose"), "the reference of channel 1 does not touch B (green)"),
        (("C", None), "the tip of channel 1 is on C (black) instead of A (white)"),
    ],
)
def test_voltage_probe_of_a_step(bench, measure, leads, said):
    bench.world.miswirings.voltage_leads(1, *leads)
    assert said in refused(measure, "dq-inductance-time-constant")


@pytest.mark.parametrize(
    ("disturbances", "procedure", "said"),
    [
        (on_channel_1(coupling_corner=5.0), "dq-inductance-time-constant", "or channel 1 is AC coupled, or its zero"),
        (on_channel_1(factor=0.1), "back-emf-constant", "channel 1 shows a tenth of what the others show"),
    ],
)
def test_a_channel_that_is_set_otherwise_is_not_only_sought_elsewhere(measure, procedure, said):
    assert said in refused(measure, procedure)


@pytest.mark.parametrize("disturbances", [on_channel_1(factor=0.7)])
def test_channels_that_fit_no_mistake_are_not_blamed_on_the_supply_s_leads(measure):
    (warning,) = (w for w in measure("back-emf-constant").warnings if w.identifier == "wiring")
    assert "a probe's factor that is not the one set" in str(warning.message)


def test_current_probe_of_a_step(bench, measure):
    bench.world.miswirings.current_probe(4, turned=True)
    assert "channel 4: the current probe's arrow points away" in refused(measure, "dq-inductance-time-constant")
    bench.world.miswirings.current_probe(4, "B")
    assert "round the wire of B (green) instead of A (white)" in refused(measure, "dq-inductance-time-constant")


@pytest.mark.parametrize("terminal", ["B", "C"])
def test_a_probe_tells_which_of_two_parallel_wires_is_missing(bench, measure, terminal):
    bench.world.miswirings.wire(terminal, "open", 2)
    said = refused(measure, "dq-inductance-time-constant")
    assert f"the wiring is wrong: {terminal} (" in said
    assert "is open" in said


def test_as_told_is_verified(measure):
    result = measure("dq-inductance-time-constant")
    assert set(outcomes(result)) <= {"verified", "not verified"}
    by_probes = [entry for entry in result.findings["wiring"] if entry["by"] == "oscilloscope"]
    assert [entry["outcome"] for entry in by_probes] == ["verified", "verified"]
    assert by_probes[0]["terminals"] == {"A": "supply-", "B": "supply+", "C": "supply+"}
    assert [kind for kind, _ in measure.events].count("wiring_checked") == len(outcomes(result))


def test_interchanged_wires_that_read_the_same_are_listed_and_not_accused(bench, measure):
    bench.world.miswirings.exchange("B", "C", None)
    result = measure("dq-inductance-time-constant")
    entry = next(e for e in result.findings["wiring"] if e["outcome"] == "verified" and e["by"] == "supply")
    assert {"kind": "exchanged", "terminals": ["A", "B"]} in entry["possible"]


def test_what_is_mended_is_measured_again(bench, measure):
    bench.world.miswirings.wire("B", "open")
    told = {"A": "lcr_high", "B": "lcr_low"}
    hands = Mending(VirtualOperator(bench.world, 2), lambda: bench.world.connect(told))
    result = measure("dq-inductance-extremes", operator=hands)
    assert outcomes(result) == ["wrong", "verified"]
    (mend,) = hands.asked
    assert "B (green)" in str(mend.finding)
    assert "B (green) → LCR meter, low" in [str(line) for line in mend.wanted]


def test_it_is_not_asked_for_ever(bench, measure):
    bench.world.set_open_phase("B")
    hands = Mending(VirtualOperator(bench.world, 2), lambda: None)
    with pytest.raises(WiringError):
        measure("dq-inductance-extremes", operator=hands, settings=("wiring_attempts=4",))
    assert len(hands.asked) == 3


def test_wires_interchanged_while_aligning_show_by_where_the_rotor_stands(bench, measure):
    bench.world.miswirings.exchange("A", "B")
    said = refused(measure, "dq-inductance-aligned")
    assert "A (white) and B (green) are interchanged, or C (black) is on the instrument's other pole" in said
    assert "stands at -6" in said


def test_one_polarity_on_another_terminal_shows_without_knowing_the_lines(bench, measure):
    bench.world.miswirings.wire("C", "supply-")
    said = refused(measure, "stator-resistance-dc", taught=False)
    assert "C (black) is connected as well, or a lead of the supply or the voltmeter is on it by mistake" in said


@pytest.mark.parametrize(
    ("channel", "leads", "said"),
    [
        (1, ("B", None), "the tip of channel 1 is on B (green)"),
        (2, ("loose", None), "channel 2 shows no voltage"),
        (3, (None, "A"), "the reference of channel 3 is on A (white), not on the artificial star point"),
        (1, ("star", "A"), "channel 1: tip and reference are interchanged"),
    ],
)
def test_probes_of_the_turned_motor(bench, measure, channel, leads, said):
    bench.world.miswirings.voltage_leads(channel, *leads)
    assert said in refused(measure, "back-emf-constant")
    # Found while turning slowly, and at rest for whoever mends it.
    assert max(data["arguments"][0] for kind, data in measure.events if kind == "energising") < 40.0
    assert abs(bench.world.truth()["shaft_speed"]) < 0.1


def test_terminals_that_should_be_open(bench, measure):
    bench.world.miswirings.wire("A", "lcr_low")
    bench.world.miswirings.wire("B", "lcr_low")
    assert "A (white) and B (green) are connected to each other" in refused(measure, "back-emf-constant")


def test_labels_that_are_interchanged_are_a_notice(bench, measure):
    bench.world.set_swapped(("B", "C"))
    result = measure("back-emf-constant")
    assert "phase-order" in {notice.identifier for notice in result.warnings}
    assert outcomes(result) == ["verified"]
    assert result.findings["wiring"][0]["reason"] == "sequence"


def test_one_probe_that_touches_nothing(bench, measure):
    bench.world.miswirings.voltage_leads(1, "loose", None)
    assert "channel 1 shows no voltage" in refused(measure, "pole-pairs-back-emf")


@pytest.mark.parametrize("name", ["pole-pairs-inverter", "torque-constant"])
def test_a_wire_missing_at_the_inverter(bench, measure, name):
    bench.world.set_open_phase("B")
    said = refused(measure, name)
    assert "the inverter switches itself off: look for a wire that is off or interchanged" in said
    assert not bench.world.truth()["energised"]


def test_two_wires_interchanged_at_the_inverter(bench, measure):
    bench.world.miswirings.exchange("A", "B")
    said = refused(measure, "torque-constant")
    assert "two of the three wires are interchanged, or the dynamometer turns the other way" in said
    # A twentieth of the rated 29 A has shown it.
    currents = [
        data["arguments"][0]
        for kind, data in measure.events
        if kind == "energising" and data["instrument"] == "inverter"
    ]
    assert currents == [pytest.approx(1.45)]


def test_a_current_probe_round_no_wire_at_the_inverter(bench, measure):
    attach = bench.world.attach_current_probe
    bench.world.attach_current_probe = lambda *_: None
    assert "channel 4: the current probe is round no wire, or switched off, or A (white) is open" in refused(
        measure, "pole-pairs-inverter"
    )
    bench.world.attach_current_probe = attach


def test_open_terminals_stay_verified_while_nobody_touches_them(bench, measure):
    assert outcomes(measure("inertia")) == ["not verified"]


SIX_STEP = "92bl-30-25l"
LOADED = ("loads=[0.3,0.5,0.7]", "winding_resistance=0.4", "winding_inductance=0.0005")


@pytest.mark.parametrize("motor", [SIX_STEP])
def test_a_six_step_drive_that_does_not_start(bench, measure):
    bench.world.set_open_phase("A")
    said = refused(measure, "equivalent-resistance", settings=LOADED)
    assert "the drive switches itself off" in said
    assert "0x7122" in said


@pytest.mark.parametrize("motor", [SIX_STEP])
def test_no_current_probe_on_a_running_six_step_drive(bench, measure):
    bench.world.attach_current_probe = lambda *_: None
    said = refused(measure, "equivalent-resistance", settings=LOADED)
    assert "channel 4: the current probe is round no wire" in said
    assert not bench.world.truth()["energised"]


def test_phases_against_the_windings_own_star_point(bench, measure):
    bench.world.star_point_accessible = True
    measured = measure("back-emf-constant", settings=("probing=neutral",))
    assert outcomes(measured) == ["verified"]
    assert measured.parameter("flux_linkage").value == pytest.approx(
        measure("back-emf-constant").parameter("flux_linkage").value, rel=1e-3
    )
