"""Options that several commands have."""

from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

#: Seed of what is drawn at random.
Seed = Annotated[int, Parameter(validator=Number(gte=0))]
