"""What not every inverter can do: one that cannot refuses by name, and the length of a current vector has a limit too."""

import math
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.safety.limits.bounds import Limit, Limits
from bench.safety.limits.guard import guarded
from drivers.interfaces import (
    AbilityError,
    Accuracy,
    DqReading,
    Identity,
    Inverter,
    InverterAbility,
    LimitError,
    Reading,
    Role,
    SetpointError,
)
from drivers.interfaces.declarations import Quantity, declarations
from drivers.interfaces.text import Text

ACCURACY = Accuracy(offset=0.01, source="test")


class Plain(Inverter):
    """An inverter that can do nothing of what not every one can."""

    def __init__(self) -> None:
        self.sent: list[Any] = []

    @property
    def identity(self) -> Identity:
        return Identity("maker", "plain inverter")

    @property
    def abilities(self) -> frozenset[InverterAbility]:
        return frozenset()

    @property
    def maximum_current(self) -> float:
        return 10.0

    @property
    def maximum_frequency(self) -> float:
        return 0.0

    def command_zero(self) -> None:
        self.sent.append("zero")

    def measure_frequency(self) -> Reading:
        return Reading(0.0, "Hz", ACCURACY, 0.0)

    def measure_current(self) -> Reading:
        return Reading(0.0, "A", ACCURACY, 0.0)

    def make_safe(self) -> None:
        self.sent.append("off")

    def close(self) -> None:
        self.sent.append("closed")


class Vector(Plain):
    """An inverter that regulates both currents."""

    @property
    def abilities(self) -> frozenset[InverterAbility]:
        return frozenset({InverterAbility.DQ_CURRENT})

    def driving_dq_current(self, d_current: float, q_current: float) -> AbstractContextManager[None]:
        return self._on(d_current, q_current)

    @contextmanager
    def _on(self, d_current: float, q_current: float) -> Iterator[None]:
        self.sent.append((d_current, q_current))
        yield

    def set_dq_current(self, d_current: float, q_current: float) -> None:
        self.sent.append((d_current, q_current))

    def measure_dq(self, duration: float = 0.0) -> DqReading:
        return DqReading(0.0, -3.0, 4.0, math.nan, math.nan, 100.0 * math.pi, math.nan, ACCURACY, ACCURACY)


CALLS = {
    "driving_frequency": (1.0, 1.0),
    "driving_current": (1.0,),
    "set_current": (1.0,),
    "driving_dq_current": (1.0, 1.0),
    "set_dq_current": (1.0, 1.0),
    "alternate_dq_current": (1.0, 1.0, 1.0, -1.0, 0.01, 3),
    "measure_dq": (),
}


def limits(current: float, **others: Limit) -> Limits:
    held = {Quantity.CURRENT: Limit(current, Text("somebody")), **{Quantity[name]: one for name, one in others.items()}}
    return Limits(held, held)


def test_every_ability_but_those_of_readings_fields_is_asked_by_a_method() -> None:
    asked = {one.ability for one in declarations(Inverter).values()} - {None}
    assert asked == set(InverterAbility) - {InverterAbility.VOLTAGES, InverterAbility.ROTOR_ANGLE}
    assert {name for name, one in declarations(Inverter).items() if one.ability} == CALLS.keys()


@pytest.mark.parametrize("name", CALLS)
def test_what_an_inverter_does_not_offer_it_refuses_by_name_and_sends_nothing(name: str) -> None:
    inverter = Plain()
    with pytest.raises(AbilityError) as caught:
        getattr(inverter, name)(*CALLS[name])
    ability = declarations(Inverter)[name].ability
    assert caught.value.ability is ability
    assert str(caught.value) == (
        f"plain inverter: this inverter does not offer {caught.value.ability.label}; nothing was sent. "
        "Use another inverter for this procedure"
    )
    assert not inverter.sent


@given(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0))
def test_the_vectors_length_is_held_against_the_limit_of_its_components(d_current: float, q_current: float) -> None:
    inverter = Vector()
    guard: Any = guarded(Role.INVERTER, inverter, "inverter", limits(5.0))
    if math.hypot(d_current, q_current) <= 5.0:
        guard.set_dq_current(d_current, q_current)
        with guard.driving_dq_current(d_current, q_current=q_current):
            assert inverter.sent == [(d_current, q_current)] * 2
    else:
        for call in (
            guard.set_dq_current,
            guard.driving_dq_current,
            lambda *both: guard.judge("set_dq_current", *both),
        ):
            with pytest.raises(SetpointError, match="the limit of somebody"):
                call(d_current, q_current)
        assert not inverter.sent


def test_a_refused_vector_is_called_so() -> None:
    guard: Any = guarded(Role.INVERTER, Vector(), "inverter", limits(5.0))
    with pytest.raises(
        SetpointError, match=r"^inverter: current vector = 5\.65685 A is outside 0 … 5 A, the limit of somebody"
    ):
        guard.set_dq_current(-4.0, 4.0)
    with pytest.raises(SetpointError, match=r"^inverter: q-axis current = -6 A is outside -5 … 5 A"):
        guard.set_dq_current(0.0, -6.0)
    wide: Any = guarded(Role.INVERTER, Vector(), "inverter", limits(100.0))
    with pytest.raises(
        SetpointError, match=r"current vector = 12\.7279 A is outside 0 … 10 A, the limit of the instrument"
    ):
        wide.judge("set_dq_current", 9.0, 9.0)


def test_readings_in_the_rotors_frame_are_held_against_current_and_speed() -> None:
    read: Any = guarded(Role.INVERTER, Vector(), "inverter", limits(4.8)).measure_dq  # type: ignore[attr-defined]
    assert read().current_amplitude == pytest.approx(5.0)
    with pytest.raises(LimitError, match="current amplitude = 5 A is beyond 4 A"):
        guarded(Role.INVERTER, Vector(), "inverter", limits(4.0)).measure_dq()  # type: ignore[attr-defined]
    slow = limits(10.0, SPEED=Limit(40.0, Text("the motor")))
    with pytest.raises(LimitError, match="electrical frequency = 50 Hz"):
        guarded(Role.INVERTER, Vector(), "inverter", slow, pole_pairs=lambda: 4).measure_dq()  # type: ignore[attr-defined]
