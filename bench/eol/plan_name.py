"""Name of the file of a type's plan: the panel asks for it without loading what measures."""

import re


def plan_name(model: str) -> str:
    """Return the file's name for a type's plan."""
    return (re.sub(r"[^\w.-]+", "-", model).strip("-.").lower() or "motor") + ".toml"
