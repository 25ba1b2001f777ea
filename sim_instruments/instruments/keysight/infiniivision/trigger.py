"""The :TRIGger subsystem of the InfiniiVision: rejections besides what every oscilloscope's has."""

from sim_instruments.instruments.oscilloscope.trigger import TriggerSubsystem, TriggerWords
from sim_instruments.scpi.parameters import choice, choices, exactly
from sim_instruments.scpi.tree import Call, CommandTree, bare

_REJECTED = choices(("OFF", "LFReject", "HFReject"))
WORDS = TriggerWords(
    {"POSitive": "POS", "NEGative": "NEG", "EITHer": "EITH", "ALTernate": "EITH"},
    node="TRIGger[:EDGE]",
    coupling="TRIGger[:EDGE]:COUPling",
)


class InfiniiVisionTrigger(TriggerSubsystem):
    """State of the edge trigger of an InfiniiVision."""

    @property
    def _rejects_high(self) -> bool:
        return self._settings.flag("hf_reject")

    def _add_commands(self, tree: CommandTree) -> None:
        super()._add_commands(tree)
        self._settings.add_flag("hf_reject", "TRIGger:HFReject", False, changed=lambda _: self._changed())
        tree.add(f"{self._words.node}:REJect", command=self._set_reject, query=bare(self._reject))

    def _set_reject(self, call: Call) -> None:
        """Set one rejection: that of low frequencies is the coupling's, too."""
        exactly(call.arguments, 1)
        rejected = choice(call.arguments[0], _REJECTED)
        if rejected == "LFR" or self._settings.word("trigger_coupling") == "LFR":
            self._settings.put("trigger_coupling", "LFR" if rejected == "LFR" else "DC")
        self._settings.put("hf_reject", rejected == "HFR")
        self._changed()

    def _reject(self) -> str:
        if self._settings.word("trigger_coupling") == "LFR":
            return "LFR"
        return "HFR" if self._settings.flag("hf_reject") else "OFF"
