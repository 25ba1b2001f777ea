"""Plug-ins that get in each other's way: one name, one parameter, sentences that cannot be made."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from bench.i18n.language import translator
from bench.plugins.catalogue import Origin, UnloadedDeclaration
from bench.plugins.catalogues import Catalogues, installed
from bench.plugins.files import PluginsSection, catalogues_of
from tests.bench.plugins.test_catalogues import wheel
from tests.command_line import Call

PROCEDURE = """
from typing import ClassVar
from drivers.interfaces.text import text
from pydantic import Field
from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.procedure import Procedure
from procedures.core.settings import Settings
from procedures.core.steps import step

class CoilSettings(Settings):
    current: float = Field(default=2.0, description="current, A")

class Coil(Procedure[CoilSettings]):
    name = "NAME"
    title = "Coil"
    section = "plant"
    roles = frozenset()
    gives = (ParameterDefinition("brake_coil_resistance", "R_br", "UNIT", text("Coil")),)

    def measure(self):
        self.read()

    @step("plant/2", "Hold {current:g} A")
    def read(self):
        pass
"""
Declared = Callable[..., UnloadedDeclaration]


def procedure(name: str = "coil", unit: str = "Ω", sentence: str = "Hold {current:g} A") -> str:
    """The code of a plug-in with one procedure."""
    return PROCEDURE.replace("NAME", name).replace("UNIT", unit).replace("Hold {current:g} A", sentence)


@pytest.fixture
def declared(tmp_path: Path) -> Declared:
    """Makes an entry of an installed distribution out of code."""

    def make(origin: str, code: str, name: str) -> UnloadedDeclaration:
        def load() -> object:
            (tmp_path / f"{origin}.py").write_text(code, encoding="utf-8")
            section = PluginsSection(files=[f"{origin}.py"])
            (file,) = catalogues_of(section, str(tmp_path / "s.toml"), Catalogues({})).files
            if file.error is not None:
                raise ImportError(str(file.error))
            return file.entries["procedures"][0].load()

        return UnloadedDeclaration(name, Origin(origin, "1.0"), load)

    return make


def together(*entries: UnloadedDeclaration) -> Catalogues:
    """Catalogues of ours and entries of others."""
    ours = installed().entries
    return Catalogues({**ours, "procedures": (*ours["procedures"], *entries)})


def test_an_entry_that_cannot_be_loaded_holds_no_name(declared: Declared) -> None:
    found = together(declared("bad", "import no_such_library", "coil"), declared("good", procedure(), "coil"))
    assert str(found.procedures.origin("coil")) == "good 1.0"
    assert found.procedures["coil"].title == "Coil"
    (broken,) = found.broken(load=False)
    assert str(broken.sentence).startswith("coil from bad 1.0 cannot be used: ImportError: ModuleNotFoundError")


def test_of_two_that_can_be_loaded_the_first_has_the_name(declared: Declared) -> None:
    found = together(declared("first", procedure(), "coil"), declared("second", procedure(), "coil"))
    (broken,) = found.broken(load=False)
    assert str(broken.sentence) == "coil from second 1.0 cannot be used: the name is taken by first 1.0"
    assert str(found.procedures.origin("coil")) == "first 1.0"


def test_of_two_that_cannot_be_loaded_both_are_told(declared: Declared) -> None:
    found = together(declared("bad", "x = (", "coil"), declared("worse", "import no_such_library", "coil")).procedures
    assert "coil" not in found
    said = str(found.why_not("coil"))
    assert "coil from bad 1.0 cannot be used" in said
    assert "coil from worse 1.0 cannot be used" in said
    assert str(found.origin("coil")) == "bad 1.0"


@pytest.mark.parametrize("asked", ["coil", "other"])
def test_two_strangers_do_not_define_one_parameter_in_two_units(declared: Declared, asked: str) -> None:
    """Whichever is asked for first, the same one is refused."""
    found = together(declared("a", procedure(), "coil"), declared("b", procedure("other", "H"), "other")).procedures
    assert (asked in found) == (asked == "coil")
    assert ("coil" in found, "other" in found) == (True, False)
    assert str(found.why_not("other")) == (
        "other from b 1.0 cannot be used: parameter brake_coil_resistance is defined with unit H, but with Ω in "
        "coil from a 1.0; rename it in one of the two, or uninstall one"
    )
    assert (
        found.why_not("other")
        .render(translator("zh"))
        .startswith("b 1.0 的 other 无法使用：参数 brake_coil_resistance")
    )


def test_two_strangers_may_define_one_parameter_alike(declared: Declared) -> None:
    found = together(declared("a", procedure(), "coil"), declared("b", procedure("other"), "other"))
    assert found.broken() == ()


def test_a_file_beside_a_station_does_not_define_an_installed_ones_parameter_otherwise(
    declared: Declared, tmp_path: Path
) -> None:
    (tmp_path / "plugin.py").write_text(procedure("other", "H"), encoding="utf-8")
    base = together(declared("acme", procedure(), "coil"))
    found = catalogues_of(PluginsSection(files=["plugin.py"]), str(tmp_path / "s.toml"), base).procedures
    assert ("coil" in found, "other" in found) == (True, False)
    said = str(found.why_not("other"))
    assert said.startswith(f"other from {tmp_path / 'plugin.py'} cannot be used: parameter brake_coil_resistance")
    assert "with unit H, but with Ω in coil from acme 1.0" in said


@pytest.mark.parametrize(
    ("sentence", "said"),
    [
        ("x {nosuch:g}", "step plant/2 names {nosuch} in its sentence, which is no setting; there are current"),
        ("x {}", "step plant/2 names {} in its sentence"),
        ("x {current:q}", "step plant/2: the sentence 'x {current:q}' cannot be made of the settings: Unknown format"),
        ("x {current", "step plant/2: the sentence 'x {current' cannot be made of the settings: expected '}'"),
    ],
)
def test_a_sentence_that_cannot_be_made_is_told_before_anything_starts(
    call: Call, tmp_path: Path, sentence: str, said: str
) -> None:
    (tmp_path / "plugin.py").write_text(procedure(sentence=sentence), encoding="utf-8")
    (tmp_path / "s.toml").write_text('[station]\nname = "s"\n[plugins]\nfiles = ["plugin.py"]\n', encoding="utf-8")
    code, out, err = call("procedures", "--station", "s.toml")
    assert code == 0
    assert "pole-pairs-back-emf" in out
    assert said in err
    code, _, err = call("run", "coil", "--station", "s.toml", "--motor", "lg-400w")
    assert code == 2
    assert said in err
    assert not (tmp_path / "runs").exists()


def test_a_procedure_with_values_of_its_own_in_its_sentences_is_listed(call: Call, tmp_path: Path) -> None:
    own = "    def step_values(self):\n        return {'mine': 1.0}\n"
    (tmp_path / "plugin.py").write_text(procedure(sentence="x {mine:g}") + own, encoding="utf-8")
    (tmp_path / "s.toml").write_text('[station]\nname = "s"\n[plugins]\nfiles = ["plugin.py"]\n', encoding="utf-8")
    code, out, err = call("procedures", "--station", "s.toml")
    assert (code, err) == (0, "")
    assert "x {mine:g}" in out


def test_settings_without_a_default_are_told(declared: Declared) -> None:
    code = procedure().replace("default=2.0, ", "")
    found = together(declared("a", code, "coil")).procedures
    assert "coil" not in found
    assert str(found.why_not("coil")) == "coil from a 1.0 cannot be used: CoilSettings has no default: current"


def test_what_is_known_of_a_parameter_is_what_the_catalogue_took(tmp_path: Path) -> None:
    """Two ways lead to the installed procedures; of definitions that differ both take the same one."""
    entries = "[motorbench.procedures]\n{} = {}:Coil\n"
    late = wheel(tmp_path, "z_bench", entries.format("a-coil", "z_coil"), {"z_coil": procedure("a-coil", "H")})
    early = wheel(tmp_path, "a_bench", entries.format("z-coil", "a_coil"), {"a_coil": procedure("z-coil", "Ω")})
    program = (
        "from bench.plugins.catalogues import installed\n"
        "from procedures.known_parameters import definition_of\n"
        "found = installed().procedures\n"
        "print('a-coil' in found, 'z-coil' in found, ascii(definition_of('brake_coil_resistance').unit))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (late, early)))},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.stdout, done.stderr) == ("False True '\\u03a9'\n", "")


@pytest.mark.parametrize(
    ("requires", "said"),
    [
        (["motorbench<0.0.1"], ["acme_bench 1.2 requires motorbench <0.0.1, and this is "]),
        (["Motorbench >=0.0.1", "numpy<0.1", 'motorbench<0.0.1; extra == "x"'], []),
        (["motorbench<<1"], ["acme_bench 1.2: its requirement 'motorbench<<1' cannot be read"]),
    ],
)
def test_a_package_that_was_made_for_another_motorbench_is_told(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, requires: list[str], said: list[str]
) -> None:
    entries = "[motorbench.procedures]\ncoil = acme_coil:Coil\n"
    monkeypatch.syspath_prepend(str(wheel(tmp_path, "acme_bench", entries, {"acme_coil": procedure()}, requires)))
    acme = UnloadedDeclaration("coil", Origin("acme_bench", "1.2"), lambda: None)
    found = Catalogues({"procedures": (acme,)})
    monkeypatch.setattr("bench.cli.doctor.installed", lambda: found)
    problems = [one for one in json.loads(call("doctor", "--json")[1])["problems"] if "acme_bench" in one]
    monkeypatch.setattr("bench.cli.station.drivers.catalogues_at", lambda _: found)
    listed = json.loads(call("station", "drivers", "--json")[1])["unmet_requirements"]
    assert listed == problems
    assert len(listed) == len(said)
    assert all(line.startswith(start) for line, start in zip(listed, said, strict=True))
    err = call("station", "drivers")[2]
    assert all(line in err for line in listed)
