"""Options that several commands have."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

#: Seed of what is drawn at random.
Seed = Annotated[int, Parameter(validator=Number(gte=0))]
Language = Annotated[str, Parameter(help="en, zh, or auto by the locale.")]
Json = Annotated[bool, Parameter(help="Print one JSON object and nothing else.")]
RecordsAddress = Annotated[str, Parameter(help="The records: a SQLite file, or postgresql://USER@HOST/NAME.")]
Runs = Annotated[Path, Parameter(help="Folder of the runs.")]
