"""The bench's setup as it was last left, and the knowledge of it by measurement."""

from collections.abc import Collection

from drivers.interfaces import Role
from procedures.core.actions import Connect, Socket
from procedures.core.setup import BenchSetup
from procedures.verification.lines import Lines
from procedures.verification.stated_probes import StatedProbes
from procedures.verification.verified_channels import VerifiedChannels


class BenchState:
    """The state of the bench, by the work done so far and the measurements that verified it."""

    def __init__(self) -> None:
        #: What is connected, and what holds the shaft; nothing is known before anything was done.
        self.setup = BenchSetup()
        #: Whether the terminals' connection has been verified, and was not touched since.
        self.verified = False
        #: The roles that the running procedure works with; None where every instrument may be left on.
        self.in_use: Collection[Role] | None = None
        #: The largest voltage (V, peak) that the motor gives or takes between two terminals, None where nobody knows.
        self.motor_voltage: float | None = None
        #: The motor's line resistances, as far as this run has read them.
        self.lines = Lines()
        #: Gains of the oscilloscope's channels that a verification found.
        self.verified_channels = VerifiedChannels()
        #: Limits of its probes that the station file leaves open.
        self.stated_probes = StatedProbes()

    @property
    def connection(self) -> Connect | None:
        """The terminals' connection; None where it is not known."""
        if not self.setup.known:
            return None
        return Connect({t: socket for t, socket in self.setup.terminals.items() if socket is not Socket.OPEN})

    @property
    def rotor_locked(self) -> bool:
        """True if this run locked the shaft and has not released it since."""
        return self.setup.rotor_locked is True

    def begin(self, in_use: Collection[Role], motor_voltage: float | None) -> None:
        """Begin a procedure that works with these roles, on a motor of a largest voltage (V)."""
        self.in_use, self.motor_voltage = in_use, motor_voltage
        self.verified_channels.begin()

    def changed(self, setup: BenchSetup) -> None:
        """Take over what hands have made of the setup."""
        if setup.terminals != self.setup.terminals or setup.leads_shorted != self.setup.leads_shorted:
            self.verified = False
        self.setup = setup

    def forget(self) -> None:
        """Count nothing as connected, off, locked or free any more: somebody else may have been there."""
        self.setup, self.verified = BenchSetup(), False
