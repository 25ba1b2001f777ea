"""Four-wire resistance where a supply is at its lower end, and where the winding's temperature does not stand still."""

from dataclasses import replace
from pathlib import Path

import pytest

from bench.motor.motor_file import load_motor
from procedures.core.bench import Role
from sim_instruments.bench import VirtualBench
from tests.runs.on_bench import measure, within

LG = (Path(__file__).parents[2] / "bench" / "motors" / "lg-400w.toml").read_text(encoding="utf-8")


def holds_the_truth(parameter):
    low, high = parameter["coverage_interval"]
    return low <= parameter["truth"] <= high


def changed(text, **values):
    """Return the motor file with these values instead of, or after, its own."""
    lines = [line for line in text.splitlines() if line.split(" ")[0] not in values]
    return "\n".join([*lines, *(f"{name} = {value}" for name, value in values.items()), ""])


def test_a_current_of_some_milliamperes_is_measured(motorbench, tmp_path):
    # A quarter of 0.15 A in four steps, from a supply and a meter that may be off by 5 mA each.
    motor = tmp_path / "small.toml"
    plate, virtual = LG.split("[virtual]")
    plate = plate.replace("rated_current = 29.0", "rated_current = 0.15").replace(
        "maximum_current = 80.0", "maximum_current = 0.3"
    )
    virtual = changed(virtual, phase_resistance=[17.5, 17.6, 17.4], d_axis_inductance=1.5e-3, q_axis_inductance=3.4e-3)
    motor.write_text(plate + "[virtual]" + virtual, encoding="utf-8")
    status, given = motorbench("run", "stator-resistance-dc", "--station", "virtual", "--motor", str(motor))
    assert status == 0, given.get("cause")
    assert holds_the_truth(given["parameters"]["stator_resistance"])


def test_a_winding_that_warms_is_seen_and_allowed_for(motorbench, tmp_path):
    motor = tmp_path / "quick.toml"
    plate, virtual = LG.split("[virtual]")
    quick = changed(virtual, thermal_time_constant=60.0, thermal_resistance=20.0)
    motor.write_text(plate + "[virtual]" + quick, encoding="utf-8")
    status, given = motorbench("run", "stator-resistance-dc", "--station", "virtual", "--motor", str(motor))
    assert status == 0, given.get("cause")
    assert "heating" in {warning["id"] for warning in given["warnings"]}
    assert given["procedures"]["stator-resistance-dc"]["findings"]["warming"] > 1.0
    assert holds_the_truth(given["parameters"]["stator_resistance"])


class Wavering:
    """A voltmeter some of whose readings, counted from 0, are not what is at its terminals."""

    def __init__(self, voltmeter, wrong):
        self._voltmeter, self._wrong, self._count = voltmeter, wrong, -1

    def __getattr__(self, name):
        return getattr(self._voltmeter, name)

    def measure_voltage(self):
        read = self._voltmeter.measure_voltage()
        self._count += 1
        return replace(read, value=read.value * self._wrong(self._count))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        # One wild reading: read once more at that current, it bears out the others.
        (lambda k: 10.0 if k == 2 else 1.0, "was read again there"),
        # One that is too close to the others for that: the line through them tells.
        (lambda k: 1.01 if k == 4 else 1.0, "from the straight line through the others"),
    ],
)
def test_a_reading_that_contradicts_its_line_is_said_and_the_truth_held(wrong, said):
    motor = load_motor("lg-400w")
    with VirtualBench(motor.virtual, seed=3, sockets=False) as bench:

        def hands(instruments, operator):
            instruments[Role.VOLTMETER] = Wavering(instruments[Role.VOLTMETER], wrong)
            return operator

        found = measure(bench, motor.nameplate, "stator-resistance-dc", hands=hands)
        truth = sum(motor.virtual.phase_resistances) / 3.0
    told = [w.message.render() for w in found.warnings if w.identifier == "repeats-differ"]
    assert any(said in each for each in told), told
    assert within(found.parameter("stator_resistance"), truth)
