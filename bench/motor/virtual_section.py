"""`[virtual]` of a motor file: the true values of a virtual motor, by constants or on a flux map."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator
from pydantic_core import PydanticCustomError

from bench.files.toml_file import Section
from bench.motor.motor_insides import InsideSection
from bench.motor.motor_sections import number
from drivers.interfaces.text import text
from procedures.core.nameplate import WindingConnection
from sim_instruments.physics.motor.bearing import Bearing
from sim_instruments.physics.motor.flux_map import FluxMap
from sim_instruments.physics.motor.iron import Iron
from sim_instruments.physics.motor.magnets import Magnets
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.physics.motor.shorted_turns import ShortedTurns

Resistance = Annotated[float, Field(gt=0.0, le=1e4, strict=True)]
Share = Annotated[float, Field(ge=0.0, le=2.0, strict=True)]
TurnShare = Annotated[float, Field(gt=0.0, le=2.0, strict=True)]


class FluxHarmonic(Section):
    """One harmonic of the EMF: its order, its amplitude relative to the fundamental's, its phase (rad)."""

    order: int = number("", at_least=2, up_to=100)
    amplitude: float = number("", at_least=0.0, up_to=1.0, description="relative to the fundamental of the EMF")
    phase: float = number("rad", 0.0, at_least=-2.0 * math.pi, up_to=2.0 * math.pi)


class BearingSection(Section):
    """`[virtual.bearing]`: drag beside Coulomb and viscous friction."""

    windage: float = number(
        "N·m·s²/rad²", 0.0, at_least=0.0, up_to=1e3, description="drag over the square of the speed"
    )
    stribeck_torque: float = number(
        "N·m", 0.0, at_least=0.0, up_to=1e3, description="on top of Coulomb friction at standstill"
    )
    stribeck_speed: float = number("rad/s", 10.0, above=0.0, up_to=1e5, description="at which a 1/e of it is left")
    stribeck_exponent: float = number("", 1.0, at_least=0.5, up_to=4.0)
    cogging_while_turning: bool | None = Field(
        default=None,
        strict=True,
        description="true or false: whether the shaft feels its cogging while it coasts or is driven as well; where that is more than "
        "its dry friction, if it is not given",
    )


class IronSection(Section):
    """`[virtual.iron]`: loss, eddy currents, and what speed does to the flux linkage."""

    eddy_coupling: float = number("", 0.0, at_least=0.0, below=1.0, description="share of the flux, k")
    eddy_resistance: float = number("ohm", 1.0, above=0.0, up_to=1e6, description="of a winding's shorted turn")
    emf_corner: float | None = number("Hz", None, above=0.0, up_to=1e7, description="electrical; without it none")
    magnet_rise: float = number("K", 0.0, at_least=0.0, up_to=300.0, description="of the magnets over the winding")
    magnet_rise_speed: float = number("rad/s", 100.0, above=0.0, up_to=1e5, description="mechanical, at which it holds")
    hysteresis_loss: float = number(
        "A/(V·s)",
        0.0,
        at_least=0.0,
        up_to=1e6,
        description="current per flux linkage, at any speed; of the Y-equivalent",
    )
    eddy_loss: float = number(
        "1/ohm",
        0.0,
        at_least=0.0,
        up_to=1e3,
        description="current per voltage that the flux induces; of the Y-equivalent",
    )

    def iron(self) -> Iron:
        """Return it as the virtual motor takes it."""
        corner = math.inf if self.emf_corner is None else self.emf_corner
        return Iron(
            self.eddy_coupling,
            self.eddy_resistance,
            corner,
            self.magnet_rise,
            self.magnet_rise_speed,
            self.hysteresis_loss,
            self.eddy_loss,
        )


