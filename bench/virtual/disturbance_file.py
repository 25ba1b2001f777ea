"""Disturbances of a virtual bench: a TOML file with tables of channels, dynamometer, contacts, hands and inverter."""

import math
from pathlib import Path

from pydantic import Field

from bench.files.toml_file import Section, read, validate
from bench.motor.motor_sections import number
from drivers.interfaces.text import text
from sim_instruments.disturbances.bench import Contacts, Disturbances, Hands, ShaftSensors, SupplyRipple
from sim_instruments.disturbances.channel import ChannelPath
from sim_instruments.disturbances.current_loop import CurrentLoop

_TURN = 2.0 * math.pi


class ChannelSection(Section):
    """`[channels.N]`: probe, lead and input of a channel of the oscilloscope; V is A where the probe senses current."""

    factor: float = number("", 1.0, at_least=-1e4, up_to=1e4, description="shown over true")
    limit: float | None = number("V", None, above=0.0, up_to=1e6, description="where the probe's amplifier saturates")
    bow: float = number("1/V", 0.0, at_least=-1e3, up_to=1e3, description="distortion of second order")
    compensation: float = number("", 0.0, at_least=-0.99, up_to=10.0, description="more at high frequencies than at DC")
    compensation_time: float = number("s", 1.0e-3, above=0.0, up_to=1e3)
    pole: float | None = number("Hz", None, above=0.0, up_to=1e12, description="bandwidth, first order")
    resonance: float | None = number("Hz", None, above=0.0, up_to=1e12, description="leads and input, second order")
    damping: float = number("", 0.1, above=0.0, below=1.0, description="of the resonance; 1 is critical")
    skew: float = number("s", 0.0, at_least=-1.0, up_to=1.0, description="delay against the other channels")
    offset: float = number("V", 0.0, at_least=-1e6, up_to=1e6)
    wander: float = number("V", 0.0, at_least=0.0, up_to=1e6, description="amplitude")
    wander_period: float = number("s", 10.0, above=0.0, up_to=1e6)
    wander_phase: float = number("rad", 0.0, at_least=-_TURN, up_to=_TURN)
    hum: float = number("V", 0.0, at_least=0.0, up_to=1e6, description="amplitude")
    hum_frequency: float = number("Hz", 50.0, above=0.0, up_to=1e6)
    hum_phase: float = number("rad", 0.0, at_least=-_TURN, up_to=_TURN)
    coupling_corner: float = number("Hz", 0.0, at_least=0.0, up_to=1e6, description="AC coupling; 0 is DC")
    warm_up: float = number("", 0.0, at_least=-0.99, up_to=10.0, description="rise of the gain, relative")
    warm_up_time: float = number("s", 300.0, above=0.0, up_to=1e6)
    jitter: float = number("s", 0.0, at_least=0.0, up_to=1.0, description="standard deviation of the sampling instants")

    def path(self) -> ChannelPath:
        """Return it as the virtual oscilloscope takes it."""
        given = self.model_dump()
        for name in ("limit", "pole", "resonance"):
            given[name] = math.inf if given[name] is None else given[name]
        return ChannelPath(**given)


class DynamometerSection(Section):
    """`[dynamometer]`: torque transducer and speed sensor."""

    torque_filter: float = number("s", 0.0, at_least=0.0, up_to=60.0, description="time constant; 0 is none")
    speed_filter: float = number("s", 0.0, at_least=0.0, up_to=60.0, description="time constant; 0 is none")
    dropouts: float = number("", 0.0, at_least=0.0, below=1.0, description="share of readings that come as zeros")
    speed_runout: float = number("", 0.0, at_least=0.0, up_to=1.0, description="relative amplitude, once a turn")
    torque_runout: float = number("N·m", 0.0, at_least=0.0, up_to=1e3, description="amplitude, once a turn")
    pulses: int = number(
        "", 0, at_least=0, up_to=1_000_000, description="of the speed sensor, a turn; 0 does not count"
    )
    torque_drift: float = number("N·m/s", 0.0, at_least=0.0, up_to=1e3, description="of the zero")
    vibration: float = number("N·m", 0.0, at_least=0.0, up_to=1e3, description="amplitude")
    vibration_frequency: float = number("Hz", 25.0, above=0.0, up_to=1e6)


