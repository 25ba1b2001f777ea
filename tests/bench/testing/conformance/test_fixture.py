"""The fixture `conformance` as a plug-in's author has it: a project of two files, its tests in a process of their own."""

import subprocess

import pytest

from tests.bench.testing.own_pytest import own_pytest

PLUGIN = """
from dataclasses import replace
from drivers.lutron.options import TACHOMETER
from sim_instruments.instruments.lutron.catalogue import TACHOMETER as SIMULATED

GOOD = replace(TACHOMETER, name="acme-tachometer", simulated="acme-tachometer")
WRONG = replace(GOOD, name="acme-mistaken", opener="acme_mistaken:Mistaken.open")
SHOWN = replace(SIMULATED, name="acme-tachometer")
"""
MISTAKEN = """
from dataclasses import replace
from drivers.lutron.tachometer import LutronTachometer


class Mistaken(LutronTachometer):
    def measure_speed(self):
        reading = super().measure_speed()
        return replace(reading, value=2.0 * reading.value)
"""
TESTS = """
def test_good(conformance):
    report = conformance.files("acme.py").driver("acme-tachometer")
    assert len(report.findings) > 30


def test_mistaken(conformance):
    conformance.files("acme.py").driver("acme-mistaken")
"""


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> subprocess.CompletedProcess[str]:
    """The project's tests, as pytest ended with them."""
    folder = tmp_path_factory.mktemp("acme")
    for name, content in (("acme.py", PLUGIN), ("acme_mistaken.py", MISTAKEN), ("test_acme.py", TESTS)):
        (folder / name).write_text(content, encoding="utf-8")
    return own_pytest(folder, folder)


@pytest.mark.slow
def test_a_driver_that_conforms_passes_and_a_mistaken_one_fails(done: subprocess.CompletedProcess[str]) -> None:
    assert "1 failed, 1 passed" in done.stdout, done.stdout + done.stderr


def test_a_failure_lists_what_was_wrong_and_what_to_do(done: subprocess.CompletedProcess[str]) -> None:
    assert "acme-mistaken (tachometer) does not conform:" in done.stdout
    assert "speed reading: value: " in done.stdout
    assert "Compare scale, sign and unit with the maker's manual" in done.stdout
