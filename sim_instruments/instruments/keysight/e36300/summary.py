"""The status registers that an E36313A has for each output (STATus:QUEStionable:INSTrument:ISUMmary)."""

from collections.abc import Callable, Mapping

from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.parameters import exactly, number
from sim_instruments.scpi.status import StatusRegister
from sim_instruments.scpi.tree import Call, CommandTree


class OutputSummaries:
    """A register for each output, whose condition is asked for."""

    def __init__(self, tree: CommandTree, conditions: Mapping[int, Callable[[], int]]) -> None:
        self._registers = {channel: StatusRegister(condition) for channel, condition in conditions.items()}
        header = "STATus:QUEStionable:INSTrument:ISUMmary<n>"
        tree.add(f"{header}[:EVENt]", query=self._query(StatusRegister.read_event))
        tree.add(f"{header}:CONDition", query=self._query(StatusRegister.condition))
        tree.add(f"{header}:ENABle", command=self._enable, query=self._query(lambda register: register.enable))

    def condition(self) -> int:
        """Return a bit for each output whose register has something to say."""
        return sum(1 << channel for channel, register in self._registers.items() if register.summary())

    def _register(self, call: Call) -> StatusRegister:
        try:
            return self._registers[call.channel]
        except KeyError:
            raise ScpiError(-114) from None

    def _query(self, value: Callable[[StatusRegister], int]) -> Callable[[Call], str]:
        def get(call: Call) -> str:
            exactly(call.arguments, 0)
            return f"{value(self._register(call)):+d}"

        return get

    def _enable(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._register(call).enable = round(number(call.arguments[0], 0, 65535))
