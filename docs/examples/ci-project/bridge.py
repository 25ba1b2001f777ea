"""A small driver of one's own: an LCR bridge that speaks SCPI (Keysight E4980A)."""

from typing import Protocol


class Resource(Protocol):
    """What of a PyVISA resource the driver uses."""

    def write(self, message: str) -> object: ...
    def query(self, message: str) -> str: ...


class Bridge:
    """Measures series inductance (H) and resistance (Ω)."""

    def __init__(self, resource: Resource, frequency: float) -> None:
        self._resource = resource
        resource.write("*RST;*CLS")
        resource.write(f":FUNC:IMP LSRS;:FREQ {frequency:g};:APER LONG,4;:TRIG:SOUR BUS")

    def measure(self) -> tuple[float, float]:
        """Return inductance and resistance; RuntimeError where the bridge could not measure."""
        self._resource.write("TRIG:IMM")
        inductance, resistance, status = self._resource.query("FETC?").split(",")[:3]
        if int(status) != 0:
            raise RuntimeError(f"the bridge's status is {status}")
        return float(inductance), float(resistance)
