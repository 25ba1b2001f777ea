"""Manual work as data: a person, a virtual operator or a fixture performs the same actions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from drivers.interfaces import ProbeKind
from drivers.interfaces.text import Text, text, word
from procedures.core.places import NODE_NAMES as NODE_NAMES
from procedures.core.places import SOCKET_NAMES as SOCKET_NAMES
from procedures.core.places import CurrentProbe as CurrentProbe
from procedures.core.places import Node as Node
from procedures.core.places import Socket as Socket
from procedures.core.places import Terminal as Terminal
from procedures.core.places import VoltageProbe as VoltageProbe
from procedures.core.setup_change import ChangeSetup as ChangeSetup
from procedures.core.short_number import short


@dataclass(frozen=True)
class Connect:
    """Connect every motor terminal as given, and nothing else; terminals not named stay open."""

    terminals: Mapping[Terminal, Socket]

    def complete(self) -> dict[Terminal, Socket]:
        """Return the socket of all three terminals."""
        return {terminal: self.terminals.get(terminal, Socket.OPEN) for terminal in Terminal}

    def lines(self, colours: Mapping[str, str]) -> list[Text]:
        """Say it, a line a terminal; `colours` names each terminal's wire where known."""
        messages = [text("Connect the motor's terminals:")]
        for terminal, socket in self.complete().items():
            colour = colours.get(terminal.value)
            if colour:
                messages.append(
                    text(
                        "{terminal} ({colour}) → {socket}",
                        terminal=terminal.value,
                        colour=word(colour),
                        socket=SOCKET_NAMES[socket],
                    )
                )
            else:
                messages.append(text("{terminal} → {socket}", terminal=terminal.value, socket=SOCKET_NAMES[socket]))
        return messages


@dataclass(frozen=True)
class ConnectProbes:
    """Fit the oscilloscope's probes as given, and no others."""

    probes: tuple[VoltageProbe | CurrentProbe, ...]

    def lines(self, colours: Mapping[str, str]) -> list[Text]:
        """Say it, a line a probe."""
        if not self.probes:
            return [text("Take the oscilloscope's probes off")]
        messages = [text("Fit the oscilloscope's probes:")]
        for probe in self.probes:
            if isinstance(probe, VoltageProbe):
                messages.append(
                    text(
                        "channel {channel}: tip on {positive}, reference on {negative}",
                        channel=probe.channel,
                        positive=NODE_NAMES[probe.positive],
                        negative=NODE_NAMES[probe.negative],
                    )
                )
            else:
                messages.append(
                    text(
                        "channel {channel}: current probe round the wire of {terminal}, arrow towards the motor",
                        channel=probe.channel,
                        terminal=probe.terminal.value,
                    )
                )
        return messages


@dataclass(frozen=True)
class ConnectVoltmeter:
    """Put the voltmeter's sense leads on two motor terminals, inside the supply's clamps."""

    positive: Terminal
    negative: Terminal

    def lines(self, colours: Mapping[str, str]) -> list[Text]:
        """Say it, in one line."""
        return [
            text(
                "Put the voltmeter's sense leads on {positive} (high) and {negative} (low), inside the supply's clamps",
                positive=self.positive.value,
                negative=self.negative.value,
            )
        ]


@dataclass(frozen=True)
class _Sentence:
    """An action that one sentence says."""

    #: Work at the shaft alone, no lead touched: the only work at a motor that is energised on purpose.
    at_shaft: ClassVar[bool] = False

    def sentence(self) -> Text:
        """Say what to do."""
        raise TypeError(f"{type(self).__name__} has no sentence")

    def lines(self, colours: Mapping[str, str]) -> list[Text]:
        """Say it, in one line."""
        return [self.sentence()]


@dataclass(frozen=True)
class ConnectVoltmeterToSupply(_Sentence):
    """Put the voltmeter's leads on the supply's own output."""

    def sentence(self) -> Text:
        """Say what to do."""
        return text("Put the voltmeter's sense leads on the supply's output: high on plus, low on minus")


@dataclass(frozen=True)
class DisconnectVoltmeter(_Sentence):
    """Take the voltmeter's sense leads off the motor."""

    def sentence(self) -> Text:
        """Say what to do."""
        return text("Take the voltmeter's leads off the motor")


@dataclass(frozen=True)
class ShortMeterLeads(_Sentence):
    """Clip the LCR meter's leads together, for its short correction."""

    def sentence(self) -> Text:
        """Say what to do."""
        return text("Take the LCR meter's leads off the motor and clip them together")


@dataclass(frozen=True)
class SeparateMeterLeads(_Sentence):
    """Take the LCR meter's leads apart again."""

    def sentence(self) -> Text:
        """Say what to do."""
        return text("Take the LCR meter's leads apart again")


