"""The roles of the instruments on a bench, one row each."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from drivers.interfaces.bldc_drive import BldcDrive
from drivers.interfaces.declarations import Effect, declarations
from drivers.interfaces.dynamometer import Dynamometer
from drivers.interfaces.insulation_tester import InsulationTester
from drivers.interfaces.inverter import Inverter
from drivers.interfaces.lcr_meter import LcrMeter
from drivers.interfaces.oscilloscope import Oscilloscope
from drivers.interfaces.rotor_actuator import RotorActuator
from drivers.interfaces.supply import Supply
from drivers.interfaces.switch_matrix import SwitchMatrix
from drivers.interfaces.tachometer import Tachometer
from drivers.interfaces.text import Text, text
from drivers.interfaces.voltmeter import Voltmeter


class Role(Enum):
    """The role of an instrument on the bench, by its name in the station file."""

    SUPPLY = "supply"
    LCR_METER = "lcr_meter"
    OSCILLOSCOPE = "oscilloscope"
    DYNAMOMETER = "dynamometer"
    TACHOMETER = "tachometer"
    INVERTER = "inverter"
    VOLTMETER = "voltmeter"
    DRIVE = "drive"
    SWITCH_MATRIX = "switch_matrix"
    ROTOR_ACTUATOR = "rotor_actuator"
    INSULATION_TESTER = "insulation_tester"

    @property
    def interface(self) -> type:
        """The interface of its instruments."""
        return ROLES[self].interface

    @property
    def feeds(self) -> bool:
        """Return whether its instruments feed energy or move the shaft."""
        return any(one.effect is Effect.ENERGISES for one in declarations(self.interface).values())


@dataclass(frozen=True)
class RoleSpec:
    """Definition of a role: its interface, its name for people, what brings it to its harmless state in a shutdown sequence.

    `feeds_winding` is for those that feed the motor's terminals, `in_fixture` for those that do what hands do otherwise.
    `withstands` is the voltage (V, peak) of others that the leads of any instrument in the role may be left on; one that states its
    own goes by that. Beside one that is `alone` on the winding nothing is left, for it would falsify the reading or be harmed.
    One that measures direct voltage only is not left on while something turns the shaft.
    """

    interface: type
    label: Text
    off_by: str
    feeds_winding: bool = False
    in_fixture: bool = False
    withstands: float = 0.0
    alone: bool = False
    direct_only: bool = False


#: Extra-low voltage: 60 V DC (IEC 61140); any voltmeter and any oscilloscope's probe takes that.
_EXTRA_LOW = 60.0
#: In the order in which a shutdown sequence switches them off. Contacts that part under current burn: relays are the last.
ROLES: Mapping[Role, RoleSpec] = {
    Role.INSULATION_TESTER: RoleSpec(InsulationTester, text("Insulation tester"), "output_off", alone=True),
    Role.INVERTER: RoleSpec(Inverter, text("Inverter"), "disable", feeds_winding=True),
    Role.DRIVE: RoleSpec(BldcDrive, text("Six-step drive"), "disable", feeds_winding=True),
    Role.DYNAMOMETER: RoleSpec(Dynamometer, text("Dynamometer"), "disable"),
    Role.ROTOR_ACTUATOR: RoleSpec(RotorActuator, text("Rotor actuator"), "disable", in_fixture=True),
    Role.SUPPLY: RoleSpec(Supply, text("DC supply"), "output_off", feeds_winding=True),
    Role.LCR_METER: RoleSpec(LcrMeter, text("LCR meter"), "silence", alone=True),
    Role.OSCILLOSCOPE: RoleSpec(Oscilloscope, text("Oscilloscope"), "silence", withstands=_EXTRA_LOW),
    Role.TACHOMETER: RoleSpec(Tachometer, text("Tachometer"), "silence"),
    Role.VOLTMETER: RoleSpec(Voltmeter, text("Voltmeter"), "silence", withstands=_EXTRA_LOW, direct_only=True),
    Role.SWITCH_MATRIX: RoleSpec(SwitchMatrix, text("Switch matrix"), "open", in_fixture=True),
}
