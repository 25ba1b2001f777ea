"""A bench whose oscilloscope is a person's: time constants read off its screen, records saved as files."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from bench.captures.catalogue import CaptureFilesOptions
from bench.captures.oscilloscope import CaptureFilesOscilloscope
from bench.motor.motor_file import load_motor
from drivers.interfaces import (
    Accuracy,
    AcquisitionType,
    ChannelSettings,
    MeasurementError,
    Oscilloscope,
    ProbeKind,
    Trigger,
    Waveform,
)
from drivers.interfaces.text import Text
from drivers.manual.options import ManualOscilloscopeOptions
from drivers.manual.oscilloscope import ManualOscilloscope
from drivers.manual.prompt import Option
from procedures.core.actions import Action, EnterReading
from procedures.core.bench import Operator, Role
from sim_instruments.bench import VirtualBench
from tests.drivers.conftest import SteppingClock
from tests.runs.on_bench import measure, within

FILE = load_motor("ipmsm")
STATED = Accuracy(gain=0.02, source="data sheet")
PROBES = {1: ProbeKind.VOLTAGE, 2: ProbeKind.VOLTAGE, 3: ProbeKind.VOLTAGE, 4: ProbeKind.CURRENT}


class Screen:
    """What a person sets and sees on an oscilloscope: mixed into a driver by hand, it turns the knobs of the instrument itself."""

    instrument: Oscilloscope

    def configure_channel(self, channel: int, settings: ChannelSettings) -> None:
        super().configure_channel(channel, settings)
        self.instrument.configure_channel(channel, settings)

    def configure_acquisition(
        self,
        record_time: float,
        points: int,
        pre_trigger: float = 0.0,
        acquisition: AcquisitionType = AcquisitionType.NORMAL,
    ) -> None:
        super().configure_acquisition(record_time, points, pre_trigger)
        self.instrument.configure_acquisition(record_time, max(points, 5000), pre_trigger)

    def configure_trigger(self, trigger: Trigger) -> None:
        super().configure_trigger(trigger)
        self.instrument.configure_trigger(trigger)

    def initiate(self) -> None:
        super().initiate()
        self.instrument.initiate()


class WatchedScreen(Screen, ManualOscilloscope):
    """Nothing comes off it but what is typed."""


class SavingScope(Screen, CaptureFilesOscilloscope):
    """Its records are saved into a folder."""


class Saver:
    """Saves the record as CSV when told to, at the second asking where `late`."""

    def __init__(self, folder: Path, *, late: bool = False) -> None:
        self.folder, self.late = folder, late
        self.instrument: Oscilloscope
        self.saved = 0

    def ask(self, quantity: Text, unit: str, minimum: float, maximum: float, context: Text | None) -> float:
        raise AssertionError(f"nothing is typed, but {quantity} is asked")

    def choose(self, quantity: Text, options: Sequence[Option]) -> float:
        raise AssertionError(f"nothing is typed, but {quantity} is asked")

    def confirm(self, task: Text) -> None:
        said = str(task)
        if "Save the record" not in said:
            return
        if self.late and "no new file" not in said:
            return
        channels = [channel for channel in PROBES if str(channel) in said.split("channels ")[1].split(" as ")[0]]
        waves = self.instrument.fetch(channels, 10.0)
        self.saved += 1
        write(self.folder / f"record{self.saved}.csv", [waves[channel] for channel in channels])


def write(path: Path, waves: Sequence[Waveform]) -> None:
    """Write waveforms as a table."""
    head = ",".join(["time (s)", *(f"CH{wave.channel} ({wave.unit})" for wave in waves)])
    np.savetxt(
        path, np.column_stack([waves[0].time, *(w.values for w in waves)]), delimiter=",", header=head, comments=""
    )


class Eyes:
    """An operator who reads the screen to two digits."""

    def __init__(self, rest: Operator, instrument: Oscilloscope) -> None:
        self.rest, self.instrument = rest, instrument

    def perform(self, action: Action) -> object:
        if not isinstance(action, EnterReading) or action.key == "winding_temperature":
            return self.rest.perform(action)
        waves = self.instrument.fetch([1, 4], 10.0)
        time, volts, amperes = waves[1].time, smooth(waves[1].values), smooth(waves[4].values)
        if action.key == "voltage_rise_time":
            return round((crossing(time, volts, 0.9) - crossing(time, volts, 0.1)) / 0.8, 6)
        assert action.key == "time_constant"
        return float(f"{crossing(time, amperes, 0.632) - crossing(time, volts, 0.5):.2g}")


def smooth(values: np.ndarray) -> np.ndarray:
    return np.convolve(np.abs(values), np.ones(9) / 9.0, mode="same")


def crossing(time: np.ndarray, values: np.ndarray, share: float) -> float:
    """Return when a trace has gone a share of its way."""
    first, last = np.mean(values[20:200]), np.mean(values[-300:-20])
    return float(time[20:][np.argmax((values[20:] - first) / (last - first) >= share)])


@pytest.fixture
def bench():
    with VirtualBench(FILE.virtual_motor(), seed=5, sockets=False) as virtual:
        yield virtual


def test_time_constants_typed_hold_the_truth(bench):
    def hands(instruments, operator):
        real = instruments[Role.OSCILLOSCOPE]
        options = ManualOscilloscopeOptions(probes=PROBES)
        instruments[Role.OSCILLOSCOPE] = screen = WatchedScreen(Nodding(), bench.clock, options)
        screen.instrument = real
        return Eyes(operator, real)

    result = measure(bench, FILE.nameplate, "dq-inductance-time-constant", "repeats=4", hands=hands)
    truth = FILE.virtual_motor()
    for name in ("d_axis_inductance", "q_axis_inductance"):
        found = result.parameter(name)
        low, high = found.coverage_interval
        assert low <= getattr(truth, name) <= high, (name, found.value, getattr(truth, name))
        sources = " ".join(str(row.source) for row in found.budget)
        assert "time read off the screen" in sources
        assert "supply, current" in sources
        assert found.estimator.startswith("time constant read off the screen")


REFUSED = {
    "another column": (
        "time (s),V_ab (V)",
        {},
        r"no column CH1 was found for channel 1; the columns are .*V_ab.*columns\.1",
    ),
    "another unit": ("time (s),CH1 (A)", {}, r"CH1 is in A, and the station's probe on channel 1 in V"),
    "no column of that name": ("time (s),CH1 (V)", {"columns": {1: "U"}}, "no column U was found for channel 1"),
    "no accuracy": (
        "time (s),CH1 (V)",
        {"amplitude_accuracy": {}},
        "no accuracy is stated for its amplitude on channel 1",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_file_that_does_not_fit_is_refused_by_name(tmp_path, case):
    head, options, said = REFUSED[case]
    path = tmp_path / "record.csv"
    path.write_text("\n".join([head, *(f"{1e-3 * k:g},{k % 5}" for k in range(50))]), encoding="utf-8")
    given = {"probes": PROBES, "amplitude_accuracy": {1: STATED}, "files": (str(path),)} | options
    scope = CaptureFilesOscilloscope(Nodding(), SteppingClock(), CaptureFilesOptions(**given), name="oscilloscope")
    with pytest.raises(MeasurementError, match=said):
        scope.fetch([1], 1.0)


def test_files_are_taken_in_order_and_scaled(tmp_path):
    for name, factor in (("a", 1.0), ("b", 2.0)):
        rows = [f"{1e-3 * k:g},{factor * (k % 5):g}" for k in range(50)]
        (tmp_path / f"{name}.csv").write_text("\n".join(["time (s),CH1 (V)", *rows]), encoding="utf-8")
    files = tuple(str(tmp_path / f"{name}.csv") for name in "ab")
    options = CaptureFilesOptions(probes=PROBES, amplitude_accuracy={1: STATED}, files=files, scales={1: 10.0})
    scope = CaptureFilesOscilloscope(Nodding(), SteppingClock(), options, name="oscilloscope")
    assert [float(scope.fetch([1], 1.0)[1].values.max()) for _ in files] == [40.0, 80.0]
    with pytest.raises(MeasurementError, match="all 2 files are used, and one more record is needed"):
        scope.fetch([1], 1.0)


def test_a_folder_where_nothing_comes_is_told(tmp_path):
    options = CaptureFilesOptions(probes=PROBES, amplitude_accuracy={1: STATED}, folder=str(tmp_path))
    scope = CaptureFilesOscilloscope(Nodding(), SteppingClock(), options, name="oscilloscope")
    scope.initiate()
    with pytest.raises(MeasurementError, match="there is no new file"):
        scope.fetch([1], 1.0)


class Nodding:
    """Says that everything is done."""

    def ask(self, quantity: Text, unit: str, minimum: float, maximum: float, context: Text | None) -> float:
        raise AssertionError(f"{quantity} is asked")

    def choose(self, quantity: Text, options: Sequence[Option]) -> float:
        raise AssertionError(f"{quantity} is asked")

    def confirm(self, task: Text) -> None:
        assert str(task)


@pytest.mark.parametrize("late", [pytest.param(False, marks=pytest.mark.slow), True])
def test_records_saved_as_files_give_what_the_wire_gives(bench, tmp_path, late):
    saver = Saver(tmp_path, late=late)
    (tmp_path / "old.csv").write_text("time (s),CH1 (V)\n0,1\n1,2\n", encoding="utf-8")

    def hands(instruments, operator):
        saver.instrument = instruments[Role.OSCILLOSCOPE]
        options = CaptureFilesOptions(
            probes=PROBES, folder=str(tmp_path), amplitude_accuracy=dict.fromkeys(PROBES, STATED)
        )
        instruments[Role.OSCILLOSCOPE] = scope = SavingScope(saver, bench.clock, options, name="oscilloscope")
        scope.instrument = saver.instrument
        return operator

    if late:
        result = measure(bench, FILE.nameplate, "dq-inductance-time-constant", "repeats=1", hands=hands)
        for name in ("d_axis_inductance", "q_axis_inductance"):
            assert within(result.parameter(name), getattr(FILE.virtual_motor(), name))
    else:
        result = measure(bench, FILE.nameplate, "back-emf-constant", hands=hands)
        assert within(result.parameter("flux_linkage"), FILE.virtual_motor().flux_linkage)
        assert saver.saved == 3
