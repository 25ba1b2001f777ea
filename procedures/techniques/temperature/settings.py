"""Settings that say what is known of a temperature and of what it does, each procedure with its own default, and the reference."""

from typing import Annotated

from pydantic import Field

#: Where every resistance and flux linkage is referred to (°C).
COLD = 25.0
#: Of the winding, as a thermometer shows it (°C).
WindingTemperature = Annotated[
    float | None, Field(ge=-60.0, le=250.0, description="winding temperature, °C; asked for when not given")
]
#: Of the magnets, which no thermometer reaches (°C).
MagnetsTemperature = Annotated[
    float | None,
    Field(ge=-60.0, le=250.0, description="winding temperature, taken for the magnets', °C; asked for when not given"),
]
TemperatureUncertainty = Annotated[float, Field(ge=0.0, le=50.0, description="half-width of its uncertainty, K")]
CopperCoefficient = Annotated[float, Field(gt=0.0, le=0.01, description="temperature coefficient, 1/K")]
ReferenceTemperature = Annotated[float, Field(ge=-60.0, le=250.0, description="temperature at which it holds, °C")]
MagnetCoefficient = Annotated[
    float, Field(ge=-0.01, le=0.0, description="temperature coefficient of the magnets' flux at 25 °C, 1/K")
]
MagnetCoefficientUncertainty = Annotated[
    float | None,
    Field(ge=0.0, le=0.01, description="half-width of its uncertainty, 1/K; 30 % of it when not given"),
]
