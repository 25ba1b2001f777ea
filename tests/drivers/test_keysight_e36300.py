"""E36300 supply: dialogue, limits, and the output that is off at the end whatever happens."""

from typing import Any

import pytest

from drivers.catalogue import Surroundings
from drivers.interfaces import (
    Accuracy,
    CommunicationError,
    IdentityError,
    MeasurementError,
    OutputMode,
    Regulated,
    ReportedError,
    SetpointError,
)
from drivers.keysight.e36300 import KeysightE36300, decode_regulation
from drivers.keysight.options import E36300Options
from tests.drivers.dialogue import played

ADDRESS = "TCPIP0::supply::inst0::INSTR"
IDENTITY = "Keysight Technologies,E36313A,MY61005055,2.1.0"


def test_dialogue_of_output_2(clock: Any) -> None:
    with played("keysight_e36313a", clock) as (surroundings, address):
        options = E36300Options(channel=2, serial_number="MY61005055")
        supply = KeysightE36300.open(address, options, surroundings, "supply")
        assert supply.identity.model == "E36313A"
        assert (supply.maximum_voltage, supply.maximum_current) == (25.75, 2.06)
        clock.time = 7.0
        supply.configure(1.2, 0.5)
        reading = supply.measure_voltage()
        assert (reading.value, reading.unit, reading.time) == (1.1999, "V", 7.0)
        assert reading.accuracy.gain == 3e-4
        assert "typical of its class" in reading.accuracy.source
        assert supply.output_mode() is OutputMode.CONSTANT_VOLTAGE  # 386 = 2 + bits of lists and logs
        with pytest.raises(MeasurementError, match="no value"):
            supply.measure_current()
        supply.make_safe()
        supply.close()


#: An output as it should have been left.
RIGHT = {
    "OUTP:PAIR?": "OFF",
    "OUTP:TRAC?": "0",
    "VOLT:MODE? (@1)": "FIX",
    "CURR:MODE? (@1)": "FIX",
    "VOLT:SENS? (@1)": "INT",
}
NOTHING_SET = {
    **RIGHT,
    "VOLT? (@1)": "0",
    "OUTP? (@1)": "0",
    "STAT:QUES:INST:ISUM1:COND?": "0",
    "VOLT:PROT:TRIP? (@1)": "0",
    "CURR:PROT:TRIP? (@1)": "0",
}


@pytest.fixture
def bench(manager: Any, connect: Any, settings_class: Any, clock: Any) -> Any:
    device = settings_class(IDENTITY, NOTHING_SET)
    wire = connect(ADDRESS, device)
    supply = KeysightE36300.open(
        ADDRESS,
        E36300Options(maximum_voltage=3.0, current_accuracy=Accuracy(offset=1e-3)),
        Surroundings(clock, lambda: manager),
        "supply",
    )
    yield supply, wire, device
    supply.close()


def is_off(device: Any) -> bool:
    return bool(device.values["OUTP? (@1)"] == "0")


def test_energised_switches_on_after_protection_and_off_at_the_end(bench: Any) -> None:
    supply, wire, device = bench
    with supply.energised(1.0, 4.0):
        assert not is_off(device)
        assert device.values["VOLT:PROT? (@1)"] == "1.6"
    assert is_off(device)
    assert wire.sent.index("VOLT:PROT? (@1)") < wire.sent.index("OUTP ON,(@1)") < wire.sent.index("OUTP OFF,(@1)")
    assert off_is_last(wire.sent)


def off_is_last(sent: list[str]) -> bool:
    """Whether off was confirmed, and only trips were asked for afterwards."""
    return sent[-3:] == ["OUTP? (@1)", "CURR:PROT:TRIP? (@1)", "VOLT:PROT:TRIP? (@1)"]


def test_the_level_goes_down_before_its_protection(bench: Any) -> None:
    supply, wire, _ = bench
    supply.configure(3.0, 1.0)
    wire.sent.clear()
    supply.configure(0.5, 1.0)
    assert wire.sent.index("VOLT 0.5,(@1)") < wire.sent.index("VOLT:PROT 1.05,(@1)")


