"""Tables of a motor that bends, as their owners would write them, and what an analysis prints of one."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.studies.worlds.flux_truths import Array, true_motors

MOTOR = true_motors(None)["reluctance, little magnet"]
GRID = np.array([[d, q] for d in np.linspace(-16.0, 16.0, 9) for q in np.linspace(-16.0, 16.0, 9)])


def rows_of(change: Callable[[Array, Array], tuple[Array, Array]] = lambda i, psi: (i, psi)) -> Array:
    flux = MOTOR.flux(GRID[:, 0] + 1j * GRID[:, 1])
    return np.hstack(change(GRID, np.column_stack((flux.real, flux.imag))))


def written(path: Path, rows: Array, heading: str = "id_A,iq_A,psi_d_Vs,psi_q_Vs") -> Path:
    path.write_text(
        heading + "\n" + "\n".join(",".join(f"{x:.9g}" for x in row) for row in rows) + "\n", encoding="utf-8"
    )
    return path


def analyzed(capsys: pytest.CaptureFixture[str], status: int, made: int) -> dict:
    assert made == status
    return json.loads(capsys.readouterr().out)
