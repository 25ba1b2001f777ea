"""Manual actions on the bench, as requests: the world's methods by their names."""

from typing import Annotated, Any, Literal, cast

from pydantic import Field, TypeAdapter

from sim_instruments.server.control.request import Request
from sim_instruments.world.probes import Node
from sim_instruments.world.settings import Socket, Terminal
from sim_instruments.world.world import World

Channel = Annotated[int, Field(ge=1, le=8)]
_FASTEST_HAND = 200.0


class ConnectTerminals(Request):
    """Wire the motor's terminals anew; those left out stay open."""

    action: Literal["connect"]
    wiring: dict[Terminal, Socket]

    def perform(self, world: World) -> None:
        """Do it."""
        world.connect(cast("dict[str, str]", self.wiring))


class TakeOffWires(Request):
    """Take the wires of these terminals off; the others stay."""

    action: Literal["take_off"]
    terminals: list[Terminal]

    def perform(self, world: World) -> None:
        """Do it."""
        world.take_off(self.terminals)


class AttachVoltageProbe(Request):
    """Put a channel's voltage probe between two nodes."""

    action: Literal["attach_voltage_probe"]
    channel: Channel
    positive: Node
    negative: Node

    def perform(self, world: World) -> None:
        """Do it."""
        world.attach_voltage_probe(self.channel, self.positive, self.negative)


class AttachCurrentProbe(Request):
    """Clip a channel's current probe round the wire into a terminal."""

    action: Literal["attach_current_probe"]
    channel: Channel
    terminal: Terminal

    def perform(self, world: World) -> None:
        """Do it."""
        world.attach_current_probe(self.channel, self.terminal)


class DetachProbe(Request):
    """Take a channel's probe off."""

    action: Literal["detach_probe"]
    channel: Channel

    def perform(self, world: World) -> None:
        """Do it."""
        world.detach_probe(self.channel)


class AttachVoltmeter(Request):
    """Put the voltmeter's leads on two terminals, or on the supply's output."""

    action: Literal["attach_voltmeter"]
    positive: Terminal | Literal["S+", "S-"]
    negative: Terminal | Literal["S+", "S-"]

    def perform(self, world: World) -> None:
        """Do it."""
        world.attach_voltmeter(self.positive, self.negative)


class TurnShaft(Request):
    """Turn the shaft by hand (rad/s) until it is held or let go."""

    action: Literal["turn_shaft"]
    speed: Annotated[float, Field(ge=-_FASTEST_HAND, le=_FASTEST_HAND)]
    wobble: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0

    def perform(self, world: World) -> None:
        """Do it."""
        world.turn_shaft(self.speed, self.wobble)


class NudgeToNextRest(Request):
    """Pull the shaft over to the next stable position; the result is how long that takes (s of bench time)."""

    action: Literal["nudge_to_next_rest"]
    direction: Literal[1, -1] = 1

    def perform(self, world: World) -> float:
        """Do it."""
        return world.nudge_to_next_rest(self.direction)


class ShortLeads(Request):
    """Clip the bridge's leads together, or take them apart again."""

    action: Literal["short_leads"]
    shorted: bool

    def perform(self, world: World) -> None:
        """Do it."""
        world.short_leads(self.shorted)


class SetTemperature(Request):
    """Set the temperature (°C) of the surroundings or, at once, of the winding."""

    action: Literal["set_ambient_temperature", "set_winding_temperature"]
    temperature: Annotated[float, Field(ge=-60.0, le=300.0)]

    def perform(self, world: World) -> None:
        """Do it."""
        getattr(world, self.action)(self.temperature)


class Simple(Request):
    """A request without arguments."""

    action: Literal[
        "detach_voltmeter",
        "lock_rotor",
        "release_rotor",
        "hold_shaft",
        "let_go",
        "couple_dynamometer",
        "uncouple_dynamometer",
    ]

    def perform(self, world: World) -> None:
        """Do it."""
        getattr(world, self.action)()


Action = Annotated[
    ConnectTerminals
    | AttachVoltageProbe
    | AttachCurrentProbe
    | DetachProbe
    | AttachVoltmeter
    | TurnShaft
    | NudgeToNextRest
    | ShortLeads
    | TakeOffWires
    | SetTemperature
    | Simple,
    Field(discriminator="action"),
]
ACTION: TypeAdapter[Any] = TypeAdapter(Action)
