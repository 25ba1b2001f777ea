"""The linear circuit that a set of conducting switches and diodes makes, in its own modes."""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from sim_instruments.six_step.drive import SixStepDrive
from sim_instruments.six_step.emf import emf_phasors

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


class Idle(Enum):
    """The state of the leg without a switched-on transistor (leg 2 in T1T2)."""

    OPEN = "open"
    UPPER_DIODE = "upper diode"
    LOWER_DIODE = "lower diode"


@dataclass(frozen=True)
class Conduction:
    """The conducting devices in T1T2: leg 1 by T1, leg 3 by T2, leg 2 by a diode or not at all.

    A switch that carries so much reverse current that its drop reaches the diode's is clamped by its diode.
    """

    idle: Idle
    upper_clamped: bool = False
    lower_clamped: bool = False


@dataclass(frozen=True)
class LinearForm:
    """Quantities linear in modal currents z and EMF: modal·z + constant + ω·Re(emf·exp(j·orders·θ)).

    Shapes: modal (m, n), constant (m,), emf (m, H).
    """

    modal: Real
    constant: Real
    emf: Complex

    def head(self, rows: int) -> "LinearForm":
        """Keep the first `rows` quantities alone."""
        return LinearForm(self.modal[:rows], self.constant[:rows], self.emf[:rows])


@dataclass(frozen=True)
class Observables:
    """The rows of a circuit's `LinearForm` of everything that can be looked at, in this order."""

    currents = slice(0, 3)
    emfs = slice(3, 6)
    voltages = slice(6, 9)
    line_currents = slice(9, 12)
    leg_voltages = slice(12, 15)
    bus_voltage = 15
    supply_current = 16


@dataclass(frozen=True)
class ConductionCircuit:
    """One conduction as decoupled first-order modes: dz/dt = −rates·z + drive − ω·Re(emf·exp(j·orders·θ)).

    Winding currents are `shapes`·z, and z = `weights`·currents (which also projects onto what the circuit allows).
    `watches` are the quantities that stay ≥ 0 while this conduction lasts; `successors[k]` says what follows when
    the k-th does not.
    """

    conduction: Conduction
    rates: Real
    shapes: Real
    weights: Real
    drive: Real
    emf: Complex
    watches: LinearForm
    successors: tuple[str, ...]
    observables: LinearForm


def line_matrix(drive: SixStepDrive) -> Real:
    """Line currents into the terminals 1, 2, 3 from the winding currents, shape (3, 3)."""
    if drive.connection == "delta":
        return np.array([[1.0, 0.0, -1.0], [-1.0, 1.0, 0.0], [0.0, -1.0, 1.0]])
    return np.eye(3)


def inductance_matrix(drive: SixStepDrive) -> Real:
    """Inductance matrix of the windings in H, shape (3, 3)."""
    difference = drive.self_inductance - drive.mutual_inductance
    return np.asarray(difference * np.eye(3) + np.full((3, 3), drive.mutual_inductance))


def loop_current(drive: SixStepDrive) -> float:
    """Give the current in A that only the resistances between the source's poles would let through: a tolerance scale."""
    return drive.source_voltage / (drive.resistance + drive.source_resistance + 2 * drive.switch_resistance)


def _freedom(drive: SixStepDrive, idle: Idle) -> Real:
    """Basis of the winding currents that the connection and an open leg allow, shape (3, n)."""
    if drive.connection == "delta":
        return np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]) if idle is Idle.OPEN else np.eye(3)
    return np.array([[1.0], [0.0], [-1.0]]) if idle is Idle.OPEN else np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, -1.0]])


