"""Calls of sigrok-cli on the supply, and on the voltmeter as the 34465A that libsigrok knows; its library is the one that is found."""

import json
import re
import subprocess
import urllib.request

from calls import TASK, TRUTH, Calls, address, hands
from pyvisa import ResourceManager

_PATIENCE = 5.0
_NUMBER = re.compile(r"^[PVI]\d?: (-?[\d.]+|inf) ?([µmk]?)", re.MULTILINE)
_PREFIXES = {"": 1.0, "µ": 1e-6, "m": 1e-3, "k": 1e3}
#: What the driver calls the functions, and what is right.
_FUNCTIONS = {
    "voltage/dc": lambda found: abs(found) < 0.01,
    "voltage/ac": lambda found: abs(found) < 0.01,
    "current/dc": 0.0,
    "current/ac": 0.0,
    "resistance": lambda found: 0.0 < found - TRUTH["resistance"] < 0.1,
    "resistance/four_wire": TRUTH["resistance"],
    "continuity": lambda found: 0.0 < found - TRUTH["resistance"] < 0.2,
    "voltage/dc/diode": lambda found: 0.0 < found < 0.01,
    "temperature": None,
    "frequency": None,
    "capacitance": None,
}


def sigrok(driver: str, role: str, *words: str) -> str:
    """Run sigrok-cli on an instrument's socket, and return what it says."""
    port = address(role, "socket").split("::")[2]
    command = ["sigrok-cli", "-d", f"{driver}:conn=tcp-raw/127.0.0.1/{port}", *words]
    done = subprocess.run(command, capture_output=True, text=True, timeout=_PATIENCE, check=False)
    if done.returncode or "Failed" in done.stderr or not (done.stdout or "--set" in words):
        raise RuntimeError(done.stderr.strip() or "no device found")
    return done.stdout.strip()


def number(said: str) -> float:
    """Return the first figure of what it says, in SI units."""
    value, prefix = _NUMBER.search(said).groups()
    return float(value) * _PREFIXES[prefix]


def errors(role: str):
    """Return what asks for an instrument's next error."""
    session = ResourceManager("@py").open_resource(address(role, "socket"))
    session.read_termination = session.write_termination = "\n"
    return lambda: session.query("SYST:ERR?")


def supply() -> None:
    """scpi-pps: every option of an output, its figures, and an acquisition."""
    calls = Calls("sigrok-cli scpi-pps E36313A", errors("supply"))
    first = ("-g", "1")
    calls.make("--scan", lambda: sigrok("scpi-pps", "supply", "--scan"), lambda said: "E36313A" in said)
    calls.make("--show", lambda: sigrok("scpi-pps", "supply", *first, "--show"), lambda said: "regulation: UR" in said)
    for group in "123":
        for option in ("voltage_target=5", "current_limit=1", "ovp_threshold=6", "ocp_enabled=on", "enabled=on"):
            calls.make(
                f"{group}: {option}",
                lambda group=group, option=option: sigrok(
                    "scpi-pps", "supply", "-g", group, "--config", option, "--set"
                ),
            )
    for option, right in (
        *(("voltage", lambda said: abs(float(said) - 5.0) < 0.05), ("current", lambda said: abs(float(said)) < 0.01)),
        *(("regulation", lambda said: "CV" in said), ("ocp_enabled", "true".__eq__)),
        *((name, "false".__eq__) for name in ("ovp_active", "ocp_active", "otp_active")),
    ):
        calls.make(
            f"--get {option}", lambda option=option: sigrok("scpi-pps", "supply", *first, "--get", option), right
        )
    calls.make(
        "--samples 2",
        lambda: sigrok("scpi-pps", "supply", "--samples", "2", "-O", "analog"),
        lambda said: said.count("V2: ") == 2,
    )
    calls.make(
        "voltage_target=500", lambda: sigrok("scpi-pps", "supply", *first, "--config", "voltage_target=500", "--set")
    )
    calls.make("enabled=off", lambda: sigrok("scpi-pps", "supply", *first, "--config", "enabled=off", "--set"))


def meter() -> None:
    """scpi-dmm: every function, by the identity of a sibling."""
    calls = Calls("sigrok-cli scpi-dmm 34461A as 34465A", errors("voltmeter"))
    calls.make("--scan, as it is", lambda: sigrok("scpi-dmm", "voltmeter", "--scan"))
    fault = {"fault": "wrong_identity", "role": "voltmeter", "identity": "Keysight Technologies,34465A,MY57201234,A.03"}
    body, kind = json.dumps(fault).encode(), {"Content-Type": "application/json"}
    urllib.request.urlopen(urllib.request.Request(f"{TASK['control']}/faults", body, kind, method="POST")).close()  # noqa: S310
    calls.make("--scan", lambda: sigrok("scpi-dmm", "voltmeter", "--scan"), lambda said: "34465A" in said)
    calls.make("--show", lambda: sigrok("scpi-dmm", "voltmeter", "--show"), lambda said: "voltage/dc (current)" in said)
    for function, right in _FUNCTIONS.items():
        words = ("--config", f"measured_quantity={function}", "--samples", "1", "-O", "analog")
        calls.make(function, lambda words=words: number(sigrok("scpi-dmm", "voltmeter", *words)), right)


hands("turn_shaft", speed=0.0)
supply()
meter()
