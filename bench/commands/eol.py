"""`motorbench eol`: the end of a line; `app` gathers its commands, each imported when it is called."""

from cyclopts import App, Parameter

#: Name, module and function under `bench.commands`, and one line of help.
_COMMANDS = (
    ("run", "eol_run:run", "Measure a batch of motors by a plan."),
    ("schema", "eol_schema:schema", "The plan file's JSON schema, for editors."),
    ("export", "eol_export:export", "Write records as CSV, Parquet, JUnit XML or JSON lines."),
    ("labels", "eol_export:labels", "The label line of each motor of a batch."),
)


def app() -> App:
    """Return the group of commands."""
    group = App(name="eol", help="End of line: batches, limits, records.", default_parameter=Parameter(negative=()))
    for name, where, words in _COMMANDS:
        group.command(f"bench.commands.{where}", name=name, help=words)
    return group
