"""Our driver of relays with a watchdog; importing this imports no transport library."""

from drivers.delta.options import BeckhoffRelayOptions
from drivers.safety_devices import RelayDriver

BK9000 = RelayDriver(
    "beckhoff-bk9000",
    BeckhoffRelayOptions,
    "drivers.beckhoff.bk9000:open_beckhoff_relay",
    sources=(
        "Beckhoff's Information System, Modbus TCP interface",
        "slacAWallace/epics-bk9000, an EPICS driver in use (registers, reset words, status bit 15, reset before the time is set)",
    ),
    commands_in="drivers.beckhoff",
)
