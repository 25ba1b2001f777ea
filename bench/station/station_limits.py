"""`[instruments.<role>.limits]`: what a station allows the instrument in a role, in SI units, whatever its driver."""

from collections.abc import Mapping
from typing import Any

from bench.files.toml_file import Section, validate
from bench.i18n.errors import FileError
from bench.motor.motor_sections import number
from drivers.interfaces.text import text
from procedures.core.bench import Role

#: Key of an instrument's table under which its limits stand.
KEY = "limits"


class SupplyLimits(Section):
    """Voltage and current limit that the output may be set to."""

    maximum_voltage: float | None = number("V", None, above=0.0, up_to=1e4)
    maximum_current: float | None = number("A", None, above=0.0, up_to=1e4)


class LcrMeterLimits(Section):
    """Test signal."""

    maximum_level: float | None = number("V", None, above=0.0, up_to=100.0, description="rms, open circuit")
    maximum_frequency: float | None = number("Hz", None, above=0.0, up_to=1e9)


class InverterLimits(Section):
    """Phase current and electrical frequency."""

    maximum_current: float | None = number("A", None, above=0.0, up_to=1e4, description="phase, peak")
    maximum_frequency: float | None = number("Hz", None, above=0.0, up_to=1e5, description="electrical")


class DriveLimits(Section):
    """DC link's voltage before the bridge runs; its current and the electrical frequency while it does."""

    maximum_voltage: float | None = number("V", None, above=0.0, up_to=1e4)
    maximum_current: float | None = number("A", None, above=0.0, up_to=1e4)
    maximum_frequency: float | None = number("Hz", None, above=0.0, up_to=1e5, description="electrical")


class DynamometerLimits(Section):
    """Speed and torque."""

    maximum_speed: float | None = number("rad/s", None, above=0.0, up_to=1e5, description="mechanical")
    maximum_torque: float | None = number("N·m", None, above=0.0, up_to=1e5)


class InsulationTesterLimits(Section):
    """Test voltage."""

    maximum_voltage: float | None = number("V", None, above=0.0, up_to=1e4, description="DC, of an insulation test")


class RotorActuatorLimits(Section):
    """Speed at which it turns the shaft."""

    maximum_speed: float | None = number("rad/s", None, above=0.0, up_to=1e5, description="mechanical")


SECTIONS: Mapping[Role, type[Section]] = {
    Role.SUPPLY: SupplyLimits,
    Role.LCR_METER: LcrMeterLimits,
    Role.INVERTER: InverterLimits,
    Role.DRIVE: DriveLimits,
    Role.DYNAMOMETER: DynamometerLimits,
    Role.INSULATION_TESTER: InsulationTesterLimits,
    Role.ROTOR_ACTUATOR: RotorActuatorLimits,
}


def take_limits(
    role: Role, table: Mapping[str, Any], source: str, prefix: str
) -> tuple[dict[str, float], dict[str, Any]]:
    """Return an instrument's limits by key, and its table without them. Raises InputError naming file, key and range."""
    rest = {key: value for key, value in table.items() if key != KEY}
    if KEY not in table:
        return {}, rest
    section = SECTIONS.get(role)
    if section is None:
        limited = ", ".join(known.value for known in SECTIONS)
        raise FileError(
            text(
                "{source}: {prefix}.{key}: this instrument has no output to limit; only {limited} have limits. "
                "Remove the table from the file",
                source=source,
                prefix=prefix,
                key=KEY,
                limited=limited,
            )
        )
    given = table[KEY]
    if not isinstance(given, Mapping):
        raise FileError(
            text(
                "{source}: {prefix}.{key} = {given}; allowed is a table with {keys}",
                source=source,
                prefix=prefix,
                key=KEY,
                given=repr(given),
                keys=list(section.model_fields),
            )
        )
    read = validate(section, given, source, f"{prefix}.{KEY}")
    return {key: float(value) for key, value in read.model_dump().items() if value is not None}, rest