class AccidentError(Exception):
    """Anything that may go wrong inside a block."""


@pytest.mark.parametrize("error", [AccidentError, KeyboardInterrupt, SystemExit, MemoryError])
def test_off_after_an_exception_in_the_block(bench: Any, error: type[BaseException]) -> None:
    supply, _, device = bench
    seen = []

    def block() -> None:
        with supply.energised(1.0, 1.0):
            seen.append(is_off(device))
            raise error

    with pytest.raises(error):
        block()
    assert seen == [False]
    assert is_off(device)


def test_off_when_a_setting_inside_the_block_is_refused(bench: Any) -> None:
    supply, _, device = bench
    device.refuse["CURR 0.7,(@1)"] = '-222,"Data out of range"'
    with pytest.raises(ReportedError, match="-222 Data out of range"), supply.energised(1.0, 0.5):
        supply.configure(1.0, 0.7)
    assert is_off(device)


def test_off_when_the_switch_on_is_interrupted(bench: Any) -> None:
    supply, wire, device = bench
    wire.handler = lambda message: (
        (_ for _ in ()).throw(KeyboardInterrupt) if message == "OUTP ON,(@1)" else device(message)
    )
    with pytest.raises(KeyboardInterrupt), supply.energised(1.0, 0.5):
        pass
    assert is_off(device)
    assert off_is_last(wire.sent)


def test_off_although_messages_on_the_way_down_are_lost(bench: Any) -> None:
    supply, wire, device = bench
    wire.fail_write["OUTP OFF,(@1)"] = 1
    with pytest.raises(AccidentError), supply.energised(1.0, 0.5):
        raise AccidentError
    assert is_off(device)
    with supply.energised(1.0, 0.5):
        wire.lost["OUTP? (@1)"] = 1
    assert is_off(device)


def test_off_although_ctrl_c_comes_twice(bench: Any) -> None:
    supply, wire, device = bench

    def block() -> None:
        with supply.energised(1.0, 0.5):
            wire.interrupt["OUTP? (@1)"] = 1
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        block()
    assert is_off(device)
    assert off_is_last(wire.sent)


def test_an_output_that_stays_on_is_an_error_and_does_not_hide_the_first_one(bench: Any) -> None:
    supply, wire, device = bench
    with pytest.raises(ReportedError, match=r"still on.*front panel"), supply.energised(1.0, 0.5):
        wire.handler = lambda message: None if message == "OUTP OFF,(@1)" else device(message)
    with pytest.raises(AccidentError) as caught, supply.energised(1.0, 0.5):
        raise AccidentError
    assert "still on" in caught.value.__notes__[0]
    wire.handler = device
    supply.make_safe()


@pytest.mark.parametrize(
    ("voltage", "current", "message"),
    [
        (3.1, 1.0, "voltage = 3.1 V is outside 0 … 3 V, the limit of the station"),
        (1.0, 10.4, "current limit = 10.4 A is outside 0 … 10.3 A, the limit of the model"),
        (-0.1, 1.0, "voltage = -0.1 V is outside"),
        (float("nan"), 1.0, "voltage = nan V is outside"),
    ],
)
def test_limits_hold_before_anything_is_sent(bench: Any, voltage: float, current: float, message: str) -> None:
    supply, wire, _ = bench
    wire.sent.clear()
    with pytest.raises(SetpointError, match=message), supply.energised(voltage, current):
        pass
    assert wire.sent == []


def test_a_level_that_does_not_read_back_is_an_error_before_switching_on(bench: Any) -> None:
    supply, wire, device = bench
    wire.handler = lambda message: b"5.0\n" if message == "VOLT:PROT? (@1)" else device(message)
    with pytest.raises(CommunicationError, match=r"reads back 5 after 1\.6 was set"), supply.energised(1.0, 1.0):
        pass
    assert "OUTP ON,(@1)" not in wire.sent


