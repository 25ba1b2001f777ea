"""When faults begin and mend: time, message, step."""

import pickle
from typing import Any

import pytest
from pydantic import ValidationError

from sim_instruments.bench import VirtualBench
from sim_instruments.faults.catalogue import FAULT, kinds


def add(bench: VirtualBench, **described: Any) -> None:
    bench.injector.add(FAULT.validate_python(described))


def stuck(bench: VirtualBench) -> bool:
    return bool(bench.world.truth()["faults"]["stuck_rotor"])


def states(bench: VirtualBench) -> list[str]:
    return [entry["state"] for entry in bench.injector.listed()]


def test_at_a_time_exactly_however_far_time_jumps(virtual_bench: VirtualBench) -> None:
    world = virtual_bench.world
    world.turn_shaft(10.0)
    add(virtual_bench, fault="stuck_rotor", at=2.5, after=0.5, duration=1.0)
    assert states(virtual_bench) == ["waiting"]
    virtual_bench.clock.sleep(10.0)
    assert states(virtual_bench) == ["over"]
    # It stood for one second of ten.
    assert world.dial_angle() == pytest.approx(90.0)


def test_what_nothing_has_felt_is_told(virtual_bench: VirtualBench) -> None:
    add(virtual_bench, fault="stuck_rotor", at=20.0)
    add(virtual_bench, fault="stuck_rotor", step="3.2.2/3")
    add(virtual_bench, fault="silence", role="supply", pattern="MEAS")
    virtual_bench.clock.sleep(30.0)
    assert [one["fault"] for one in virtual_bench.injector.unfelt()] == ["stuck_rotor", "silence"]
    virtual_bench.injector.step_started("3.2.2/3")
    virtual_bench.instrument("supply").write(b"MEAS:VOLT?\n")
    assert virtual_bench.injector.unfelt() == []


def test_a_time_that_has_passed_is_now(virtual_bench: VirtualBench) -> None:
    virtual_bench.clock.sleep(5.0)
    add(virtual_bench, fault="stuck_rotor", at=2.0)
    assert stuck(virtual_bench)


def test_at_the_nth_message_before_it_is_acted_on(virtual_bench: VirtualBench, visa: Any) -> None:
    supply = visa("supply")
    add(virtual_bench, fault="motor_unplugged", message={"role": "supply", "count": 3})
    for number in range(1, 5):
        supply.write("VOLT 1")
        assert virtual_bench.world.truth()["faults"]["unplugged"] is (number >= 3)


def test_at_a_message_of_another_instrument(virtual_bench: VirtualBench, visa: Any) -> None:
    supply, meter = visa("supply"), visa("voltmeter")
    message = {"role": "supply", "pattern": "outp on"}
    add(virtual_bench, fault="replace", role="voltmeter", reply="x\n", message=message, after=1.0, duration=1.0)
    supply.write("OUTP OFF")
    virtual_bench.clock.sleep(2.0)
    assert meter.query("*OPC?") == "1"
    supply.write("OUTP ON")
    assert meter.query("*OPC?") == "1"
    virtual_bench.clock.sleep(1.0)
    assert meter.query("*OPC?") == "x"
    virtual_bench.clock.sleep(1.0)
    assert meter.query("*OPC?") == "1"


def test_at_a_step_of_a_procedure(virtual_bench: VirtualBench) -> None:
    injector = virtual_bench.injector
    add(virtual_bench, fault="stuck_rotor", step="3.2.2/1", procedure="stator-resistance", occurrence=2, after=1.0)
    injector.step_started("3.2.2/1", "other")
    injector.step_started("3.2.2/2", "stator-resistance")
    injector.step_started("3.2.2/1", "stator-resistance")
    virtual_bench.clock.sleep(5.0)
    assert states(virtual_bench) == ["waiting"]
    injector.step_started("3.2.2/1", "stator-resistance")
    assert not stuck(virtual_bench)
    virtual_bench.clock.sleep(1.0)
    assert stuck(virtual_bench)
    injector.step_started("3.2.2/1", "stator-resistance")
    assert states(virtual_bench) == ["present"]


def test_what_begins_and_mends_is_told(virtual_bench: VirtualBench) -> None:
    heard: list[tuple[str, Any]] = []
    virtual_bench.injector.listen(lambda kind, fault: heard.append((kind, fault)))
    described = {"fault": "open_phase", "terminal": "A", "at": 1.0, "duration": 1.0}
    add(virtual_bench, **described)
    virtual_bench.clock.sleep(5.0)
    assert heard == [("fault_began", described), ("fault_mended", described)]


def test_clearing_mends_what_is_there_and_forgets_what_waits(virtual_bench: VirtualBench, visa: Any) -> None:
    add(virtual_bench, fault="stuck_rotor")
    add(virtual_bench, fault="open_phase", terminal="A", at=5.0)
    add(virtual_bench, fault="open_phase", terminal="B", message={"role": "supply", "pattern": "VOLT"})
    add(virtual_bench, fault="silence", role="supply", after=2.0)
    virtual_bench.injector.clear()
    visa("supply").write("VOLT 1")
    virtual_bench.clock.sleep(10.0)
    assert not any(virtual_bench.world.truth()["faults"].values())
    assert not virtual_bench.faults("supply")


