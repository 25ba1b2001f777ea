"""Every fault that can be described, told apart by its key `fault`."""

from typing import Annotated, Any, get_args

from pydantic import Field, TypeAdapter

from sim_instruments.faults.description import Description
from sim_instruments.faults.on_bench import (
    CurrentLimited,
    MotorUnplugged,
    OpenPhase,
    SpeedRunaway,
    StuckOutput,
    StuckRelay,
    StuckRotor,
    Swapped,
    ThermalRunaway,
)
from sim_instruments.faults.on_hands import MisClamped, MisClipped, MisPlaced
from sim_instruments.faults.on_lines import LineFault, Unplugged, WrongIdentity

AnyFault = Annotated[
    LineFault
    | WrongIdentity
    | Unplugged
    | OpenPhase
    | Swapped
    | MisClipped
    | MisPlaced
    | MisClamped
    | StuckRotor
    | MotorUnplugged
    | StuckOutput
    | StuckRelay
    | CurrentLimited
    | SpeedRunaway
    | ThermalRunaway,
    Field(discriminator="fault"),
]
FAULT: TypeAdapter[Description] = TypeAdapter(AnyFault)


def kinds() -> dict[str, type[Description]]:
    """Return the model of every kind of fault by its name."""
    models: tuple[Any, ...] = get_args(get_args(AnyFault)[0])
    return {kind: model for model in models for kind in get_args(model.model_fields["fault"].annotation)}