@pytest.mark.parametrize("header", ["VOLT", "CURR", "VOLT:PROT", "CURR:PROT:DEL", "CURR:PROT:STAT"])
def test_levels_and_protections_are_all_read_back_before_switching_on(bench: Any, header: str) -> None:
    supply, wire, device = bench
    query = f"{header}? (@1)"
    levels = iter([b"0\n"] if header == "VOLT" else [])  # the level found before
    wire.handler = lambda message: next(levels, b"7\n") if message == query else device(message)
    with pytest.raises(CommunicationError, match="reads back 7 after"), supply.energised(1.0, 2.0):
        pass
    assert "OUTP ON,(@1)" not in wire.sent


@pytest.mark.parametrize(
    ("regulated", "always", "state"),
    [
        (Regulated.VOLTAGE, False, "ON"),
        (Regulated.CURRENT, False, "OFF"),
        (Regulated.CURRENT, True, "ON"),
    ],
)
def test_over_current_protection_is_set_and_read_back_before_switching_on(
    manager: Any, connect: Any, settings_class: Any, clock: Any, regulated: Regulated, always: bool, state: str
) -> None:
    device = settings_class(IDENTITY, NOTHING_SET)
    wire = connect(ADDRESS, device)
    options = E36300Options(trip_at_current_limit=always, over_current_delay=0.1)
    supply = KeysightE36300.open(ADDRESS, options, Surroundings(clock, lambda: manager), "supply")
    with supply.energised(1.0, 2.0, regulated):
        wanted = (
            "DEL 0.1,(@1)",
            "DEL:STAR CCTR,(@1)",
            f"STAT {state},(@1)",
            "DEL? (@1)",
            "STAT? (@1)",
            "DEL:STAR? (@1)",
        )
        order = [wire.sent.index(f"CURR:PROT:{message}") for message in wanted]
        assert order == sorted(order)
        assert order[-1] < wire.sent.index("OUTP ON,(@1)")
    supply.close()


def test_a_delay_that_starts_otherwise_is_an_error_before_switching_on(bench: Any) -> None:
    supply, wire, device = bench
    wire.handler = lambda message: b"SCH\n" if message == "CURR:PROT:DEL:STAR? (@1)" else device(message)
    with pytest.raises(CommunicationError, match="reads back SCH after CCTR was set"), supply.energised(1.0, 1.0):
        pass
    assert "OUTP ON,(@1)" not in wire.sent


def trip(device: Any, which: str) -> None:
    device.values |= {"OUTP? (@1)": "0", f"{which}:PROT:TRIP? (@1)": "1"}


@pytest.mark.parametrize(("which", "words"), [("CURR", "over-current"), ("VOLT", "over-voltage")])
def test_a_trip_is_reported_at_the_blocks_end_and_released_with_the_output_off(
    bench: Any, which: str, words: str
) -> None:
    supply, wire, device = bench

    def block() -> None:
        with supply.energised(1.0, 1.0):
            trip(device, which)
            wire.sent.clear()

    with pytest.raises(ReportedError, match=f"supply: {words} protection switched the output off. Check the leads"):
        block()
    assert is_off(device)
    told = [message for message in wire.sent if message.startswith(("OUTP OFF", "OUTP:PROT:CLE"))]
    # Clearing restores what the output was before: off comes before it and after it.
    assert told == ["OUTP OFF,(@1)", "OUTP OFF,(@1)", "OUTP:PROT:CLE (@1)", "OUTP OFF,(@1)"]


def test_a_trip_stands_beside_the_error_that_it_caused(bench: Any) -> None:
    supply, _, device = bench

    def block() -> None:
        with supply.energised(1.0, 1.0):
            trip(device, "CURR")
            raise AccidentError

    with pytest.raises(AccidentError) as caught:
        block()
    assert "over-current protection switched the output off" in caught.value.__notes__[0]


def test_a_trip_from_before_is_not_cleared_by_the_way(bench: Any) -> None:
    supply, wire, device = bench
    trip(device, "CURR")
    wire.sent.clear()
    with pytest.raises(ReportedError, match=r"has tripped earlier.*front panel"), supply.energised(1.0, 1.0):
        pass
    assert wire.sent == ["CURR:PROT:TRIP? (@1)"]
    device.values["CURR:PROT:TRIP? (@1)"] = "0"