@dataclass(frozen=True)
class LockRotor(_Sentence):
    """Lock the shaft where it stands."""

    def sentence(self) -> Text:
        """Say what to do."""
        return text("Lock the shaft where it stands, without turning it")


@dataclass(frozen=True)
class ReleaseRotor(_Sentence):
    """Unlock the shaft and check that it moves, because a jammed rotor would be measured in a fixed position."""

    def sentence(self) -> Text:
        """Say what to do."""
        return text("Unlock the shaft and turn it a little by hand: it moves freely")


@dataclass(frozen=True)
class TurnToRest(_Sentence):
    """Turn the energised shaft a little and let go, so that it snaps to a stable angle."""

    at_shaft = True

    def sentence(self) -> Text:
        """Say what to do."""
        return text("Turn the shaft a little by hand and let go: it snaps to a stable angle")


@dataclass(frozen=True)
class MarkRestPositions(_Sentence):
    """Turn the energised shaft through whole turns and mark each stable angle; gives the angles in rad.

    The last mark is the first position come round again, `turns` full turns beyond its first mark.
    """

    at_shaft = True

    turns: int = 1

    def sentence(self) -> Text:
        """Say what to do."""
        return text(
            "Turn the shaft slowly by hand through {turns} full turn and mark every position where it snaps in; "
            "at the end mark the first position again, {degrees}° after its first mark",
            turns=self.turns,
            degrees=360 * self.turns,
        )


@dataclass(frozen=True)
class StartTurning(_Sentence):
    """Keep turning the shaft by hand, as evenly as possible, until told to stop; `speed` in rad/s, mechanical."""

    at_shaft = True

    speed: float

    def sentence(self) -> Text:
        """Say what to do."""
        return text(
            "Turn the shaft by hand very slowly and evenly, one turn in about {seconds:.0f} s, until told to stop",
            seconds=2.0 * 3.141592653589793 / self.speed,
        )


@dataclass(frozen=True)
class StopTurning(_Sentence):
    """Stop turning the shaft and let it rest."""

    at_shaft = True

    def sentence(self) -> Text:
        """Say what to do."""
        return text("Stop turning the shaft")


@dataclass(frozen=True)
class CoupleDynamometer(_Sentence):
    """Couple the motor to the dynamometer."""

    def sentence(self) -> Text:
        """Say what to do."""
        return text("Couple the motor's shaft to the dynamometer")


@dataclass(frozen=True)
class UncoupleDynamometer(_Sentence):
    """Uncouple the motor from the dynamometer."""

    def sentence(self) -> Text:
        """Say what to do."""
        return text("Take the motor's shaft off the dynamometer")


@dataclass(frozen=True)
class EnterReading(_Sentence):
    """Type in a number that only a person can read; refused outside `minimum` … `maximum` (in `unit`).

    A value outside `usual`, if given, is asked for again; an operator that cannot be asked again refuses it. `key` names the quantity for
    a performer that is no person: `winding_temperature`, `maximum_current`, `rated_speed_rpm`.
    """

    key: str
    quantity: Text
    unit: str
    minimum: float
    maximum: float
    usual: tuple[float, float] | None = field(default=None, metadata={"optional": True})

    def sentence(self) -> Text:
        """Say what to do."""
        return text(
            "Enter {quantity} in {unit} ({minimum} … {maximum})",
            quantity=self.quantity,
            unit=self.unit,
            minimum=short(self.minimum),
            maximum=short(self.maximum),
        )


@dataclass(frozen=True)
class DoByHand(_Sentence):
    """Other manual work while everything is off, in the procedure's own words: close a hatch, plug in a sensor.

    Nothing in a setup follows from it; a fixture cannot do it, and the virtual operator does it without effect.
    """

    said: Text

    def sentence(self) -> Text:
        """Say what to do."""
        return self.said


@dataclass(frozen=True)
class Mend:
    """Correct what a measurement found wrong; the result tells whether that was done, and it is then measured again.

    `finding` says what was found, `wanted` the connection as it should be, a line each. An operator that cannot correct it gives up.
    """

    finding: Text
    wanted: tuple[Text, ...]

    def lines(self, colours: Mapping[str, str]) -> list[Text]:
        """Say it, the finding first."""
        return [text("Correct the wiring: {finding}", finding=self.finding), *self.wanted]


@dataclass(frozen=True)
class DoubtReading:
    """A reading contradicts the others of its series; the result tells whether to take it again. Otherwise it is confirmed and kept."""

    finding: Text

    def lines(self, colours: Mapping[str, str]) -> list[Text]:
        """Say what was found."""
        return [self.finding]


#: The command that ends a run by hand.
FINISH = "finish"
#: And the one that carries out what is to be confirmed.
YES = "yes"


@dataclass(frozen=True)
class FittedProbe:
    """A probe that the station assigns to a channel: what it senses (V or A) per volt at the input, None if it is not stated."""

    channel: int
    kind: ProbeKind
    attenuation: float | None


