"""What the actions done so far leave: the terminals' connection, and whether the shaft is locked."""

from procedures.core.actions import Action, Connect, LockRotor, ReleaseRotor, SeparateMeterLeads, ShortMeterLeads
from procedures.verification.lines import Lines


class Standing:
    """The bench as it stands, by what hands were told and what measurements proved of it."""

    def __init__(self) -> None:
        #: The terminals' connection; None where it is not known.
        self.connection: Connect | None = None
        #: Whether that connection has been proved, and nothing was touched since.
        self.proved = False
        #: Whether the shaft was locked by this run, and not released since.
        self.rotor_locked = False
        #: The motor's line resistances, as far as this run has read them.
        self.lines = Lines()

    def after(self, action: Action) -> None:
        """Take an action into account that has been done."""
        match action:
            case Connect():
                self.connection, self.proved = action, False
            case ShortMeterLeads() | SeparateMeterLeads():
                self.connection, self.proved = None, False
            case LockRotor():
                self.rotor_locked = True
            case ReleaseRotor():
                self.rotor_locked = False