@pytest.mark.parametrize("delay", [-0.1, 0.26, float("nan")])
def test_a_delay_that_cannot_be_is_refused(
    manager: Any, connect: Any, settings_class: Any, clock: Any, delay: float
) -> None:
    connect(ADDRESS, settings_class(IDENTITY, NOTHING_SET))
    with pytest.raises(SetpointError, match=r"over_current_delay = .* is outside 0 … 0\.255 s"):
        KeysightE36300.open(
            ADDRESS, E36300Options(over_current_delay=delay), Surroundings(clock, lambda: manager), "supply"
        )


def test_off_over_a_connection_opened_anew(bench: Any, clock: Any) -> None:
    supply, wire, device = bench
    opened = []

    def lose_connection() -> None:
        resource = supply._session._resource
        wire.fail_write.update(dict.fromkeys(("OUTP OFF,(@1)", "*IDN?"), 1))
        opened.append(resource.session)

    with supply.energised(1.0, 0.5):
        lose_connection()
    assert is_off(device)
    assert supply._session._resource.session not in opened
    assert supply._session._resource.timeout == 10_000
    assert clock.slept == []
    supply.make_safe()


def test_a_supply_that_is_gone_is_reported_and_found_again_later(bench: Any, manager: Any) -> None:
    supply, wire, device = bench
    device.values["OUTP? (@1)"] = "1"
    wires = manager.visalib.wires
    (name,) = wires
    wire.lost.update(dict.fromkeys(("SYST:ERR?", "*IDN?"), 99))
    del wires[name]
    for _ in range(2):
        with pytest.raises(CommunicationError, match="cannot be opened again"):
            supply.make_safe()
    with pytest.raises(CommunicationError, match="the connection is lost"):
        supply.measure_voltage()
    wire.lost.clear()
    wires[name] = wire
    supply.make_safe()
    assert is_off(device)


def test_another_supply_at_the_address_is_not_taken_for_it(bench: Any) -> None:
    supply, wire, device = bench
    wire.fail_write.update(dict.fromkeys(("OUTP OFF,(@1)", "*IDN?"), 1))
    device.values["*IDN?"] = IDENTITY.replace("MY61005055", "MY1")
    with pytest.raises(CommunicationError, match=r"MY1,2\.1\.0' answers instead of"):
        supply.make_safe()


def test_the_way_down_does_not_wait_long_for_a_reply(bench: Any) -> None:
    supply, wire, device = bench
    timeouts = set()

    def note(message: str) -> bytes | None:
        timeouts.add(supply._session._resource.timeout)
        return device(message)

    wire.handler = note
    supply.make_safe()
    assert timeouts == {2000}
    assert supply._session._resource.timeout == 10_000


@pytest.mark.parametrize(
    ("condition", "on", "tripped", "mode"),
    [
        ("+1", "1", "0", OutputMode.CONSTANT_CURRENT),
        ("+2", "1", "0", OutputMode.CONSTANT_VOLTAGE),
        ("+0", "1", "0", OutputMode.UNREGULATED),
        ("+0", "0", "0", OutputMode.OFF),
        ("+0", "0", "1", OutputMode.TRIPPED),
        ("+3", "1", "0", OutputMode.UNREGULATED),
    ],
)
def test_output_mode(bench: Any, condition: str, on: str, tripped: str, mode: OutputMode) -> None:
    supply, _, device = bench
    device.values |= {
        "STAT:QUES:INST:ISUM1:COND?": condition,
        "OUTP? (@1)": on,
        "CURR:PROT:TRIP? (@1)": tripped,
    }
    assert supply.output_mode() is mode
    device.values["OUTP? (@1)"] = "0"


def test_polarity_of_the_regulation_bits() -> None:
    assert decode_regulation(1) is OutputMode.CONSTANT_CURRENT
    assert decode_regulation(2 | 0x180) is OutputMode.CONSTANT_VOLTAGE