def build_circuit(drive: SixStepDrive, conduction: Conduction) -> ConductionCircuit:
    """Build the circuit of `conduction`; exact, by the generalised symmetric eigenproblem of resistance and inductance."""
    idle, drop = conduction.idle, drive.diode_drop
    D, M = line_matrix(drive), inductance_matrix(drive)
    orders, E = emf_phasors(drive)
    # Legs on the positive rail feed from the bus; V = V0 − Rleg·j for the legs that conduct.
    on_bus = np.array([1.0, 1.0 if idle is Idle.UPPER_DIODE else 0.0, 0.0])
    V0 = drive.source_voltage * on_bus
    Rleg = drive.source_resistance * np.outer(on_bus, on_bus)
    if conduction.upper_clamped:
        V0[0] += drop
    else:
        Rleg[0, 0] += drive.switch_resistance
    if conduction.lower_clamped:
        V0[2] -= drop
    else:
        Rleg[2, 2] += drive.switch_resistance
    V0[1] += {Idle.UPPER_DIODE: drop, Idle.LOWER_DIODE: -drop, Idle.OPEN: 0.0}[idle]

    N = _freedom(drive, idle)
    S = drive.resistance * np.eye(3) + D.T @ Rleg @ D
    C = np.linalg.inv(np.linalg.cholesky(N.T @ M @ N))
    rates, X = np.linalg.eigh(C @ (N.T @ S @ N) @ C.T)
    X = C.T @ X
    W, forcing, emf = N @ X, X.T @ N.T @ D.T @ V0, X.T @ N.T @ E

    none = np.zeros_like(E)
    current = LinearForm(W, np.zeros(3), none)
    line = LinearForm(D @ W, np.zeros(3), none)
    winding = LinearForm(drive.resistance * W - (M @ W) * rates, M @ W @ forcing, E - M @ W @ emf)
    legs = LinearForm(-Rleg @ D @ W, V0, none.copy())
    if idle is Idle.OPEN:
        # The floating terminal, from leg 1 through the winding(s) between.
        path = np.array([-1.0, 0.0, 0.0]) if drive.connection == "delta" else np.array([-1.0, 1.0, 0.0])
        legs.modal[1] = legs.modal[0] + path @ winding.modal
        legs.constant[1] = legs.constant[0] + path @ winding.constant
        legs.emf[1] = path @ winding.emf
    supply = on_bus @ D @ W
    bus = LinearForm(
        -drive.source_resistance * supply[None], np.array([drive.source_voltage]), np.zeros((1, len(orders)), complex)
    )
    observables = _stack(
        [
            current,
            LinearForm(np.zeros_like(W), np.zeros(3), E),
            winding,
            line,
            legs,
            bus,
            LinearForm(supply[None], np.zeros(1), bus.emf),
        ]
    )
    watches, successors = _watches(drive, conduction, line, legs, bus)
    weights = X.T @ N.T @ M
    return ConductionCircuit(conduction, rates, W, weights, forcing, emf, watches, successors, observables)


def _watches(
    drive: SixStepDrive, conduction: Conduction, line: LinearForm, legs: LinearForm, bus: LinearForm
) -> tuple[LinearForm, tuple[str, ...]]:
    # A shift by the tolerance keeps a quantity that starts at 0 from being an event at once.
    ampere, volt = 1e-12 * loop_current(drive), 1e-9 * drive.source_voltage
    rows: list[tuple[LinearForm, float, str]] = []
    if conduction.idle is Idle.OPEN:
        below = _add(_scale(_row(legs, 1), -1.0, drive.diode_drop), _row(bus, 0))
        rows.append((below, volt, Idle.UPPER_DIODE.value))
        rows.append((_scale(_row(legs, 1), 1.0, drive.diode_drop), volt, Idle.LOWER_DIODE.value))
    else:
        sign = -1.0 if conduction.idle is Idle.UPPER_DIODE else 1.0
        rows.append((_scale(_row(line, 1), sign, 0.0), ampere, "idle current zero"))
    if drive.switch_resistance > 0:
        limit = drive.diode_drop / drive.switch_resistance
        upper, lower = (-1.0 if conduction.upper_clamped else 1.0), (-1.0 if conduction.lower_clamped else 1.0)
        rows.append((_scale(_row(line, 0), upper, upper * limit), ampere, "upper clamp"))
        rows.append((_scale(_row(line, 2), -lower, lower * limit), ampere, "lower clamp"))
    forms, tolerances, successors = zip(*rows, strict=True)
    stacked = _stack(list(forms))
    return LinearForm(stacked.modal, stacked.constant + np.array(tolerances), stacked.emf), successors


def _row(form: LinearForm, index: int) -> LinearForm:
    rows = slice(index, index + 1)
    return LinearForm(form.modal[rows], form.constant[rows], form.emf[rows])


def _scale(form: LinearForm, factor: float, offset: float) -> LinearForm:
    return LinearForm(factor * form.modal, factor * form.constant + offset, factor * form.emf)


def _add(one: LinearForm, other: LinearForm) -> LinearForm:
    return LinearForm(one.modal + other.modal, one.constant + other.constant, one.emf + other.emf)


def _stack(forms: list[LinearForm]) -> LinearForm:
    return LinearForm(
        np.vstack([f.modal for f in forms]),
        np.concatenate([f.constant for f in forms]),
        np.vstack([f.emf for f in forms]),
    )
