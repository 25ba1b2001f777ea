"""The InfiniiVision's settings all at once: subsystem queries, set-up blocks, *SAV, *RCL and *LRN? (programmer's guide, :SYSTem:SETup)."""

from collections.abc import Callable

from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.lexer import split_units
from sim_instruments.scpi.parameters import exactly
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.states import State, StateMemory, answered, queries_of, restore
from sim_instruments.scpi.tree import Call, CommandTree, Handling, bare

_CHANNELS = range(1, 5)
_PLACES = range(10)
#: What a subsystem's query replies with, in its order: after pymeasure's KeysightDSOX1102G, which takes the replies apart.
_CHANNEL = ("RANG", "OFFS", "COUP", "IMP", "DISP", "BWL", "INV", "LAB", "UNIT", "PROB", "PROB:SKEW", "PROB:STYP")
_TIME_BASE = (("MODE", "MODE"), ("REF", "REF"), ("MAIN:RANG", "RANG"), ("POS", "POS"))
_TRIGGER = ("MODE", "SWE", "NREJ", "HFR", "HOLD")
_EDGE = ("SOUR", "LEV", "SLOP", "REJ", "COUP")
_ACQUIRE = ("MODE", "TYPE", "COMP", "COUN")
_NO_STATE = ScpiError(-256, "File name not found")


class SetupSubsystem:
    """Adds its headers to a tree, whose other handlers say what is set."""

    def __init__(self, tree: CommandTree, settings: ScpiSettings, reset: Callable[[], None]) -> None:
        self._tree = tree
        self._settings = settings
        self._reset = reset
        self._restoring = False
        tree.add("TIMebase", query=bare(self._time_base))
        tree.add("CHANnel<n>", query=self._channel)
        tree.add("TRIGger", query=bare(self._trigger))
        tree.add("ACQuire", query=bare(lambda: f":ACQ:{self._told(':ACQ', [(name, name) for name in _ACQUIRE])}"))
        tree.add("SYSTem:SETup", command=self._restore, query=bare(lambda: _block(self._state())))
        memory = StateMemory(tree, self._state, reset, _PLACES, _NO_STATE)
        memory.add("*SAV", "*RCL")
        memory.add_learn(lambda state: b":SYST:SET " + _block(state))

    def _told(self, header: str, names: list[tuple[str, str]]) -> str:
        """Return the settings below a header, each told under the first of its two names."""
        result = []
        for told, asked in names:
            command = answered(self._tree, [f"{header}:{asked}?"])[0]
            result.append(f"{told} {command.partition(' ')[2]}")
        return ";".join(result)

    def _channel(self, call: Call) -> str:
        exactly(call.arguments, 0)
        if call.channel not in _CHANNELS:
            raise ScpiError(-114)
        header = f":CHAN{call.channel}"
        names = [(name.removeprefix("PROB:") if name == "PROB:STYP" else name, name) for name in _CHANNEL]
        return f"{header}:{self._told(header, names)}"

    def _time_base(self) -> str:
        return f":TIM:{self._told(':TIM', list(_TIME_BASE))}"

    def _trigger(self) -> str:
        edge = [(name, name) for name in _EDGE if name != "LEV" or self._has_level]
        return (
            f":TRIG:{self._told(':TRIG', [(name, name) for name in _TRIGGER])}"
            f";:TRIG:EDGE:{self._told(':TRIG:EDGE', edge)}"
        )

    @property
    def _has_level(self) -> bool:
        """Return whether the trigger's source has a level that can be set: the line has not."""
        return bool(answered(self._tree, [":TRIG:LEV?"]))

    def _state(self) -> State:
        # A probe's ratio moves what is set at its tip, and a scale how far levels and offsets go.
        channels = [f":CHAN{n}:{name}?" for name in ("UNIT", "PROB", "SCAL", "OFFS") for n in _CHANNELS]
        levels = [f":TRIG:LEV? CHAN{n}" for n in _CHANNELS]
        others = [":TRIG:SOUR?", ":WAV:SOUR?", ":MEAS:SOUR?"]
        return tuple(answered(self._tree, [*channels, *queries_of(self._settings), *levels, *others]))

    def _restore(self, call: Call) -> Handling:
        exactly(call.arguments, 1)
        argument = call.arguments[0]
        if argument.kind != "block":
            raise ScpiError(-104)
        if self._restoring:
            # A set-up within a set-up is none of this instrument's.
            raise ScpiError(-161)
        state = split_units(argument.text)
        if not state or not all(message.startswith(":") for message in state):
            raise ScpiError(-161)
        return self._restored(state)

    def _restored(self, state: list[str]) -> Handling:
        self._restoring = True
        try:
            self._reset()
            yield from restore(self._tree, state)
        finally:
            self._restoring = False
        return None


def _block(state: State) -> bytes:
    content = ";".join(state).encode("latin-1")
    return b"#8%08d" % len(content) + content
