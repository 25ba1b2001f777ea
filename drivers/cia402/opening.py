"""A CiA 402 node opened by its address."""

from collections.abc import Callable
from typing import Any, Protocol, TypeVar

from drivers.cia402.node import Cia402Node
from drivers.interfaces import UNWATCHED, Calls, Clock, Traffic
from drivers.transport.can.buses import CanBuses

OptionsT_contra = TypeVar("OptionsT_contra", contravariant=True)
DriverT_co = TypeVar("DriverT_co", covariant=True)
DriverT = TypeVar("DriverT")


class Opener(Protocol[OptionsT_contra, DriverT_co]):
    """Opens a node at `can://interface/channel?node=N&bitrate=500000`, the interface as python-can names it.

    Nodes opened with the same `buses` share the connection to their bus. Raises CommunicationError where the bus cannot
    be opened or the node does not answer, IdentityError where it is another one.
    """

    def __call__(
        self,
        address: str,
        clock: Clock,
        options: OptionsT_contra,
        *,
        name: str = ...,
        traffic: Traffic | None = None,
        calls: Calls = UNWATCHED,
        buses: CanBuses | None = None,
        guarding: bool = False,
    ) -> DriverT_co:
        """Open it; `name` stands for it in messages, its role where it is not given."""


def opener(make: Callable[..., DriverT], role: str) -> Opener[Any, DriverT]:
    """Return what opens nodes for a driver in its usual role."""

    def opened(
        address: str,
        clock: Clock,
        options: Any,
        *,
        name: str = role,
        traffic: Traffic | None = None,
        calls: Calls = UNWATCHED,
        buses: CanBuses | None = None,
        guarding: bool = False,
    ) -> DriverT:
        place = (buses or CanBuses()).node(address, name)
        try:
            node = Cia402Node(
                place.client,
                clock,
                options,
                name=name,
                traffic=traffic,
                calls=calls,
                connection=place,
                guarding=guarding,
            )
            return make(node, clock, options, name=name)
        except BaseException:
            place.disconnect()
            raise

    return opened
