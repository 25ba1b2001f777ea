"""Where a run by a fixture may take place."""

import io
from pathlib import Path

import pytest
from rich.console import Console

from bench.i18n.errors import InputError, UsageError
from bench.motor.motor_file import load_motor
from bench.run.context import run_context
from bench.run.request import RunRequest
from bench.safety.interrupts import Interrupts
from drivers.interfaces.text import text
from procedures.core.actions import EnterReading
from procedures.core.bench import Role

ACTUATOR = """
[station]
name = "line"
[fixture]
winding_temperature = 22.5
[instruments.rotor_actuator]
driver = "cia402-rotor-actuator"
address = "can://virtual/nowhere?node=7"
maximum_speed = 6.0
"""


def taken(station: str):
    request = RunRequest((), load_motor("lg-400w"), station, "en", Path("runs"), operator="fixture")
    return run_context(request, Console(file=io.StringIO()), Interrupts())


def test_a_station_with_a_fixture(tmp_path: Path) -> None:
    (tmp_path / "line.toml").write_text(ACTUATOR)
    with taken(str(tmp_path / "line.toml")) as context:
        assert context.operator.roles == {Role.ROTOR_ACTUATOR}
        asked = EnterReading("winding_temperature", text("the winding's temperature"), "°C", -60.0, 250.0)
        assert context.operator.hands.perform(asked) == 22.5
        assert context.operator.hand_time < 1.0


def test_a_station_without_a_fixture_is_refused(tmp_path: Path) -> None:
    (tmp_path / "bare.toml").write_text('[station]\nname = "bare"\n')
    with (
        pytest.raises(UsageError, match=r"bare.toml has neither \[instruments.switch_matrix\] nor"),
        taken(str(tmp_path / "bare.toml")),
    ):
        pass


def test_a_temperature_that_no_room_has_is_refused(tmp_path: Path) -> None:
    (tmp_path / "line.toml").write_text(ACTUATOR.replace("22.5", "2250.0"))
    with pytest.raises(InputError, match=r"fixture.winding_temperature = 2250"), taken(str(tmp_path / "line.toml")):
        pass
