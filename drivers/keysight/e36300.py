"""Keysight E36300 series DC supplies (Programming Guide E36311-90008), one output."""

from drivers.bases.scpi_supply import ScpiOutput, ScpiSupply, SupplyCommands
from drivers.interfaces import Clock, IdentityError, OutputMode
from drivers.interfaces.text import text
from drivers.keysight.e36300_data import OUTPUTS
from drivers.keysight.e36300_protection import Protection
from drivers.keysight.e36300_settings import found_settings
from drivers.keysight.options import E36300_IDENTITY, E36300Options
from drivers.transport.visa.opening import identify
from drivers.transport.visa.session import ScpiSession

#: Condition register of an output (ISUMmary): two low bits say what regulates; higher ones concern lists and logs.
REGULATION_MASK = 0b11
REGULATION = {0: None, 1: OutputMode.CONSTANT_CURRENT, 2: OutputMode.CONSTANT_VOLTAGE, 3: OutputMode.UNREGULATED}


def decode_regulation(condition: int) -> OutputMode | None:
    """Return what the ISUMmary condition register says of the regulation, `None` where the output is off or lost.

    Sources: libsigrok's scpi-pps, tried on an E36312A; the same query in the E364xA User's and Service Guide (1 CC, 2 CV, 0 off or
    unregulated, 3 failure), whose status system the series continues.
    """
    return REGULATION[condition & REGULATION_MASK]


class KeysightE36300(ScpiSupply):
    """One output of a Keysight E36311A, E36312A or E36313A; the instrument is identified when this is made.

    Raises IdentityError where another instrument, or one without this output, answers, ReportedError where it was left in a
    state that may not be changed from here.
    """

    _local = "SYST:LOC"

    def __init__(
        self,
        session: ScpiSession,
        clock: Clock,
        options: E36300Options,
        *,
        name: str = "supply",
        guarding: bool = False,
    ) -> None:
        identity = identify(session, E36300_IDENTITY, options.serial_number)
        outputs = next(outputs for model, outputs in OUTPUTS.items() if identity.model.startswith(model))
        if options.channel not in outputs:
            raise IdentityError(
                name,
                text(
                    "{model} has outputs {outputs}, not {channel}",
                    model=identity.model,
                    outputs=list(outputs),
                    channel=options.channel,
                ),
                remedy=text("Correct the channel in the station file"),
            )
        self._number = options.channel
        commands = SupplyCommands(channel=f"(@{options.channel})")
        protection = Protection(ScpiOutput(session, commands.channel, name), commands, options.over_current_delay, name)
        super().__init__(
            session,
            clock,
            options,
            identity=identity,
            data=outputs[options.channel],
            commands=commands,
            protection=protection,
            name=name,
            guarding=guarding,
        )
        if not guarding:
            self._take_over(found_settings(commands.channel))

    def output_mode(self) -> OutputMode:
        """Say what regulates the output now; raises CommunicationError on an unusable reply."""
        condition = int(self._session.query_number(f"STAT:QUES:INST:ISUM{self._number}:COND?"))
        regulation = decode_regulation(condition)
        if regulation in (OutputMode.CONSTANT_VOLTAGE, OutputMode.CONSTANT_CURRENT):
            return regulation
        if self._protection.tripped():
            return OutputMode.TRIPPED
        return OutputMode.UNREGULATED if self._channel.flag(self._commands.output) else OutputMode.OFF