class MagnetsSection(Section):
    """`[virtual.magnets]`: magnets that warm up behind the winding."""

    time_constant: float = number("s", above=0.0, up_to=1e6)
    winding_share: float = number(
        "", 1.0, at_least=0.0, up_to=1.0, description="of the winding's rise that reaches the magnets in the end"
    )
    thermal_resistance: float = number(
        "K/W", 0.0, at_least=0.0, up_to=1e3, description="of the iron's loss to the magnets"
    )


class FluxMapSection(Section):
    """`[virtual.flux_map]`: flux linkages over both currents, from a table."""

    file: str = Field(min_length=1, max_length=255, description="the name of a CSV file, seen from this one's folder")
    magnet_temperature: float = number("°C", 25.0, at_least=-40.0, up_to=300.0, description="of the table")


class ShortedTurnsSection(Section):
    """`[virtual.shorted_turns]`: turns of one winding that are shorted."""

    winding: Literal["A", "B", "C"] = Field(description="A, B or C; of a delta AB, BC, CA")
    share: float = number("", above=0.0, below=1.0, description="of the winding's turns")
    resistance: float = number("ohm", 0.0, at_least=0.0, up_to=1e6, description="of what shorts them")

    def turns(self) -> ShortedTurns:
        """Return them as the virtual motor takes them."""
        return ShortedTurns("ABC".index(self.winding), self.share, self.resistance)


class _MachineSection(InsideSection):
    """Values of `[virtual]` common to all motors, SI; for a delta the values are those of one winding."""

    phase_resistance: tuple[Resistance, Resistance, Resistance] = Field(
        description="a number above 0 and up to 10000 ohm for all three windings, or a list of three such numbers",
        json_schema_extra={"unit": "ohm"},
    )
    resistance_temperature: float = number("°C", 25.0, at_least=-40.0, up_to=300.0)
    zero_sequence_inductance: float | None = number("H", None, above=0.0, up_to=10.0)
    flux_harmonics: tuple[FluxHarmonic, ...] = ()
    pole_pairs: int = number("", at_least=1, up_to=200)
    inertia: float = number("kg·m²", at_least=1e-10, up_to=1e3)
    coulomb_friction: float = number("N·m", 0.0, at_least=0.0, up_to=1e3)
    viscous_friction: float = number("N·m·s/rad", 0.0, at_least=0.0, up_to=1e3)
    cogging_torque: float = number("N·m", 0.0, at_least=0.0, up_to=1e3, description="amplitude")
    cogging_order: int = number("", 12, at_least=1, up_to=10_000, description="periods a turn")
    cogging_phase: float = number("rad", 0.0, at_least=-2.0 * math.pi, up_to=2.0 * math.pi, description="at angle zero")
    emf_shares: tuple[Share, Share, Share] = Field(
        (1.0, 1.0, 1.0),
        description="a list of three numbers from 0 to 2: each winding's EMF as a share of flux_linkage's",
        json_schema_extra={"unit": ""},
    )
    turn_shares: tuple[TurnShare, TurnShare, TurnShare] = Field(
        (1.0, 1.0, 1.0),
        description="a list of three numbers above 0, up to 2: each winding's turns, which inductances and EMF follow",
        json_schema_extra={"unit": ""},
    )
    shorted_turns: ShortedTurnsSection | None = None
    rubbing_torque: float = number("N·m", 0.0, at_least=0.0, up_to=1e3, description="drag once a turn, at the most")
    temperature_coefficient: float = number("1/K", 0.00393, at_least=0.0, up_to=0.1, description="copper's at 20 °C")
    flux_temperature_coefficient: float = number("1/K", -0.001, at_least=-0.1, up_to=0.1)
    thermal_resistance: float = number("K/W", 0.5, at_least=0.0, up_to=1e3)
    thermal_time_constant: float = number("s", 600.0, above=0.0, up_to=1e6)

    bearing: BearingSection = BearingSection()
    iron: IronSection = IronSection()
    magnets: MagnetsSection | None = None

    @field_validator("phase_resistance", mode="before")
    @classmethod
    def _three(cls, value: object) -> object:
        if isinstance(value, int | float) and not isinstance(value, bool):
            return (value, value, value)
        if isinstance(value, list):
            if len(value) != 3:
                raise PydanticCustomError("list_length", "a motor has three windings, not {n}", {"n": len(value)})
            for item in value:
                if isinstance(item, bool) or not isinstance(item, int | float):
                    raise PydanticCustomError("float_type", "not a number")
            return tuple(value)
        raise PydanticCustomError("float_type", "not a number")

    def _machine(self, connection: WindingConnection, values: dict[str, Any]) -> VirtualMotor:
        """Return it with the values that say what its circuits are."""
        own = _MachineSection.model_fields.keys() - InsideSection.model_fields.keys()
        values = {**{name: getattr(self, name) for name in own}, **self.insides(), **values}
        values["phase_resistances"] = values.pop("phase_resistance")
        values["flux_harmonics"] = tuple((h.order, h.amplitude, h.phase) for h in self.flux_harmonics)
        values["bearing"], values["iron"] = Bearing(**self.bearing.model_dump()), self.iron.iron()
        values["magnets"] = Magnets() if self.magnets is None else Magnets(**self.magnets.model_dump())
        values["shorted_turns"] = None if self.shorted_turns is None else self.shorted_turns.turns()
        name: Literal["wye", "delta"] = "delta" if connection is WindingConnection.DELTA else "wye"
        return VirtualMotor(connection=name, **values)


