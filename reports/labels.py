"""Labels of roles, sections and parameters."""

from collections.abc import Mapping

from drivers.interfaces.role import ROLES
from drivers.interfaces.text import Text, text, word
from procedures.core.parameters import PARAMETERS


def role_name(role: str) -> Text:
    """Return what readers call the instrument of a role; one without such a name keeps its own."""
    return next((spec.label for one, spec in ROLES.items() if one.value == role), Text("{role}", {"role": role}))


def section_name(section: str) -> Text:
    """Return a section as readers look it up: `§3.2` of the note, the paper, or of this bench's own, as `L1`."""
    if section == "paper":
        return text("paper")
    return Text("§{section}" if section[:1].isdigit() else "{section}", {"section": section})


class ParameterLabels:
    """Labels of parameters where only their names are at hand; `own` are those that are not in the table."""

    def __init__(self, own: Mapping[str, str]) -> None:
        self._own = own

    def __getitem__(self, name: str) -> Text:
        """Return a parameter's label; one that nothing defines keeps its name."""
        return PARAMETERS[name].label if name in PARAMETERS else word(self._own.get(name) or name)


def phrase(words: str) -> Text:
    """Return an estimator's or a convention's fixed words as a text that the catalogue may translate."""
    return Text(words.replace("{", "{{").replace("}", "}}"))
