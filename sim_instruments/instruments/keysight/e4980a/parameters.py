"""From an impedance to the pair of parameters that a bridge shows."""

import cmath
import math

OVERFLOW = 9.9e37

TOKENS = (
    "CPD", "CPQ", "CPG", "CPRP", "CSD", "CSQ", "CSRS", "LPD", "LPQ", "LPG", "LPRP", "LPRD", "LSD", "LSQ", "LSRS",
    "LSRD", "RX", "ZTD", "ZTR", "GB", "YTD", "YTR", "VDID",
)  # fmt: skip
NEED_DC = ("LPRD", "LSRD", "VDID")
"""Functions that measure with direct current, which is an option."""


def _over(numerator: float, denominator: float) -> float:
    if denominator == 0.0:
        return OVERFLOW
    return max(-OVERFLOW, min(OVERFLOW, numerator / denominator))


def pair(token: str, impedance: complex, frequency: float, dc_resistance: float = 0.0) -> tuple[float, float]:
    """Return primary and secondary parameter (SI; degrees for TD) of an impedance (Ω) at a frequency (Hz)."""
    omega = 2.0 * math.pi * frequency
    resistance, reactance = impedance.real, impedance.imag
    admittance = 1.0 / impedance if impedance != 0.0 else complex(OVERFLOW, 0.0)
    conductance, susceptance = admittance.real, admittance.imag
    dissipation = _over(abs(resistance), abs(reactance)) * (1.0 if resistance >= 0.0 else -1.0)
    quality = _over(abs(reactance), abs(resistance)) * (1.0 if resistance >= 0.0 else -1.0)
    primary = {
        "CP": susceptance / omega,
        "CS": _over(-1.0, omega * reactance),
        "LP": _over(-1.0, omega * susceptance),
        "LS": reactance / omega,
    }
    secondary = {
        "D": dissipation,
        "Q": quality,
        "G": conductance,
        "RP": _over(1.0, conductance),
        "RS": resistance,
        "RD": dc_resistance,
    }
    match token:
        case "RX":
            return resistance, reactance
        case "GB":
            return conductance, susceptance
        case "ZTD" | "ZTR" | "YTD" | "YTR":
            quantity = impedance if token[0] == "Z" else admittance
            angle = cmath.phase(quantity)
            return abs(quantity), math.degrees(angle) if token.endswith("D") else angle
        case "VDID":
            # The virtual bench applies no DC bias.
            return 0.0, 0.0
    return primary[token[:2]], secondary[token[2:]]