class VirtualSection(_MachineSection):
    """`[virtual]` of a motor by its constants."""

    d_axis_inductance: float = number("H", at_least=1e-9, up_to=10.0)
    q_axis_inductance: float = number("H", at_least=1e-9, up_to=10.0)
    flux_linkage: float = number("V·s/rad", above=0.0, up_to=100.0, description="peak, per electrical radian")
    # As Saturation's law takes it: the q axis' differential inductance has halved there.
    d_axis_saturation_current: float | None = number(
        "A",
        None,
        at_least=1e-3,
        up_to=1e5,
        description="peak, of the Y-equivalent; without it the axis does not saturate",
    )
    q_axis_saturation_current: float | None = number(
        "A",
        None,
        at_least=1e-3,
        up_to=1e5,
        description="peak, of the Y-equivalent; without it the axis does not saturate",
    )

    def motor(self, connection: WindingConnection) -> VirtualMotor:
        """Return it as the virtual bench takes it."""
        values = {name: getattr(self, name) for name in _CONSTANTS}
        for axis in ("d_axis_saturation_current", "q_axis_saturation_current"):
            # An axis that the file says nothing of does not saturate.
            values[axis] = math.inf if values[axis] is None else values[axis]
        return self._machine(connection, values)


class MappedSection(_MachineSection):
    """`[virtual]` of a motor on a flux map, which takes the place of the constants."""

    flux_map: FluxMapSection

    @model_validator(mode="before")
    @classmethod
    def _either(cls, data: Any) -> Any:
        both = [name for name in _CONSTANTS if isinstance(data, Mapping) and name in data]
        if both:
            raise ValueError(
                text("{name} follows from the table of flux_map; leave it out, or leave flux_map out", name=both[0])
            )
        return data

    def motor(self, connection: WindingConnection, flux_map: FluxMap) -> VirtualMotor:
        """Return it as the virtual bench takes it, on the map that its file holds. Raises ValueError."""
        warmer = self.resistance_temperature - self.flux_map.magnet_temperature
        scale = math.sqrt(3.0) if connection is WindingConnection.DELTA else 1.0
        linkage = scale * flux_map.flux_linkage * (1.0 + self.flux_temperature_coefficient * warmer)
        # The motor takes its inductances from the map.
        values = {"d_axis_inductance": flux_map.d_axis_inductance, "q_axis_inductance": flux_map.q_axis_inductance}
        return self._machine(connection, {**values, "flux_linkage": linkage, "flux_map": flux_map})


_CONSTANTS = tuple(VirtualSection.model_fields.keys() - _MachineSection.model_fields.keys())