@dataclass(frozen=True)
class EnterCommand(_Sentence):
    """Ask for the next command to an instrument; gives the words typed, None if none were typed for `idle` (s), where that is a limit.

    `said` is what came of the command before, `refused` whether it was refused, `on` what is energised. `roles` can be commanded;
    `ranges` has the largest value of their arguments where it is known, by role.method.argument, in the argument's own unit.
    `probes` are the oscilloscope's. `confirms` is the command that the word YES carries out; empty where nothing is to be confirmed.
    """

    said: Text
    refused: bool
    on: tuple[str, ...]
    idle: float | None
    roles: tuple[str, ...]
    ranges: Mapping[str, float]
    probes: tuple[FittedProbe, ...] = field(default=(), metadata={"optional": True})
    confirms: str = field(default="", metadata={"optional": True})

    def sentence(self) -> Text:
        """Say what to do."""
        return text("Enter a command, or finish")


#: What a procedure wants of the setup; the order in which hands bring it about follows from what is there.
Wanted = (
    Connect
    | ConnectProbes
    | ConnectVoltmeter
    | ConnectVoltmeterToSupply
    | DisconnectVoltmeter
    | ShortMeterLeads
    | SeparateMeterLeads
    | LockRotor
    | ReleaseRotor
    | CoupleDynamometer
    | UncoupleDynamometer
)
#: What hands and eyes are asked for.
HandWork = (
    ChangeSetup
    | TurnToRest
    | MarkRestPositions
    | StartTurning
    | StopTurning
    | EnterReading
    | EnterCommand
    | DoByHand
    | Mend
    | DoubtReading
)
Action = Wanted | HandWork

#: Two terminals that a line quantity is read between, the first being high or plus.
LinePair = tuple[Terminal, Terminal]
LINE_PAIRS: tuple[LinePair, ...] = (
    (Terminal.A, Terminal.B),
    (Terminal.B, Terminal.C),
    (Terminal.C, Terminal.A),
)


def meter_across(high: Terminal, low: Terminal) -> Connect:
    """Connect the LCR meter between two terminals, the third open."""
    return Connect({high: Socket.METER_HIGH, low: Socket.METER_LOW})


def supply_across(plus: Terminal, minus: Terminal) -> Connect:
    """Connect the supply between two terminals, the third open."""
    return Connect({plus: Socket.SUPPLY_POSITIVE, minus: Socket.SUPPLY_NEGATIVE})


def label_of(pair: LinePair) -> str:
    """Return the letters of a pair of terminals, as in R_AB."""
    return pair[0].value + pair[1].value


def meter_series_parallel() -> Connect:
    """Connect the LCR meter from A to B and C joined."""
    return Connect({Terminal.A: Socket.METER_HIGH, Terminal.B: Socket.METER_LOW, Terminal.C: Socket.METER_LOW})


def phases_on(
    channels: Sequence[int], first: int = 0, reference: Node = Node.ARTIFICIAL_STAR
) -> tuple[VoltageProbe, ...]:
    """Return the probes of three channels on the phases against a star point, beginning with phase `first` (0 is A)."""
    nodes = (Node.A, Node.B, Node.C)
    return tuple(VoltageProbe(channel, nodes[(k + first) % 3], reference) for k, channel in enumerate(channels))


#: Rotor to the d axis: the current's space vector lies on phase A's axis.
ALIGN_D = Connect(
    {Terminal.A: Socket.SUPPLY_POSITIVE, Terminal.B: Socket.SUPPLY_NEGATIVE, Terminal.C: Socket.SUPPLY_NEGATIVE}
)
#: Rotor to where phase A sees its q axis.
ALIGN_Q = Connect({Terminal.B: Socket.SUPPLY_POSITIVE, Terminal.C: Socket.SUPPLY_NEGATIVE})
#: The note's d-axis step: against the aligning current.
STEP_NEGATIVE = Connect(
    {Terminal.A: Socket.SUPPLY_NEGATIVE, Terminal.B: Socket.SUPPLY_POSITIVE, Terminal.C: Socket.SUPPLY_POSITIVE}
)
STEP_POSITIVE = ALIGN_D
ALL_OPEN = Connect({})
#: All three terminals joined with each other.
ALL_SHORTED = Connect(dict.fromkeys(Terminal, Socket.LINK))
INVERTER = Connect({Terminal.A: Socket.INVERTER_U, Terminal.B: Socket.INVERTER_V, Terminal.C: Socket.INVERTER_W})
#: The six-step drive's legs, in the order of the phases.
DRIVE = Connect({Terminal.A: Socket.DRIVE_1, Terminal.B: Socket.DRIVE_2, Terminal.C: Socket.DRIVE_3})
