"""Random benches with a dynamometer and an inverter, none of whose faults anybody knows, and what they read of a motor."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.flux.plan import PlannedReading
from procedures.estimation.flux.readings import FluxReadings
from tests.studies.worlds.flux_truths import Array, Complex, TrueMotor

#: Limits of the gains, which is all that is known of a bench; noise in shares of the largest voltage and current.
CURRENT_GAIN, VOLTAGE_GAIN, NOISE = 0.005, 0.003, 0.0004
#: Settling, measuring and resting take so long (s) a reading.
SECONDS = 5.0


@dataclass(frozen=True)
class RandomBench:
    """Gains (relative), angle (rad), delay (s), drops (V over A), resistance (Ω over s), magnet and iron of one bench."""

    voltage_gain: float
    current_gain: float
    angle: float
    delay: float
    drop: float
    drop_width: float
    drop_kind: int
    resistance: float
    warming: float
    warming_time: float
    wander: tuple[float, float, float]
    magnet_loss: float
    magnet_time: float
    hysteresis: float
    eddy: float

    def resistance_at(self, time: Array) -> Array:
        """Return the winding's resistance (Ω)."""
        depth, period, phase = self.wander
        kelvin = self.warming * (1.0 - np.exp(-time / self.warming_time))
        kelvin = kelvin + depth * (np.sin(2.0 * np.pi * time / period + phase) - np.sin(phase))
        return np.asarray(self.resistance * (1.0 + 0.00393 * kelvin))

    def drop_at(self, size: Array) -> Array:
        """Return what dead time and semiconductors take (V, peak) at a current's amplitude (A)."""
        x = size / self.drop_width
        shape = (np.tanh(x), x / (1.0 + x), 1.0 - np.exp(-x), x / np.sqrt(1.0 + x**2), 2.0 / np.pi * np.arctan(x))
        return np.asarray(self.drop * shape[self.drop_kind])

    def magnet_at(self, time: Array) -> Array:
        """Return by what share the magnet's flux has fallen."""
        return np.asarray(self.magnet_loss * (1.0 - np.exp(-time / self.magnet_time)))


def random_bench(motor: TrueMotor, random: np.random.Generator) -> RandomBench:
    """Return a bench for a motor."""
    largest = motor.largest_current
    typical = motor.resistance * largest
    return RandomBench(
        voltage_gain=random.uniform(-VOLTAGE_GAIN, VOLTAGE_GAIN),
        current_gain=random.uniform(-CURRENT_GAIN, CURRENT_GAIN),
        angle=np.radians(random.uniform(-0.5, 0.5)),
        delay=random.uniform(-20e-6, 20e-6),
        drop=random.uniform(1.0, 3.0) * min(1.0, typical / 6.0),
        drop_width=largest * 10.0 ** random.uniform(-2.0, -1.0),
        drop_kind=int(random.integers(5)),
        resistance=motor.resistance * random.uniform(0.9, 1.1),
        warming=random.uniform(25.0, 50.0),
        warming_time=random.uniform(120.0, 600.0),
        wander=(random.uniform(0.0, 2.0), random.uniform(150.0, 400.0), random.uniform(0.0, 2.0 * np.pi)),
        magnet_loss=0.001 * random.uniform(0.0, 25.0) if motor.magnet else 0.0,
        magnet_time=random.uniform(200.0, 900.0),
        hysteresis=random.uniform(0.0, 0.01),
        eddy=random.uniform(0.0, 0.01),
    )


def true_flux(motor: TrueMotor, current: Complex, fallen: Array) -> Complex:
    """Return ψ for a magnet that has lost a share of its flux: as if so much less of it were there on the d axis."""
    if not motor.magnet or not np.any(fallen):
        return motor.flux(current)
    base = float(motor.flux(np.zeros(1, dtype=complex))[0].real)
    less = base * fallen
    # The smallest shift that takes exactly this flux away without current; a measured table is not smooth, nor everywhere rising.
    steps = np.linspace(0.0, 0.5 * motor.largest_current, 2001)
    falling = np.maximum.accumulate(base - motor.flux(-steps.astype(complex)).real)
    shift = np.interp(less, falling, steps)
    return motor.flux(current - shift)


def read(
    motor: TrueMotor,
    bench: RandomBench,
    plan: Sequence[PlannedReading],
    random: np.random.Generator,
    *,
    start: float = 0.0,
) -> tuple[FluxReadings, Array]:
    """Return what a bench reads at the planned currents, and these currents (n, 2); the first at `start` (s) of its warming."""
    time = start + SECONDS * np.arange(len(plan))
    speed = motor.electrical_speed * np.array([each.direction for each in plan], dtype=float)
    wanted = np.array([[each.i_d, each.i_q] for each in plan])
    shown: NDArray[np.complex128] = wanted[:, 0] + 1j * wanted[:, 1]
    current = (1.0 + bench.current_gain) * np.exp(1j * bench.angle) * shown
    scale = float(np.max(np.abs(motor.flux(shown))))
    # Iron losses as a current across the winding: shares of the largest current at the full flux and the test's speed.
    loss = (bench.hysteresis + bench.eddy * np.abs(speed) / motor.electrical_speed) * motor.largest_current / scale
    fallen = bench.magnet_at(time)
    flux = true_flux(motor, current, fallen)
    for _ in range(4):
        flux = true_flux(motor, current - loss * np.sign(speed) * 1j * flux, fallen)
    size = np.abs(current)
    drop = bench.drop_at(size) * current / np.where(size > 0.0, size, 1.0)
    inner = bench.resistance_at(time) * current + drop + 1j * speed * flux
    voltage = (1.0 + bench.voltage_gain) * np.exp(-1j * speed * bench.delay) * inner * np.exp(-1j * bench.angle)
    noise_u = NOISE * float(np.max(np.abs(voltage)))
    noise_i = NOISE * motor.largest_current
    n = len(plan)
    voltage = voltage + noise_u * (random.normal(size=n) + 1j * random.normal(size=n))
    shown = shown + noise_i * (random.normal(size=n) + 1j * random.normal(size=n))
    readings = FluxReadings.of(
        time, shown.real, shown.imag, voltage.real, voltage.imag, speed, noise_u, noise_i
    )  # fmt: skip
    return readings, wanted