class ContactsSection(Section):
    """`[contacts]`: clamps on the motor, and the voltmeter's."""

    thermal_emf: float = number("V", 0.0, at_least=0.0, up_to=1.0, description="when the clamp has been put on")
    thermal_time: float = number("s", 60.0, above=0.0, up_to=1e6)
    resistance: float = number("ohm", 0.0, at_least=0.0, up_to=1e6, description="of each on the motor")
    doubling_current: float = number("A", 10.0, above=0.0, up_to=1e6)
    remaking: float = number(
        "", 0.5, at_least=0.0, up_to=3.0, description="of ln(resistance), from one contact to the next"
    )
    heating_time: float = number("s", 5.0, above=0.0, up_to=1e6)
    kelvin: bool = Field(default=False, description="each lead has its own contact, nothing senses another's")


class HandsSection(Section):
    """`[hands]`: how hands turn and type."""

    unevenness: float = number("", 0.0, at_least=0.0, below=1.0, description="of the speed; 0 leaves the usual tenth")
    regrips: float = number("", 0.0, at_least=0.0, up_to=100.0, description="stops a turn")
    regrip_time: float = number("s", 0.4, above=0.0, up_to=60.0)
    slips: float = number("", 0.0, at_least=0.0, up_to=1.0, description="share of typed readings, of the decimal point")
    thermometer_share: float = number(
        "", 1.0, at_least=0.0, up_to=1.0, description="of the winding's warmth over the room"
    )


class InverterSection(Section):
    """`[inverter]`: legs, sensors, encoder and timing of a drive that regulates currents at its rotor's angle."""

    dead_time: float = number("s", 0.0, at_least=0.0, up_to=1e-3, description="of a leg, twice a period")
    device_drop: float = number("V", 0.0, at_least=0.0, up_to=100.0, description="of what conducts, at no current")
    device_resistance: float = number("ohm", 0.0, at_least=0.0, up_to=100.0, description="of what conducts")
    knee_current: float = number("A", 0.0, at_least=0.0, up_to=1e4, description="below it dead time and drop fade")
    current_gain: float = number("", 0.0, at_least=-0.5, up_to=0.5, description="flowing over shown, minus 1")
    current_offset_a: float = number("A", 0.0, at_least=-1e3, up_to=1e3, description="of phase A's sensor")
    current_offset_b: float = number("A", 0.0, at_least=-1e3, up_to=1e3, description="of phase B's sensor")
    voltage_gain: float = number("", 0.0, at_least=-0.5, up_to=0.5, description="shown over real, minus 1")
    angle_error: float = number("rad", 0.0, at_least=-_TURN, up_to=_TURN, description="electrical, of the encoder")
    voltage_delay: float = number("s", 0.0, at_least=-1e-2, up_to=1e-2, description="of the voltage behind its command")
    current_noise: float = number("A", 0.0, at_least=0.0, up_to=1e3, description="standard deviation of a reading")
    voltage_noise: float = number("V", 0.0, at_least=0.0, up_to=1e3, description="standard deviation of a reading")


class SupplySection(Section):
    """`[supply]`: what is on the output of the DC supply."""

    ripple: float = number("V", 0.0, at_least=0.0, up_to=100.0, description="amplitude of a triangle")
    frequency: float = number("Hz", 100.0, at_least=10.0, up_to=1000.0, description="100 or 120 Hz behind a rectifier")


class ChannelsSection(Section):
    """`[channels]`: the oscilloscope's, by number."""

    first: ChannelSection | None = Field(default=None, alias="1")
    second: ChannelSection | None = Field(default=None, alias="2")
    third: ChannelSection | None = Field(default=None, alias="3")
    fourth: ChannelSection | None = Field(default=None, alias="4")

    def paths(self) -> dict[int, ChannelPath]:
        """Return those that are given, by number."""
        given = (self.first, self.second, self.third, self.fourth)
        return {number: section.path() for number, section in enumerate(given, 1) if section is not None}


class _File(Section):
    channels: ChannelsSection = ChannelsSection.model_validate({})
    dynamometer: DynamometerSection = DynamometerSection()
    contacts: ContactsSection = ContactsSection()
    hands: HandsSection = HandsSection()
    inverter: InverterSection = InverterSection()
    supply: SupplySection = SupplySection()


def load_disturbances(path: Path) -> Disturbances:
    """Return what a file says. Raises InputError with file, key and what is allowed for a bad one."""
    _, data = read(path, text("file of disturbances"))
    file = validate(_File, data, str(path))
    return Disturbances(
        file.channels.paths(),
        ShaftSensors(**file.dynamometer.model_dump()),
        Contacts(**file.contacts.model_dump()),
        Hands(**file.hands.model_dump()),
        CurrentLoop(**file.inverter.model_dump()),
        SupplyRipple(**file.supply.model_dump()),
    )
