"""The :CHANnel subsystem of the InfiniiVision: impedance, skew and labels besides what every oscilloscope's has."""

from sim_instruments.instruments.oscilloscope.channels import CHANNEL, CHANNELS, ChannelSubsystem
from sim_instruments.scpi.parameters import choice, choices, exactly
from sim_instruments.scpi.tree import Call, CommandTree, bare

_CLEAR = choices(("CLEar",))
#: What 50 Ω leave behind the 9 MΩ of a passive probe, times its ratio; probes of a lower ratio are taken to feed them.
_PASSIVE_PROBE, _LOADED = 5.0, 10.0 * 50.0 / (9.0e6 + 50.0)


class InfiniiVisionChannels(ChannelSubsystem):
    """State of the channels of an InfiniiVision."""

    def let_through(self, channel: int) -> float:
        """Return the share of what its probe gives that comes through: 50 Ω load a passive one."""
        settings = self._settings
        passive = settings.word("unit", channel) == "VOLT" and self._probes[channel - 1] > _PASSIVE_PROBE
        return _LOADED if passive and settings.word("impedance", channel) == "FIFT" else 1.0

    def skew(self, channel: int) -> float:
        """Return the time (s) by which a channel's trace is shown late."""
        return self._settings.number("skew", channel)

    def _add_commands(self, tree: CommandTree) -> None:
        super()._add_commands(tree)
        put, changed = self._settings, lambda _: self._changed()
        put.add_choice(
            "impedance", f"{CHANNEL}:IMPedance", ("ONEMeg", "FIFTy"), "ONEM", count=CHANNELS, changed=changed
        )
        put.add_string("label", f"{CHANNEL}:LABel", count=CHANNELS)
        put.add_choice("signal type", f"{CHANNEL}:PROBe:STYPe", ("DIFFerential", "SINGle"), "SING", count=CHANNELS)
        put.add_flag("vernier", f"{CHANNEL}:VERNier", False, count=CHANNELS)
        put.add_number("skew", f"{CHANNEL}:PROBe:SKEW", -1.0e-7, 1.0e-7, 0.0, unit="S", count=CHANNELS, changed=changed)
        tree.add(f"{CHANNEL}:PROTection", command=self._clear_protection, query=bare(lambda: "NORM"))

    def _clear_protection(self, call: Call) -> None:
        self._index(call)
        exactly(call.arguments, 0, 1)
        for argument in call.arguments:
            choice(argument, _CLEAR)
