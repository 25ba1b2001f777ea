"""Current probes whose gain falls as the current nears what their core or amplifier can do; nothing of the estimator is used.

A clamp is stated within 1 … 3 % up to its rated current and several times that above it. How it is made decides which law it follows:

- an open-loop Hall probe: the core's own ampere-turns beside the gap's, rising with a power of the flux density, or without limit;
- an amplifier that limits softly;
- a compensated probe whose compensation current ends, after which the Hall element alone reads on.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Random = np.random.Generator
Law = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class BentProbe:
    """A probe by its law, of gain 1 at no current; `scale` is the law's current for one ampere, `remanence` what magnetised it before."""

    law: Law
    scale: float
    remanence: float = 0.0

    def read(self, current: np.ndarray) -> np.ndarray:
        """Return what it reads; zeroed, as a user does it, with no current."""
        before = np.array([self.remanence, self.remanence + 1e-4])
        zero, gain = self.law(before)[0], np.diff(self.law(before))[0] / 1e-4
        return (self.law(self.scale * current + self.remanence) - zero) / (gain * self.scale)


def _inverted(ampere_turns: Law, most: float) -> Law:
    """Return the flux density that asks for given ampere-turns; `most` is the highest."""
    densities = np.linspace(-most, most, 40_001)
    needed = ampere_turns(densities)
    return lambda current: np.interp(current, needed, densities)


def drawn_law(random: Random) -> Law:
    """Draw a probe's law, in units of its limit."""
    match random.choice(["power", "core", "amplifier", "compensated"]):
        case "power":
            share, power = np.exp(random.uniform(np.log(0.02), np.log(0.5))), random.uniform(2.0, 12.0)
            return _inverted(lambda b: b * (1.0 + share * np.abs(b) ** power), 8.0)
        case "core":
            share = np.exp(random.uniform(np.log(0.005), np.log(0.3)))
            return _inverted(lambda b: b + share * b / (1.0 - np.minimum(np.abs(b), 0.99999)), 0.99999)
        case "amplifier":
            power = random.uniform(2.0, 8.0)
            return lambda x: x / (1.0 + np.abs(x) ** power) ** (1.0 / power)
        case _:
            left, width = random.uniform(0.05, 0.6), np.exp(random.uniform(np.log(0.03), np.log(0.3)))

            def compensated(x: np.ndarray) -> np.ndarray:
                beyond = width * np.logaddexp(0.0, (np.abs(x) - 1.0) / width)
                return np.sign(x) * (np.abs(x) - (1.0 - left) * (beyond - width * np.log1p(np.exp(-1.0 / width))))

            return compensated


def drawn_probe(random: Random, *, magnetised: bool = False) -> BentProbe:
    """Draw a probe by how near a current of 1 comes to its limit; one that is magnetised, which nobody degaussed, by up to a third of it.

    One that reads more than a quarter too little at 1 is drawn again: there anybody sees that the current does not reach its end.
    """
    while True:
        near = float(np.exp(random.uniform(np.log(0.15), np.log(1.5))))
        before = float(random.uniform(-0.33, 0.33)) if magnetised else 0.0
        probe = BentProbe(drawn_law(random), near, before)
        if abs(1.0 - float(probe.read(np.array([1.0]))[0])) < 0.25:
            return probe