def test_calibration_replaces_the_data_sheet(bench: Any) -> None:
    supply, _, device = bench
    device.values["MEAS:CURR? (@1)"] = "0.25"
    assert supply.measure_current().accuracy == Accuracy(offset=1e-3)


@pytest.mark.parametrize(
    ("identity", "options", "message"),
    [
        ("RIGOL TECHNOLOGIES,DP832,1,2", {}, "RIGOL TECHNOLOGIES DP832 answers, expected E36311A or E36312A"),
        ("Keysight Technologies,34465A,1,2", {}, "34465A answers"),
        (IDENTITY, {"serial_number": "MY1"}, "serial number MY61005055 answers, expected MY1"),
        (IDENTITY, {"channel": 4}, "has outputs 1, 2, 3, not 4"),
        ("garbage", {}, "not an identity of four fields"),
    ],
)
def test_another_instrument_is_refused_and_let_go(
    manager: Any, connect: Any, settings_class: Any, clock: Any, identity: str, options: Any, message: str
) -> None:
    connect(ADDRESS, settings_class(identity))
    with pytest.raises(IdentityError, match=message):
        KeysightE36300.open(ADDRESS, E36300Options(**options), Surroundings(clock, lambda: manager), "supply")


def test_the_three_models_have_three_outputs() -> None:
    from drivers.keysight.e36300_data import OUTPUTS

    assert {model: sorted(outputs) for model, outputs in OUTPUTS.items()} == {
        "E36311A": [1, 2, 3],
        "E36312A": [1, 2, 3],
        "E36313A": [1, 2, 3],
    }
    assert OUTPUTS["E36313A"][1].maximum_current == pytest.approx(10.3)


def test_a_list_is_ended_and_given_back_with_the_front_panel(
    manager: Any, connect: Any, settings_class: Any, clock: Any
) -> None:
    device = settings_class(IDENTITY, NOTHING_SET | {"VOLT:MODE? (@1)": "LIST"})
    wire = connect(ADDRESS, device)
    supply = KeysightE36300.open(ADDRESS, E36300Options(), Surroundings(clock, lambda: manager), "supply")
    assert device.values["VOLT:MODE? (@1)"] == "FIX"
    assert [(one.query, one.found) for one in supply.found_state if one.changed] == [("VOLT:MODE? (@1)", "LIST")]
    supply.close()
    assert device.values["VOLT:MODE? (@1)"] == "LIST"
    assert wire.sent[-1] == "SYST:LOC"


@pytest.mark.parametrize(
    ("query", "found", "key"), [("OUTP:PAIR?", "SER", "Pair Off"), ("OUTP:TRAC?", "1", "Tracking Off")]
)
def test_paired_and_tracking_outputs_are_refused_with_the_key_to_press(
    manager: Any, connect: Any, settings_class: Any, clock: Any, query: str, found: str, key: str
) -> None:
    connect(ADDRESS, settings_class(IDENTITY, NOTHING_SET | {query: found}))
    with pytest.raises(ReportedError, match=rf"is set to {found}.*Output Settings.*{key}"):
        KeysightE36300.open(ADDRESS, E36300Options(), Surroundings(clock, lambda: manager), "supply")
    guard = Surroundings(clock, lambda: manager, guarding=True)
    KeysightE36300.open(ADDRESS, E36300Options(), guard, "supply").close()


def test_a_model_without_pairing_goes_without(manager: Any, connect: Any, settings_class: Any, clock: Any) -> None:
    connect(
        ADDRESS,
        settings_class(IDENTITY, {key: value for key, value in NOTHING_SET.items() if key[:4] != "OUTP" or "@" in key}),
    )
    supply = KeysightE36300.open(ADDRESS, E36300Options(), Surroundings(clock, lambda: manager), "supply")
    assert [one.query for one in supply.found_state] == ["VOLT:MODE? (@1)", "CURR:MODE? (@1)", "VOLT:SENS? (@1)"]
    supply.close()
