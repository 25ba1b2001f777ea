"""An output for records: a file a motor, for the house's own system to fetch."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bench.plugins.records import RecordOutput


def store(record: Mapping[str, Any], folder: Path) -> None:
    """Hand a record over."""
    kept = {
        "serial": record["serial_number"],
        "verdict": record["verdict"],
        "rework": record.get("rework", ""),
        "figures": {figure["parameter"]: figure["value"] for figure in record["measured"]},
    }
    (folder / "mes").mkdir(parents=True, exist_ok=True)
    (folder / "mes" / f"{record['serial_number']}.json").write_text(json.dumps(kept), encoding="utf-8")


MES = RecordOutput("acme-mes", store)
