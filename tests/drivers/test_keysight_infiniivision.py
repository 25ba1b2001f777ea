"""InfiniiVision: dialogue, arming and waiting, records, clipping, screen readings."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.bases.oscilloscope_accuracy import trace_accuracy
from drivers.bases.oscilloscope_data import OscilloscopeOptions, Probe
from drivers.bases.waveform import Preamble, parse_preamble, to_time, to_values
from drivers.catalogue import Surroundings
from drivers.interfaces import (
    Accuracy,
    ChannelSettings,
    CommunicationError,
    MeasurementError,
    OverloadError,
    ProbeKind,
    ReportedError,
    SetpointError,
    Slope,
    Trigger,
)
from drivers.keysight.infiniivision import KeysightInfiniiVision
from drivers.keysight.infiniivision_data import DATA
from tests.drivers.dialogue import played

ADDRESS = "TCPIP0::oscilloscope::inst0::INSTR"
IDENTITY = "KEYSIGHT TECHNOLOGIES,DSOX3024T,MY1,07.50"
#: A DSOX3024T with probes on 1, 2 and 4 as it should have been left.
RIGHT = {
    **{f":CHAN{n}:{what}?": value for n in (1, 2, 4) for what, value in (("INV", "0"), ("BWL", "0"), ("IMP", "ONEM"))},
    **{f":CHAN{n}:PROB:SKEW?": "+0.0E+00" for n in (1, 2, 4)},
    ":CHAN3:DISP?": "0",
    ":ACQ:MODE?": "RTIM",
    ":TRIG:EDGE:COUP?": "DC",
    ":TRIG:HFR?": "0",
    ":TRIG:NREJ?": "0",
    ":TRIG:HOLD?": "+6.0E-08",
}
OPTIONS = OscilloscopeOptions(
    probes={
        4: Probe(ProbeKind.CURRENT, 10.0, gain=0.01, offset=0.01, source="1146B manual"),
        2: Probe(ProbeKind.VOLTAGE, 10.0),
        1: Probe(ProbeKind.VOLTAGE, 100.0),
    },
    calibration={1: Accuracy(gain=1e-3, source="certificate")},
)


def test_dialogue(clock: Any) -> None:
    with played("keysight_dsox3024t", clock) as (surroundings, address):
        scope = KeysightInfiniiVision.open(address, OPTIONS, surroundings, "oscilloscope")
        assert scope.channels(ProbeKind.VOLTAGE) == (1, 2)
        assert scope.channels(ProbeKind.CURRENT) == (4,)
        scope.configure_channel(4, ChannelSettings(8.0, 1.0))
        scope.configure_acquisition(0.01, 1000, pre_trigger=0.2)
        scope.configure_trigger(Trigger(4, 0.5, Slope.FALLING))
        scope.initiate()
        assert clock.slept == [pytest.approx(0.002)]  # the part before the trigger has to fill first
        with pytest.raises(
            MeasurementError, match=r"no trigger: channel 4 did not cross 0\.5 A \(falling\) within 0\.01 s"
        ):
            scope.fetch([4], timeout=0.01)
        assert clock.now() == pytest.approx(0.012, abs=2e-3)
        frequency = scope.measure_frequency(4)
        assert (frequency.value, frequency.unit) == (53.76, "Hz")
        assert "not compared with the data sheet" in frequency.accuracy.source
        amplitude = scope.measure_amplitude(4)
        assert (amplitude.value, amplitude.unit) == (3.0, "A")
        # 2 % of 8 A on a trace of 6 A, and the probe's 1 %.
        assert amplitude.accuracy.gain == pytest.approx(0.02 * 8 / 6 + 0.01)
        assert amplitude.accuracy.resolution == pytest.approx(8 / 256)
        scope.make_safe()
        scope.close()


class Scope:
    """A scope with one record of codes on every channel."""

    def __init__(self, settings: Any, codes: np.ndarray[Any, Any], preamble: str) -> None:
        self.settings = settings
        self.codes = codes
        self.preamble = preamble
        self.states = ["+0"]

    def __call__(self, message: str) -> bytes | None:
        if message == ":OPER:COND?":
            state = self.states[0] if len(self.states) == 1 else self.states.pop(0)
            return state.encode() + b"\n"
        if message == ":WAV:PRE?":
            return self.preamble.encode() + b"\n"
        if message == ":WAV:DATA?":
            data = self.codes.astype("<u2").tobytes()
            return b"#8%08d" % len(data) + data + b"\n"
        return self.settings(message)


PREAMBLE = "1,0,{points},1,1.0E-06,-2.0E-04,0,1.220703E-04,1.5,32768"


@pytest.fixture
def bench(manager: Any, connect: Any, settings_class: Any, clock: Any) -> Any:
    codes = np.arange(0x1000, 0x1000 + 1000 * 32, 32)
    device = Scope(settings_class(IDENTITY, RIGHT), codes, PREAMBLE.format(points=1000))
    wire = connect(ADDRESS, device)
    scope = KeysightInfiniiVision.open(ADDRESS, OPTIONS, Surroundings(clock, lambda: manager), "oscilloscope")
    scope.configure_channel(2, ChannelSettings(8.0, 1.5))
    scope.configure_acquisition(1e-3, 800)
    yield scope, wire, device
    scope.close()


def test_a_record_in_volts_and_seconds(bench: Any) -> None:
    scope, wire, device = bench
    waveform = scope.fetch([2], timeout=1.0)[2]
    assert waveform.unit == "V"
    assert waveform.values.dtype == np.float64
    np.testing.assert_allclose(waveform.values, (device.codes - 32768.0) * 1.220703e-4 + 1.5, rtol=1e-15)
    np.testing.assert_allclose(waveform.time, np.arange(1000) * 1e-6 - 2e-4, rtol=0, atol=1e-15)
    assert waveform.resolution == pytest.approx(256 * 1.220703e-4)
    assert not waveform.clipped
    # 2 % of full scale, by what part of the screen the trace spans.
    assert waveform.accuracy.gain == pytest.approx(
        0.02 * 8 / max(np.ptp(waveform.values), np.abs(waveform.values).max())
    )
    assert waveform.accuracy.offset == pytest.approx(0.1 * 8 / 8 + 2e-3 * 10 + 0.01 * 1.5)
    assert ":WAV:POIN 1000" in wire.sent  # the least offered that holds 800


@pytest.mark.parametrize(("part", "gain"), [(1.0, 0.02), (1 / 2, 0.04), (1 / 3, 0.06), (0.0, 0.02 * 256)])
def test_a_trace_over_part_of_the_screen_has_more_of_the_full_scales_error(
    bench: Any, part: float, gain: float
) -> None:
    scope, _, device = bench
    # 65536 codes are the 8 V of the screen.
    half = part * 4.0 / 1.220703e-4
    device.preamble = device.preamble.replace("1.5", "0")
    device.codes = np.where(np.arange(1000) % 2, 32768 + half, 32768 - half).clip(0x0200, 0xFEFF).astype(np.uint16)
    assert scope.fetch([2], timeout=1.0)[2].accuracy.gain == pytest.approx(gain, rel=0.02)


@pytest.mark.parametrize(
    ("low", "high", "clipped"),
    [(0x0200, 0xFE00, False), (0x0100, 0xFE00, True), (0x0000, 0xFE00, True), (0x0200, 0xFF00, True)],
)
def test_codes_at_the_rails_are_clipped(bench: Any, low: int, high: int, clipped: bool) -> None:
    scope, _, device = bench
    device.codes = np.full(1000, 0x8000)
    device.codes[[3, 4]] = low, high
    assert scope.fetch([2], timeout=1.0)[2].clipped is clipped


def test_fetch_waits_for_the_run_bit(bench: Any, clock: Any) -> None:
    scope, _, device = bench
    device.states = ["+8", "+40", "+8", "+0"]
    scope.fetch([2], timeout=1.0)
    assert len(clock.slept) == 3


def test_arming_is_waited_for_and_missed(bench: Any) -> None:
    scope, _, device = bench
    device.states = ["+8", "+8", "+40"]
    scope.initiate()
    device.states = ["+8"]
    with pytest.raises(MeasurementError, match="does not arm"):
        scope.initiate()


@pytest.mark.parametrize(
    ("preamble", "error", "message"),
    [
        ("0,0,1000,1,1E-6,0,0,1E-4,0,128", CommunicationError, r"format 0 instead of 1 \(WORD\)"),
        ("1,0,1000,1,1E-6,0,0,1E-4,0", CommunicationError, "9 fields instead of 10"),
        ("1,0,999,1,1E-6,0,0,1E-4,0,32768", CommunicationError, "1000 samples instead of 999 announced"),
        ("1,0,1000,1,0,0,0,1E-4,0,32768", CommunicationError, "must be positive"),
    ],
)
def test_unusable_records(bench: Any, preamble: str, error: type[Exception], message: str) -> None:
    scope, _, device = bench
    device.preamble = preamble
    with pytest.raises(error, match=message):
        scope.fetch([2], timeout=1.0)


def test_a_record_with_too_few_points_is_refused(bench: Any) -> None:
    scope, _, device = bench
    device.codes, device.preamble = device.codes[:500], PREAMBLE.format(points=500)
    with pytest.raises(MeasurementError, match="has 500 points, 800 are needed"):
        scope.fetch([2], timeout=1.0)


def test_half_a_block(bench: Any) -> None:
    scope, wire, device = bench
    wire.handler = lambda message: b"#800002000half" if message == ":WAV:DATA?" else device(message)
    with pytest.raises(CommunicationError, match="oscilloscope after ':WAV:DATA\\?': only 4 of 2000"):
        scope.fetch([2], timeout=1.0)
    wire.handler = device
    assert scope.fetch([2], timeout=1.0)[2].values.size == 1000


def test_calibration_of_a_channel(bench: Any) -> None:
    scope, _, _ = bench
    scope.configure_channel(1, ChannelSettings(80.0))
    assert scope.fetch([1], timeout=1.0)[1].accuracy.source == "certificate"


def test_without_a_channel_the_trigger_is_automatic(bench: Any) -> None:
    scope, wire, _ = bench
    wire.sent.clear()
    scope.configure_trigger(Trigger(None))
    assert wire.sent == [":TRIG:SWE AUTO", "SYST:ERR?"]


@pytest.mark.parametrize(("what", "value"), [("FREQ", "+9.9E+37"), ("VPP", "+9.9E+37")])
def test_no_trace_on_the_screen(bench: Any, what: str, value: str) -> None:
    scope, _, device = bench
    device.settings.values[f":MEAS:{what}? CHAN2"] = value
    measure = scope.measure_frequency if what == "FREQ" else scope.measure_amplitude
    with pytest.raises(MeasurementError, match="channel 2"):
        measure(2)


def test_a_trace_over_the_whole_screen_is_clipped(bench: Any) -> None:
    scope, _, device = bench
    device.settings.values[":MEAS:VPP? CHAN2"] = "+8.0"
    with pytest.raises(OverloadError, match="leaves the screen"):
        scope.measure_amplitude(2)


def test_limits(bench: Any) -> None:
    scope, wire, _ = bench
    wire.sent.clear()
    for refused in (
        lambda: scope.configure_channel(3, ChannelSettings(8.0)),
        lambda: scope.configure_channel(2, ChannelSettings(401.0)),
        lambda: scope.configure_acquisition(1e-3, 3_000_000),
        lambda: scope.configure_acquisition(1e-6, 100_000),
        lambda: scope.configure_acquisition(1e-3, 100, pre_trigger=1.1),
        lambda: scope.configure_trigger(Trigger(3)),
        lambda: scope.fetch([3], timeout=1.0),
    ):
        with pytest.raises(SetpointError):
            refused()
    assert wire.sent == []


@given(st.text(alphabet="0123456789,.+-Eex \n", max_size=60))
def test_preambles_are_refused_with_value_error_only(text: str) -> None:
    try:
        preamble = parse_preamble(text, 1, "WORD")
    except ValueError:
        return
    assert preamble.y_increment > 0


@given(
    st.lists(st.integers(0, 0xFFFF), min_size=1, max_size=50),
    st.floats(1e-6, 1.0),
    st.floats(-10, 10),
    st.integers(0, 0xFFFF),
)
def test_conversion_is_the_formula(codes: list[int], increment: float, origin: float, reference: int) -> None:
    preamble = Preamble(len(codes), 1e-6, 0.0, 0.0, increment, origin, float(reference))
    values = to_values(np.array(codes, dtype="<u2"), preamble)
    assert values.tolist() == [(code - reference) * increment + origin for code in codes]
    assert to_time(len(codes), preamble).shape == values.shape


def test_conversion_of_more_than_one_block() -> None:
    codes = np.arange(100_000, dtype="<u4").astype("<u2")
    preamble = Preamble(codes.size, 1.0, 0.0, 0.0, 0.5, 1.0, 32768.0)
    np.testing.assert_array_equal(to_values(codes, preamble), (codes - 32768.0) * 0.5 + 1.0)


def test_what_the_last_user_left_is_set_and_given_back(
    manager: Any, connect: Any, settings_class: Any, clock: Any
) -> None:
    hostile = {":CHAN2:INV?": "1", ":CHAN1:BWL?": "1", ":CHAN3:DISP?": "1", ":ACQ:MODE?": "SEGM", ":TRIG:HFR?": "1"}
    device = settings_class(IDENTITY, RIGHT | hostile)
    connect(ADDRESS, device)
    scope = KeysightInfiniiVision.open(ADDRESS, OPTIONS, Surroundings(clock, lambda: manager), "oscilloscope")
    assert {query: device.values[query] for query in hostile} == {query: RIGHT[query] for query in hostile}
    assert {one.query for one in scope.found_state if one.changed} == set(hostile)
    scope.close()
    assert {query: device.values[query] for query in hostile} == hostile


def test_a_voltage_probe_on_50_ohms_is_refused_and_a_current_probe_is_told(
    manager: Any, connect: Any, settings_class: Any, clock: Any
) -> None:
    surroundings = Surroundings(clock, lambda: manager)
    connect(ADDRESS, settings_class(IDENTITY, RIGHT | {":CHAN2:IMP?": "FIFT"}))
    with pytest.raises(ReportedError, match=r":CHAN2:IMP\?.*is set to FIFT.*Press the channel's key, then Imped"):
        KeysightInfiniiVision.open(ADDRESS, OPTIONS, surroundings, "oscilloscope")
    connect(ADDRESS, settings_class(IDENTITY, RIGHT | {":CHAN4:IMP?": "FIFT"}))
    scope = KeysightInfiniiVision.open(ADDRESS, OPTIONS, surroundings, "oscilloscope")
    assert [one.found for one in scope.found_state if one.query == ":CHAN4:IMP?"] == ["FIFT"]
    scope.close()


@pytest.mark.parametrize(
    ("stated", "gain", "said"),
    [
        ({"full_scale_gain": 0.01}, 0.01, "1 % of full scale"),
        ({"gain": 0.004, "gain_source": "K-12"}, 0.004, "0.4 % of the reading, K-12"),
    ],
)
def test_the_station_states_the_gain_of_full_scale_or_of_the_reading(
    stated: dict[str, Any], gain: float, said: str
) -> None:
    options = OscilloscopeOptions({1: Probe(ProbeKind.VOLTAGE, 10.0, gain=0.005)}, **stated)
    whole, third = (trace_accuracy(DATA, options, 1, ChannelSettings(8.0), -end, end) for end in (4.0, 4.0 / 3.0))
    assert whole.gain == pytest.approx(gain + 0.005)
    assert third.gain == pytest.approx(gain * (3.0 if "full_scale_gain" in stated else 1.0) + 0.005)
    assert said in whole.source


@pytest.mark.parametrize("stated", [{"gain": 0.0}, {"full_scale_gain": 0.6}, {"gain": 0.01, "full_scale_gain": 0.01}])
def test_a_gain_that_cannot_be_is_refused(stated: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="gain"):
        OscilloscopeOptions(**stated)
