"""Manual work on a virtual bench, in this process or in another."""

from collections.abc import Mapping
from typing import Any, Protocol

from drivers.interfaces import Clock


class HandsOn(Protocol):
    """The actions and readings of virtual hands on a virtual bench: a World, in this process or in another."""

    @property
    def clock(self) -> Clock:
        """Return the bench's time."""

    def connect(self, wiring: Mapping[str, str]) -> None:
        """Wire the motor's terminals anew."""

    def take_off(self, terminals: Any) -> None:
        """Take the wires of these terminals off."""

    def attach_voltage_probe(self, channel: int, positive: Any, negative: Any) -> None:
        """Put a voltage probe on two nodes."""

    def attach_current_probe(self, channel: int, terminal: Any) -> None:
        """Clip a current probe round a wire."""

    def detach_probe(self, channel: int) -> None:
        """Take a probe off."""

    def attach_voltmeter(self, positive: Any, negative: Any) -> None:
        """Put the voltmeter's leads on two terminals."""

    def detach_voltmeter(self) -> None:
        """Take them off."""

    def short_leads(self, shorted: bool) -> None:
        """Clip the bridge's leads together, or part them."""

    def lock_rotor(self) -> None:
        """Lock the shaft."""

    def release_rotor(self) -> None:
        """Open the lock."""

    def turn_shaft(self, speed: float, wobble: float = 0.0) -> None:
        """Turn the shaft by hand."""

    def hold_shaft(self) -> None:
        """Hold the shaft still."""

    def let_go(self) -> None:
        """Take the hand off the shaft."""

    def nudge_to_next_rest(self, direction: int = 1) -> float:
        """Pull the shaft over to the next rest; return how long that takes (s)."""

    def couple_dynamometer(self) -> None:
        """Couple the dynamometer."""

    def uncouple_dynamometer(self) -> None:
        """Take the dynamometer off."""

    def dial_angle(self) -> float:
        """Return the shaft's angle (rad)."""

    def truth(self) -> dict[str, Any]:
        """Return the actual state."""
