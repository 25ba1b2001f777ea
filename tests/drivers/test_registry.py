"""The registry: names, options, lazy imports, and opening."""

import subprocess
import sys
from collections.abc import Sequence
from typing import Any

import pytest

from bench.plugins.catalogues import installed
from drivers.catalogue import MANUAL, Driver, Surroundings
from drivers.interfaces import Accuracy, Instrument, InstrumentError, Role, Voltmeter
from drivers.interfaces.text import Text
from drivers.keysight.e36300 import KeysightE36300
from drivers.keysight.options import E36300Options
from drivers.lutron.options import LutronTachometerOptions
from drivers.manual.options import ManualTachometerOptions
from drivers.manual.prompt import Option
from drivers.manual.tachometer import ManualTachometer


def find(name: str, role: Role) -> Driver:
    driver = installed().driver(name, role)
    assert driver is not None
    return driver


def test_every_role_has_an_automatic_driver_and_what_hands_can_do_a_manual_one() -> None:
    assert {role: tuple(sorted(installed().drivers_for(role))) for role in Role} == {
        Role.SUPPLY: ("keysight-e36300", "manual"),
        Role.LCR_METER: ("keysight-e4980a", "manual"),
        Role.OSCILLOSCOPE: ("capture-files", "keysight-infiniivision", "manual"),
        Role.DYNAMOMETER: ("delta-dyn200", "manual"),
        Role.TACHOMETER: ("lutron-tachometer", "manual"),
        Role.INVERTER: ("cia402-inverter", "manual", "mjbots-moteus"),
        Role.DRIVE: ("cia402-six-step", "manual"),
        Role.VOLTMETER: ("keysight-34461a", "manual"),
        # Hands need no instrument in their own place, and nobody holds a test voltage by hand.
        Role.SWITCH_MATRIX: ("keysight-34970a",),
        Role.ROTOR_ACTUATOR: ("cia402-rotor-actuator",),
        Role.INSULATION_TESTER: ("gwinstek-gpt9800",),
    }


def test_declarations_import_no_transport() -> None:
    code = (
        "import sys\nfrom bench.plugins.catalogues import installed\nassert len(installed().drivers) > 10\n"
        "print([name for name in ('pyvisa', 'pymodbus', 'serial', 'can', 'canopen') if name in sys.modules])"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_opening_over_visa(manager: Any, connect: Any, settings_class: Any, clock: Any) -> None:
    left = {"OUTP:PAIR?": "OFF", "OUTP:TRAC?": "0", "VOLT:SENS? (@1)": "INT"}
    left |= {"VOLT:MODE? (@1)": "FIX", "CURR:MODE? (@1)": "FIX"}
    connect("TCPIP0::supply::inst0::INSTR", settings_class("Keysight Technologies,E36312A,MY1,1.0", left))
    surroundings = Surroundings(clock, visa=lambda: manager)
    supply = find("keysight-e36300", Role.SUPPLY).open(
        "TCPIP0::supply::inst0::INSTR", E36300Options(), surroundings, name="left supply"
    )
    assert isinstance(supply, KeysightE36300)
    supply.close()


def test_opening_by_hand(clock: Any) -> None:
    class Person:
        def ask(self, quantity: Text, unit: str, minimum: float, maximum: float, context: Text | None) -> float:
            return 60.0

        def choose(self, quantity: Text, options: Sequence[Option]) -> float:
            raise AssertionError(quantity)

        def confirm(self, task: Text) -> None:
            raise AssertionError(task)

    options = ManualTachometerOptions(accuracy=Accuracy(offset=0.1))
    made = find(MANUAL, Role.TACHOMETER).open("", options, Surroundings(clock, prompt=Person()))
    assert isinstance(made, ManualTachometer)
    assert made.measure_speed().value == pytest.approx(6.2832, rel=1e-4)


def test_options_of_another_driver_are_refused(clock: Any) -> None:
    with pytest.raises(TypeError, match="keysight-e36300 takes E36300Options, not LutronTachometerOptions"):
        find("keysight-e36300", Role.SUPPLY).open("", LutronTachometerOptions(), Surroundings(clock))


def test_what_is_missing_is_said(clock: Any) -> None:
    with pytest.raises(ValueError, match="VISA resource manager"):
        find("keysight-e36300", Role.SUPPLY).open("", E36300Options(), Surroundings(clock))
    with pytest.raises(ValueError, match="person to ask"):
        find(MANUAL, Role.TACHOMETER).open("", ManualTachometerOptions(), Surroundings(clock))


def test_only_manual_drivers_need_no_address() -> None:
    assert all(
        driver.needs_address is (driver.name not in (MANUAL, "capture-files"))
        for drivers in installed().drivers.values()
        for driver in drivers
    )


class SeemsASupply:
    """Has a supply's methods, but declares none of them."""

    identity = "seems a supply"

    def close(self) -> None:
        """Nothing is open."""


def test_what_is_opened_is_of_the_roles_interface(clock: Any) -> None:
    driver = Driver("seeming", Role.SUPPLY, E36300Options, lambda *_: SeemsASupply())  # type: ignore[arg-type,return-value]
    with pytest.raises(
        InstrumentError, match=r"left supply: what driver seeming makes, SeemsASupply, is no \w+"
    ) as refused:
        driver.open("", E36300Options(), Surroundings(clock), name="left supply")
    assert "Derive its class from drivers.interfaces." in str(refused.value)


class Unfinished(Voltmeter):
    """A voltmeter that cannot measure."""


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (SeemsASupply, "what driver own makes, SeemsASupply, is no Voltmeter"),
        (Unfinished, "what driver own makes, Unfinished, is no Voltmeter: it has no"),
        (Voltmeter, ""),
        (Instrument, ""),
        ("NoSuchClass", ""),
    ],
)
def test_what_does_not_fit_shows_without_an_instrument(made: Any, said: str) -> None:
    def opened(*_: object) -> Any:
        raise AssertionError("nothing is opened")

    opened.__annotations__["return"] = made
    unfit = Driver("own", Role.VOLTMETER, E36300Options, opened).unfit()
    assert str(unfit or "").startswith(said)
    assert bool(unfit) == bool(said)
    if isinstance(made, type) and said:
        assert str(Driver("own", Role.VOLTMETER, E36300Options, made).unfit()).startswith(said)  # type: ignore[arg-type]


def test_an_abstract_class_is_refused_in_one_sentence(clock: Any) -> None:
    interface: Any = Role.SUPPLY.interface
    driver = Driver("unfinished", Role.SUPPLY, E36300Options, lambda *_: type("Half", (interface,), {})())
    with pytest.raises(InstrumentError, match=r"^supply: driver unfinished: .*abstract"):
        driver.open("", E36300Options(), Surroundings(clock))
