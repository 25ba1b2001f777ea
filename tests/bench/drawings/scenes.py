"""Every connection that any procedure makes, as the procedures' own actions leave it."""

import contextlib
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any

from bench.drawings.connections import Scene
from bench.drawings.layout import Layout
from bench.drawings.lines import lines_of
from bench.motor.motor_file import load_motor
from bench.plugins.catalogues import installed
from drivers.interfaces import AbilityError
from procedures.core.actions import Action, MarkRestPositions, TurnToRest
from procedures.core.bench import Operator, ProcedureError
from procedures.core.nameplate import Nameplate, WindingConnection
from procedures.estimation.fitting.fit import EstimationError
from sim_instruments.bench import VirtualBench
from sim_instruments.physics.motor.hall import SimulatedHallSensors
from tests.runs.on_bench import measure

WYE = Nameplate("M1", WindingConnection.WYE, 2.0, wire_colours={"A": "white", "B": "green", "C": "black"})
DELTA = Nameplate("Long name of a motor", WindingConnection.DELTA, 2.0, wire_colours={"A": "turquoise", "B": "grey"})
#: Procedures that turn a motor by a six-step drive.
_SIX_STEP = ("equivalent-resistance", "no-load-current-six-step")
#: What a procedure wants of another one before; and as few readings as there can be, where the hands' work does not go by their number.
_SETTINGS = {
    "equivalent-resistance": ("loads=[0.5]",),
    "load-points": ("speed_shares=[1.0]", "current_shares=[0.5, 1.0]", "readings=3"),
    "open-circuit": ("speeds=3",),
}


class _Noted:
    """An operator whose actions are noted."""

    def __init__(self, operator: Operator, noted: list[Action]) -> None:
        self._operator = operator
        self._noted = noted

    def perform(self, action: Action) -> object:
        self._noted.append(action)
        return self._operator.perform(action)


@cache
def actions() -> dict[str, tuple[Action, ...]]:
    """Return each procedure's actions, as it asks for them on a virtual bench."""
    found = {}
    for name in installed().procedures:
        file = load_motor("92bl-30-25l" if name in _SIX_STEP else "lg-400w")
        plate = replace(file.nameplate, insulation_test_voltage=500.0, pole_pairs=4, hall_sensors=True)
        motor = replace(file.virtual_motor(), halls=SimulatedHallSensors())
        drive = {"six_step": file.six_step} if name in _SIX_STEP else {"fixture": True}
        noted = list[Action]()

        def hands(_: Any, operator: Operator, noted: list[Action] = noted) -> Operator:
            return _Noted(operator, noted)

        with (
            VirtualBench(motor, seed=3, sockets=False, **drive) as bench,
            # What it asked for until then is drawn all the same.
            contextlib.suppress(ProcedureError, AbilityError, EstimationError),
        ):
            measure(bench, plate, name, *_SETTINGS.get(name, ()), hands=hands)
        found[name] = tuple(noted)
    return found


def every_scene() -> list[Scene]:
    """Return every different step of hand work once: each procedure's, from a clear bench on."""
    found = {repr(scene): scene for chain in actions().values() for scene in _scenes(chain)}
    return list(found.values())


def _scenes(chain: tuple[Action, ...]) -> Iterator[Scene]:
    layouts = [Layout()]
    for action in chain:
        layouts.append(layouts[-1].after(action))
    for (before, after), action in zip(pairwise(layouts), chain, strict=True):
        yield Scene(after, before, lines_of(action), by_hand=isinstance(action, TurnToRest | MarkRestPositions))
