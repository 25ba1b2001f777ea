"""The hands' side of a virtual bench in another process, through its control endpoint."""

import http.client
import json
from collections.abc import Iterable, Mapping
from typing import Any
from urllib.parse import urlsplit

from bench.i18n.errors import InputError
from bench.safety.interrupts import Interrupts
from bench.virtual.served_clock import ServedClock
from drivers.interfaces.text import text

#: A request is answered at once; who does not answer for so long (s) is gone.
_TIMEOUT = 10.0


class ServedWorld:
    """Access of virtual hands to a served world; a context manager.

    Raises InputError where nobody answers at the address, and RuntimeError, as a World does, for what cannot be done.
    """

    def __init__(self, control: str, interrupts: Interrupts | None = None) -> None:
        self._control = control
        parts = urlsplit(control)
        self._connection = http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=_TIMEOUT)
        try:
            reply = self._ask("GET", "/clock")
        except BaseException:
            self._connection.close()
            raise
        #: The bench's time.
        self.clock = ServedClock(float(reply["time"]), float(reply["speedup"]), interrupts)

    def __enter__(self) -> "ServedWorld":
        return self

    def __exit__(self, *_: object) -> None:
        self._connection.close()

    def motor_truth(self) -> dict[str, float]:
        """Return the true values of the motor on the bench, by the names of measured parameters."""
        truth: dict[str, float] = self._ask("GET", "/motor")["truth"]
        return truth

    def step_started(self, step: str, procedure: str) -> None:
        """Tell the bench that a step of a procedure begins: faults may wait for it."""
        self._ask("POST", "/steps", {"step": step, "procedure": procedure})

    def inject(self, fault: Mapping[str, Any]) -> None:
        """Inject a fault into the bench, for at once or for its time."""
        self._ask("POST", "/faults", fault)

    def unfelt_faults(self) -> list[dict[str, Any]]:
        """Return the faults, as they were given, that never began or struck no message."""
        injected = self._ask("GET", "/faults")["injected"]
        return [{k: v for k, v in one.items() if k not in ("state", "felt")} for one in injected if not one["felt"]]

    def mend(self) -> dict[str, Any]:
        """Remove all faults from the bench; return what is left."""
        return self._ask("DELETE", "/faults")

    def truth(self) -> dict[str, Any]:
        """Return the actual state."""
        return self._ask("GET", "/truth")

    def dial_angle(self) -> float:
        """Return the shaft's angle (rad)."""
        return float(self.truth()["shaft_angle"])

    def connect(self, wiring: Mapping[str, str]) -> None:
        """Wire the motor's terminals anew."""
        self._act("connect", wiring=dict(wiring))

    def take_off(self, terminals: Iterable[str]) -> None:
        """Take the wires of these terminals off."""
        self._act("take_off", terminals=list(terminals))

    def attach_voltage_probe(self, channel: int, positive: str, negative: str) -> None:
        """Put a voltage probe on two nodes."""
        self._act("attach_voltage_probe", channel=channel, positive=positive, negative=negative)

    def attach_current_probe(self, channel: int, terminal: str) -> None:
        """Clip a current probe round the wire into a terminal."""
        self._act("attach_current_probe", channel=channel, terminal=terminal)

    def detach_probe(self, channel: int) -> None:
        """Take a probe off."""
        self._act("detach_probe", channel=channel)

    def attach_voltmeter(self, positive: str, negative: str) -> None:
        """Put the voltmeter's leads on two terminals."""
        self._act("attach_voltmeter", positive=positive, negative=negative)

    def detach_voltmeter(self) -> None:
        """Take them off."""
        self._act("detach_voltmeter")

    def short_leads(self, shorted: bool) -> None:
        """Clip the bridge's leads together, or part them."""
        self._act("short_leads", shorted=shorted)

    def lock_rotor(self) -> None:
        """Lock the shaft."""
        self._act("lock_rotor")

    def release_rotor(self) -> None:
        """Open the lock."""
        self._act("release_rotor")

    def turn_shaft(self, speed: float, wobble: float = 0.0) -> None:
        """Turn the shaft by hand (rad/s)."""
        self._act("turn_shaft", speed=speed, wobble=wobble)

    def hold_shaft(self) -> None:
        """Hold the shaft still."""
        self._act("hold_shaft")

    def let_go(self) -> None:
        """Take the hand off the shaft."""
        self._act("let_go")

    def nudge_to_next_rest(self, direction: int = 1) -> float:
        """Pull the shaft over to the next rest; return how long that takes (s)."""
        return float(self._act("nudge_to_next_rest", direction=direction))

    def couple_dynamometer(self) -> None:
        """Couple the dynamometer."""
        self._act("couple_dynamometer")

    def uncouple_dynamometer(self) -> None:
        """Take the dynamometer off."""
        self._act("uncouple_dynamometer")

    def _act(self, action: str, **details: Any) -> Any:
        return self._ask("POST", "/actions", {"action": action, **details})["result"]

    def _ask(self, method: str, path: str, given: Mapping[str, Any] | None = None) -> dict[str, Any]:
        body = None if given is None else json.dumps(given, allow_nan=False)
        headers = {} if body is None else {"Content-Type": "application/json"}
        try:
            self._connection.request(method, path, body, headers)
            reply = self._connection.getresponse()
            result = json.loads(reply.read())
        except BaseException as error:
            # An interrupted request, too, leaves a connection that is good for nothing.
            self._connection.close()
            if not isinstance(error, OSError | http.client.HTTPException | ValueError):
                raise
            raise InputError(
                text(
                    "the virtual bench's control endpoint {control} does not answer ({error}); "
                    "start motorbench sim serve again and use the station file that it writes",
                    control=self._control,
                    error=error,
                )
            ) from error
        if reply.status != http.HTTPStatus.OK:
            raise RuntimeError(str(result.get("error", reply.reason)))
        return dict(result)
