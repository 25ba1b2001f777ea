"""The file of disturbances: what it says, and what is refused with key and allowed range."""

from pathlib import Path

import pytest

from bench.cli.sim.serve import serve
from bench.i18n.errors import InputError
from bench.virtual.disturbance_file import load_disturbances
from sim_instruments.disturbances.bench import Contacts, Disturbances, Hands, ShaftSensors
from sim_instruments.disturbances.channel import ChannelPath
from sim_instruments.disturbances.current_loop import CurrentLoop

EXAMPLE = Path(__file__).parents[3] / "docs" / "examples" / "disturbances.toml"


def test_the_example_in_the_documentation() -> None:
    assert load_disturbances(EXAMPLE) == Disturbances(
        {1: ChannelPath(hum=0.02), 4: ChannelPath(pole=20e3, skew=2e-6)},
        ShaftSensors(torque_filter=0.05, speed_filter=0.02, dropouts=0.001),
        Contacts(thermal_emf=2e-6, resistance=0.001),
        Hands(unevenness=0.2, regrips=1.5),
    )


def test_an_empty_file_disturbs_nothing(tmp_path: Path) -> None:
    file = tmp_path / "empty.toml"
    file.write_text("", encoding="utf-8")
    assert load_disturbances(file) == Disturbances()


def test_an_inverters_legs_sensors_and_timing(tmp_path: Path) -> None:
    file = tmp_path / "inverter.toml"
    file.write_text("[inverter]\ndead_time = 2e-6\nangle_error = -0.01\nvoltage_delay = 3e-5\n", encoding="utf-8")
    loop = CurrentLoop(dead_time=2e-6, angle_error=-0.01, voltage_delay=3e-5)
    assert load_disturbances(file) == Disturbances(inverter=loop)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("[channels.5]\nhum = 1", ["unknown key channels.5", "1, 2, 3, 4"]),
        ("[channels.1]\nhumm = 1", ["unknown key channels.1.humm", "did you mean hum?"]),
        ("[channels.2]\npole = -3", ["channels.2.pole = -3", "above 0", "Hz"]),
        ("[dynamometer]\ndropouts = 1.0", ["dynamometer.dropouts = 1.0", "below 1"]),
        ("[contacts]\nthermal_emf = 2", ["contacts.thermal_emf = 2", "up to 1 V"]),
        ("[hands]\nslips = '50 %'", ["hands.slips = '50 %' is text, not a number"]),
        ("[inverter]\ndead_time = -1e-6", ["inverter.dead_time = -1e-06", "at least 0", "s"]),
        ("[inverter]\nangle = 0.1", ["unknown key inverter.angle", "did you mean angle_error?"]),
        ("[hand]\nslips = 0.5", ["unknown key hand", "did you mean hands?"]),
    ],
)
def test_what_cannot_be_is_named(tmp_path: Path, content: str, said: list[str]) -> None:
    file = tmp_path / "dirt.toml"
    file.write_text(content, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        load_disturbances(file)
    assert all(part in str(refused.value) for part in (str(file), *said))


def test_a_served_bench_says_that_its_file_is_missing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"there is no such file of disturbances"):
        serve(motor="lg-400w", disturbances=tmp_path / "none.toml")
