"""The current that circulates in a delta while an inverter impresses those of its terminals."""

import numpy as np

from sim_instruments.physics.circuits.windings import ComplexArray, FloatArray, Windings, turned

#: What drives less than this share of the flux linkage or of the windings' impedance round a delta drives nothing.
_NOTHING = 1e-12


class CirculatingCurrent:
    """Steady state, at the present speeds, of what EMF and unlike windings drive round a delta.

    Exact for like windings, whose zero sequence no saliency reaches; unlike ones take the inductance averaged over a turn.
    """

    def __init__(self, windings: Windings, shares: FloatArray) -> None:
        self._windings = windings
        self._resistance = float(windings.resistance.sum())
        self._inductance = float(windings.inductance_mean.sum())
        #: What the terminals' currents (A) and their slopes drive round the delta (Ω, H, shape (3,)), split by `shares` among the windings.
        self._ohmic: FloatArray = windings.resistance @ shares
        self._induced: FloatArray = windings.inductance_mean.sum(axis=0) @ shares
        emf = windings.emf_phasors.sum(axis=0)
        drives = np.abs(emf) > _NOTHING * abs(windings.flux_linkage)
        self._orders = tuple(np.array(windings.emf_orders)[drives].tolist())
        self._emf: ComplexArray = emf[drives]
        self._unlike = bool(
            np.abs(self._ohmic).max() > _NOTHING * self._resistance
            or np.abs(self._induced).max() > _NOTHING * self._inductance
        )

    @classmethod
    def of(cls, windings: Windings, shares: FloatArray) -> "CirculatingCurrent | None":
        """Return that of windings whose terminals' currents `shares` (3, 3) splits among them, None where nothing drives one."""
        if windings.motor.connection != "delta":
            return None
        found = cls(windings, shares)
        return found if found._orders or found._unlike else None

    def braking_torque(self, speed: FloatArray) -> FloatArray:
        """Return the mean torque (N·m, against the motion, (n,)) of what the magnets drive, at mechanical speeds (rad/s, not negative)."""
        motor, torque = self._windings.motor, np.zeros_like(speed)
        electrical = speed * motor.pole_pairs
        for order, emf in zip(self._orders, self._emf, strict=True):
            driving = abs(emf) * np.abs(self._share(electrical, order))
            impedance = self._resistance**2 + (order * electrical * self._inductance) ** 2
            # Loss over speed, with one factor of the speed taken out of both.
            torque += 0.5 * self._resistance * driving**2 * motor.pole_pairs * electrical / impedance
        return torque

    def _share(self, speeds: FloatArray, order: int) -> FloatArray | ComplexArray:
        motor = self._windings.motor
        if not motor.iron.lowers_emf:
            return np.ones_like(speeds)
        return motor.iron.emf_share(speeds, order, motor.pole_pairs, motor.flux_temperature_coefficient)

    def at(
        self, angles: FloatArray, speeds: FloatArray, terminals: ComplexArray, turning: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return current (A) and slope (A/s, shapes (n,)) at electrical angles (rad) and speeds (rad/s).

        `terminals` (A, complex, shape (3, n)) are the terminals' currents as phasors that turn with `turning` (rad/s).
        """
        current, slope = np.zeros_like(angles), np.zeros_like(angles)
        if self._orders:
            for order, emf, wave in zip(self._orders, self._emf, turned(angles, self._orders), strict=True):
                frequency = 1j * order * speeds
                driving = emf * speeds * wave * self._share(speeds, order)
                flowing = -driving / (self._resistance + frequency * self._inductance)
                current += flowing.real
                slope += (frequency * flowing).real
        if self._unlike:
            driving = self._ohmic @ terminals + 1j * turning * (self._induced @ terminals)
            flowing = -driving / (self._resistance + 1j * turning * self._inductance)
            current += flowing.real
            slope += (1j * turning * flowing).real
        return current, slope
