"""Equations of a free rotor under current whose fluxes follow a law of both currents."""

import math

import numpy as np

from sim_instruments.physics.circuits.source import Source
from sim_instruments.physics.circuits.windings import AXES, FloatArray
from sim_instruments.physics.integration.swing_equations import Law, Shaft, SwingEquations
from sim_instruments.physics.mapped.network import MappedNetwork


class MappedSwing(SwingEquations):
    """Shaft and up to three loops as `SwingEquations` has them, with the law's fluxes and differential inductances.

    Eddy currents in the iron brake the shaft here, and take no current; hysteresis is part of the shaft's dry friction.
    """

    def __init__(self, network: MappedNetwork, shaft: Shaft, source: Source) -> None:
        windings = network.windings
        self._windings = windings
        _, turn = network.principal_loops
        basis: FloatArray = network.basis @ turn
        turns = np.array(windings.motor.turn_shares)
        #: Shares of the loops in the d axis are cosine·cos θ + sine·sin θ, in the q axis −cosine·sin θ + sine·cos θ.
        self._cosines: list[float] = ((np.cos(AXES) * turns) @ basis).tolist()
        self._sines: list[float] = ((np.sin(AXES) * turns) @ basis).tolist()
        self._zero: list[list[float]] = (basis.T @ windings.zero_sequence @ basis).tolist()
        self._rest = [
            (order, *[part for value in phasors for part in (value.real, value.imag)])
            for order, phasors in zip(windings.emf_orders, (basis.T @ windings.rest_phasors).T.tolist(), strict=True)
            if any(phasors)
        ]
        super().__init__(network, shaft, source)

    def _written_out(self) -> Law:
        """Return the law with everything that does not change in its own variables."""
        cos, sin, p = math.cos, math.sin, self._p
        shaft, (cogging, cogging_order, cogging_phase) = self._shaft, self._cogging
        inertia, coulomb, viscous, outside = shaft.inertia, shaft.coulomb_friction, shaft.viscous_friction, shaft.torque
        flux_at, iron = self._windings.law.at, self._windings.motor.iron
        loss_scale = 1.5 * p * self._windings.loss_scale if iron.eddy_loss else 0.0
        eddy = iron.eddy_loss
        cosines, sines, zero, rest = self._cosines, self._sines, self._zero, tuple(self._rest)
        drive, voltage, voltage_slope = self._drive, self._voltage, self._voltage_slope
        k, regulated, current, follows = self._k, self._regulated, self._current, self._follows
        has_0, has_1, has_2 = self._columns
        #: Loops whose currents are states, in their order.
        free = [loop for loop, has in enumerate((has_0 and not regulated, has_1, has_2 and not follows)) if has]
        if not regulated and not has_0:
            free.insert(0, 0)
        carrying = sorted({*free, *([0] if regulated else []), *([2] if has_2 else [])})

        def law(passed: float, state: list[float], direction: int) -> tuple[list[float], float, float]:
            angle, speed = state[0], state[1]
            theta, electrical = angle * p, p * speed
            c, s = cos(theta), sin(theta)
            emf = [0.0, 0.0, 0.0]
            for order, real0, imaginary0, real1, imaginary1, real2, imaginary2 in rest:
                along, across = cos(order * theta), sin(order * theta)
                emf[0] += along * real0 - across * imaginary0
                emf[1] += along * real1 - across * imaginary1
                emf[2] += along * real2 - across * imaginary2
            x = [current if regulated else 0.0, 0.0, 0.0]
            for place, loop in enumerate(free, start=2):
                x[loop] = state[place]
            if follows and has_2:
                x[2] = -(k[2][0] * x[0] + k[2][1] * x[1] + electrical * emf[2]) / k[2][2]
            shares = [(cosines[loop] * c + sines[loop] * s, sines[loop] * c - cosines[loop] * s) for loop in range(3)]
            d = q = 0.0
            for loop in carrying:
                d += shares[loop][0] * x[loop]
                q += shares[loop][1] * x[loop]
            d, q = d / 1.5, q / 1.5
            d_flux, q_flux, dd, dq, qd, qq = flux_at(d, q)
            torque = p * (1.5 * (d_flux * q - q_flux * d) + x[0] * emf[0] + x[1] * emf[1] + x[2] * emf[2]) + outside
            torque -= cogging * sin(cogging_order * angle + cogging_phase)
            brake = direction * coulomb + viscous * speed
            if loss_scale:
                brake += loss_scale * eddy * electrical * (d_flux**2 + q_flux**2)
            derivatives = [speed, (torque - brake) / inertia]
            # How the axes' fluxes turn and change by the turning alone.
            d_turn = electrical * (dd * q - dq * d - q_flux)
            q_turn = electrical * (qd * q - qq * d + d_flux)
            left, rows = [], []
            for loop in carrying:
                along, across = shares[loop]
                resistive = k[loop][0] * x[0] + k[loop][1] * x[1] + k[loop][2] * x[2]
                left.append(resistive + along * d_turn + across * q_turn + electrical * emf[loop])
                row_d, row_q = (along * dd + across * qd) / 1.5, (along * dq + across * qq) / 1.5
                rows.append(
                    [row_d * shares[other][0] + row_q * shares[other][1] + zero[loop][other] for other in carrying]
                )
            if not regulated:
                left[0] -= drive * (voltage + voltage_slope * passed)
            places = [carrying.index(loop) for loop in free]
            slopes = _solved([[rows[i][j] for j in places] for i in places], [-left[i] for i in places])
            derivatives.extend(slopes)
            if regulated:
                watched = (left[0] + sum(rows[0][j] * slope for j, slope in zip(places, slopes, strict=True))) / drive
            else:
                watched = drive * x[0]
            return derivatives, watched, torque

        return law


def _solved(matrix: list[list[float]], right: list[float]) -> list[float]:
    """Solve up to three equations by elimination; their matrix has a positive definite symmetric part."""
    count = len(right)
    for at in range(count):
        for row in range(at + 1, count):
            share = matrix[row][at] / matrix[at][at]
            for column in range(at + 1, count):
                matrix[row][column] -= share * matrix[at][column]
            right[row] -= share * right[at]
    for at in reversed(range(count)):
        for column in range(at + 1, count):
            right[at] -= matrix[at][column] * right[column]
        right[at] /= matrix[at][at]
    return right
