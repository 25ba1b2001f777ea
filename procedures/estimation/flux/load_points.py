"""Torque, speed, currents and power at load: efficiency and losses with what is known of their parts (IEC 60034-2-1's segregation)."""

from dataclasses import dataclass
from typing import Generic

from procedures.estimation.fitting.checks import Number, estimate_of
from procedures.estimation.fitting.fit import EstimationError

#: More efficiency than this, with what errors may add, is no motor's.
_MOST = 1.0


@dataclass(frozen=True)
class Efficiency(Generic[Number]):
    """Powers (W) and efficiency of one load point; `generating` where power goes from the shaft to the terminals."""

    input_power: Number
    output_power: Number
    efficiency: Number
    loss: Number
    generating: bool


def efficiency_of(torque: Number, speed: Number, electrical: Number) -> Efficiency[Number]:
    """Return efficiency and loss from shaft torque (N·m), mechanical speed (rad/s) and electrical power (W) into the terminals.

    Numbers may be GTC's: what the readings share (one instrument's gain) then cancels in the ratio and in the difference where it does.
    Raises EstimationError where no power flows, both powers flow in, or more comes out than goes in.
    """
    mechanical = torque * speed
    out, into = estimate_of(mechanical), estimate_of(electrical)
    if out > 0.0 and into > 0.0:
        result = Efficiency(electrical, mechanical, mechanical / electrical, electrical - mechanical, generating=False)
    elif out < 0.0 and into < 0.0:
        result = Efficiency(-mechanical, -electrical, electrical / mechanical, electrical - mechanical, generating=True)
    else:
        raise EstimationError(
            f"{out:.4g} W at the shaft and {into:.4g} W at the terminals: no power goes through; at such a point there are losses only, "
            "or a sign is wrong"
        )
    if estimate_of(result.efficiency) > _MOST:
        raise EstimationError(
            f"{estimate_of(result.output_power):.4g} W come out of {estimate_of(result.input_power):.4g} W: check rms against peak, the "
            "power meter's wiring, and the torque's zero"
        )
    return result
