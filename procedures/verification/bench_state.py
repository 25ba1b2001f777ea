"""What the actions done so far leave: the terminals' connection, and whether the shaft is locked."""

from procedures.core.actions import Action, Connect, LockRotor, ReleaseRotor, SeparateMeterLeads, ShortMeterLeads
from procedures.verification.lines import Lines
from procedures.verification.stated_probes import StatedProbes
from procedures.verification.verified_channels import VerifiedChannels


class BenchState:
    """The state of the bench, by the actions done so far and the measurements that verified them."""

    def __init__(self) -> None:
        #: The terminals' connection; None where it is not known.
        self.connection: Connect | None = None
        #: Whether that connection has been verified, and nothing was touched since.
        self.verified = False
        #: Whether the shaft was locked by this run, and not released since.
        self.rotor_locked = False
        #: The motor's line resistances, as far as this run has read them.
        self.lines = Lines()
        #: Gains of the oscilloscope's channels that a verification found.
        self.verified_channels = VerifiedChannels()
        #: Limits of its probes that the station file leaves open.
        self.stated_probes = StatedProbes()

    def after(self, action: Action) -> None:
        """Take an action into account that has been done."""
        match action:
            case Connect():
                self.connection, self.verified = action, False
            case ShortMeterLeads() | SeparateMeterLeads():
                self.connection, self.verified = None, False
            case LockRotor():
                self.rotor_locked = True
            case ReleaseRotor():
                self.rotor_locked = False
