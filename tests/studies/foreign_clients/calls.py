"""What every client's script shares: one call, what it gave, which error it left in the instrument's queue."""

import json
import math
import sys
import urllib.request
import warnings
from collections.abc import Callable
from typing import Any

warnings.simplefilter("ignore")

TASK: dict[str, Any] = json.loads(sys.argv[1])
TRUTH: dict[str, float] = TASK["truth"]


def address(role: str, way: str = "hislip") -> str:
    """Return where an instrument is reached."""
    return str(TASK["addresses"][role][way])


def hands(action: str, **words: Any) -> None:
    """Have hands do something on the bench."""
    body, kind = json.dumps({"action": action, **words}).encode(), {"Content-Type": "application/json"}
    request = urllib.request.Request(f"{TASK['control']}/actions", body, kind, method="POST")  # noqa: S310
    with urllib.request.urlopen(request, timeout=5.0):  # noqa: S310
        pass


class Calls:
    """Makes calls of one client and prints what came of each: works, refused, wrong, or raised without an error queued.

    What raises `refusal` was refused by the instrument, too: its client has taken the error.
    """

    def __init__(
        self, client: str, error: Callable[[], str] = lambda: "0", *, refusal: type[Exception] | tuple[()] = ()
    ) -> None:
        self._client = client
        self._error = error
        self._refusal = refusal

    def make(
        self,
        name: str,
        call: Callable[[], Any],
        right: Callable[[Any], bool] | float | None = None,
        *,
        quiet: type[Exception] | tuple[()] = (),
    ) -> Any:
        """Make a call; `right` is the figure that it should give, or says whether what it gave is right.

        Nothing is said of one that the client itself refuses by raising `quiet`.
        """
        value, raised, refused = None, "", False
        try:
            value = call()
        except quiet:
            return None
        except Exception as error:  # noqa: BLE001  a client may stumble over anything
            raised = f"{type(error).__name__}: {error}".splitlines()[0][:100]
            refused = isinstance(error, self._refusal)
        errors = self._errors()
        if errors or refused:
            # Nobody takes a figure along that came with an error.
            outcome = "refused"
        elif raised:
            outcome = "raised"
        else:
            outcome = "works" if _is_right(value, right) else "wrong"
        told = "; ".join([*errors, raised]) if errors or raised else repr(value)[:80]
        print(json.dumps({"client": self._client, "call": name, "outcome": outcome, "told": told}), flush=True)
        return value

    def _errors(self) -> list[str]:
        found: list[str] = []
        while len(found) < 30:
            error = self._error().strip()
            if error.lstrip("+").startswith("0"):
                return found
            found.append(error)
        return found


def _is_right(value: Any, right: Callable[[Any], bool] | float | None) -> bool:
    if right is None:
        return True
    if callable(right):
        return bool(right(value))
    return math.isclose(float(value), right, rel_tol=0.03, abs_tol=1e-3)


def properties(kind: type) -> list[str]:
    """Return the names of what a class's instances can be asked for, in their order."""
    names = [name for one in reversed(kind.__mro__) for name, value in vars(one).items() if isinstance(value, property)]
    return list(dict.fromkeys(names))
