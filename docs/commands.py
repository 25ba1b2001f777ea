"""The command line, as the page of the commands reads it."""

from bench.cli.main import make_app

app = make_app()
