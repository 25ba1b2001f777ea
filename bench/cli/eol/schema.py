"""`motorbench eol schema`."""

import json
import sys
from typing import Any

from bench.cli.options import Language
from bench.i18n.language import language_of, translator
from drivers.interfaces.text import Translate


def schema(*, language: Language = "auto") -> None:
    """Print the JSON schema of plan files, for editors that check TOML as it is written."""
    from bench.eol.plan import plan_schema

    told = _described(plan_schema(), translator(language_of(language)))
    sys.stdout.write(json.dumps(told, ensure_ascii=False, indent=2) + "\n")


def _described(part: Any, translate: Translate) -> Any:
    """Return a part of a schema with its descriptions in the reader's language."""
    if isinstance(part, list):
        return [_described(one, translate) for one in part]
    if not isinstance(part, dict):
        return part
    return {
        name: translate(one) if name == "description" and isinstance(one, str) else _described(one, translate)
        for name, one in part.items()
    }
