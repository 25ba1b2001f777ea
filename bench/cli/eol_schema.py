"""`motorbench eol schema`."""

import json
import sys


def schema() -> None:
    """Print the JSON schema of plan files, for editors that check TOML as it is written."""
    from bench.eol.plan import plan_schema

    sys.stdout.write(json.dumps(plan_schema(), ensure_ascii=False, indent=2) + "\n")
