"""A fault inside a plug-in's procedure names the plug-in, and where in it."""

import re
from pathlib import Path

import pytest

from tests.command_line import Call

PROCEDURE = """from drivers.interfaces.text import text
from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.procedure import Procedure, Settings
from procedures.core.steps import step

COIL = ParameterDefinition("coil_resistance", "R", "Ω", text("Coil"))


class CoilSettings(Settings):
    pass


class Coil(Procedure[CoilSettings]):
    name = "coil"
    title = "Coil"
    section = "acme"
    roles = frozenset()
    gives = (COIL,)

    def measure(self):
        self.conclude()

    @step("acme/1", "Conclude")
    def conclude(self):
        {body}
"""
STATION = """
[station]
name = "bench"
[plugins]
files = ["plugin.py"]
[instruments.voltmeter]
driver = "keysight-34461a"
address = "TCPIP0::192.0.2.13::inst0::INSTR"
"""


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (
            'self.report(COIL.name, 0.032, section="acme", estimator="plain")',
            r"plugin.py:25: TypeError \(budget.py:\d+\): report an uncertain value: coil_resistance was given 0.032, a plain float",
        ),
        ('raise KeyError("oops")', r"KeyError \(plugin.py:25\): 'oops'"),
    ],
)
def test_a_fault_in_a_step_names_the_plug_in(call: Call, tmp_path: Path, body: str, said: str) -> None:
    (tmp_path / "plugin.py").write_text(PROCEDURE.format(body=body), encoding="utf-8")
    (tmp_path / "station.toml").write_text(STATION, encoding="utf-8")
    code, out, err = call("run", "coil", "--station", "station.toml", "--motor", "lg-400w", "--rehearse")
    assert code == 1
    told = " ".join((out + err).split())
    place = re.escape(str(tmp_path / "plugin.py"))
    assert re.search(f"an error in procedure Coil from {place}[^:]*: {said}", told), told


def test_a_unit_that_is_none_is_refused_where_the_plug_in_is_read(call: Call, tmp_path: Path) -> None:
    source = PROCEDURE.format(body="pass").replace('"Ω"', '"Ohmz"')
    (tmp_path / "plugin.py").write_text(source, encoding="utf-8")
    (tmp_path / "station.toml").write_text(STATION, encoding="utf-8")
    code, _, err = call("run", "coil", "--station", "station.toml", "--motor", "lg-400w", "--rehearse")
    assert code != 0
    assert "plugin.py" in err
    assert "parameter coil_resistance: unit 'Ohmz' is no unit; allowed are " in err