def test_a_line_fault_counts_from_its_own_beginning(virtual_bench: VirtualBench, visa: Any) -> None:
    supply = visa("supply")
    add(virtual_bench, fault="replace", role="supply", reply="never\n", count=100)
    assert supply.query("*OPC?") == "1"
    add(virtual_bench, fault="replace", role="supply", reply="now\n", count=2)
    assert [supply.query("*OPC?") for _ in range(3)] == ["1", "now", "1"]


@pytest.mark.parametrize("kind", sorted(kinds()))
def test_descriptions_can_be_pickled_and_told(kind: str) -> None:
    more = {"role": "supply"} if "role" in kinds()[kind].model_fields else {}
    if kind == "speed_runaway":
        more = {"role": "inverter"}
    if kind == "open_phase":
        more = {"terminal": "A"}
    if kind == "swapped":
        more = {"pair": ["A", "B"]}
    if kind == "mis_clipped":
        more = {"terminal": "A", "socket": "open"}
    if kind == "stuck_relay":
        more = {"crosspoint": "A:supply+"}
    if kind == "mis_clamped":
        more = {"channel": 4, "turned": True}
    given = {"fault": kind, "step": "3.2.2/1", **more}
    described = FAULT.validate_python(given)
    assert pickle.loads(pickle.dumps(described)) == described  # noqa: S301
    assert described.told() == given


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({"fault": "stuck_rotor", "at": 1.0, "step": "3.2.2/1"}, "at and step are both given"),
        ({"fault": "stuck_rotor", "procedure": "x"}, "procedure belongs to step"),
        ({"fault": "stuck_rotor", "occurrence": 2}, "occurrence belongs to step"),
        ({"fault": "stuck_rotor", "after": -1.0}, "greater than or equal to 0"),
        ({"fault": "stuck_rotor", "duration": "1"}, "duration"),
        ({"fault": "stuck_rotor", "message": {"role": "supply"}}, "either pattern or count"),
        ({"fault": "silence", "role": "supply", "at": 1.0, "delay": 1.0}, "delay belongs to late"),
        ({"fault": "silence", "role": "supply", "at": 1.0, "reply": "x"}, "reply belongs to replace"),
        ({"fault": "silence", "role": "supply", "pattern": "x", "times": "often"}, "'always'"),
        ({"fault": "silence", "role": "supply", "at": 1.0, "code": 2}, "code belongs to exception"),
        ({"fault": "speed_runaway", "role": "supply"}, "'dynamometer' or 'inverter'"),
        ({"fault": "current_limited", "current": 0.0}, "greater than 0"),
    ],
)
def test_descriptions_that_are_refused(given: dict[str, Any], named: str) -> None:
    with pytest.raises(ValidationError, match=named):
        FAULT.validate_python(given)


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({"fault": "silence", "role": "drive", "count": 1}, "role 'drive' is unknown"),
        ({"fault": "exception", "role": "supply", "count": 1}, "exception is nothing that role 'supply' can have"),
        ({"fault": "wrong_channel", "role": "lcr_meter"}, "allowed: supply, oscilloscope"),
        ({"fault": "bus_off", "role": "supply"}, "allowed: inverter"),
        ({"fault": "disconnect", "role": "inverter"}, "allowed: supply"),
        ({"fault": "stuck_output", "role": "tachometer"}, "no output that could stick"),
        ({"fault": "stuck_rotor", "message": {"role": "kettle", "count": 1}}, "role 'kettle' is unknown"),
    ],
)
def test_what_this_bench_cannot_have_is_refused_at_once(
    virtual_bench: VirtualBench, given: dict[str, Any], named: str
) -> None:
    with pytest.raises(ValueError, match=named):
        add(virtual_bench, **given)
    assert virtual_bench.injector.listed() == []


def test_hands_that_slip_and_hands_that_do_not(virtual_bench: VirtualBench) -> None:
    world = virtual_bench.world
    add(virtual_bench, fault="mis_clipped", terminal="B", socket="open", connection=2)
    add(virtual_bench, fault="mis_clipped", terminal="A", exchanged_with="C", connection=None)
    told = {"A": "supply+", "B": "supply-"}
    seen = []
    for _ in range(3):
        world.connect(told)
        seen.append(world.truth()["wiring"])
    right = {"A": "open", "B": "supply-", "C": "supply+"}
    assert seen == [right, {**right, "B": "open"}, right]
    virtual_bench.injector.clear()
    world.connect(told)
    assert world.truth()["wiring"] == {"A": "supply+", "B": "supply-", "C": "open"}


def test_probes_that_slip(virtual_bench: VirtualBench) -> None:
    world = virtual_bench.world
    add(virtual_bench, fault="mis_placed", channel=1, negative="loose")
    add(virtual_bench, fault="mis_clamped", channel=4, turned=True)
    world.attach_voltage_probe(1, "A", "B")
    world.attach_voltage_probe(2, "A", "B")
    world.attach_current_probe(4, "A")
    world.connect({"A": "supply+", "B": "supply-"})
    world.lock_rotor()
    world.supply.set_voltage(1.0)
    world.supply.set_current_limit(0.5)
    world.supply.switch(True)
    world.clock.sleep(1.0)
    now = [world.clock.now()]
    assert world.probe_signal(1, now)[0] == 0.0
    assert world.probe_signal(2, now)[0] > 0.0
    assert world.probe_signal(4, now)[0] == pytest.approx(-0.5)
