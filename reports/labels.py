"""What readers call the parameters."""

from drivers.interfaces.role import ROLES
from drivers.interfaces.text import Text, text
from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.parameters import PARAMETERS


def role_name(role: str) -> Text:
    """Return what readers call the instrument of a role; one without such a name keeps its own."""
    return next((spec.label for one, spec in ROLES.items() if one.value == role), Text("{role}", {"role": role}))


def section_name(section: str) -> Text:
    """Return a section as readers look it up: `§3.2` of the note, the paper, or of this bench's own, as `L1`."""
    if section == "paper":
        return text("paper")
    return Text("§{section}" if section[:1].isdigit() else "{section}", {"section": section})


def parameter_name(name: str) -> Text:
    """Return a parameter's label; one that nothing defines keeps its name."""
    definition = _definition(name)
    return definition.label if definition else Text("{name}", {"name": name})


def unit_for_readers(name: str, unit: str) -> str:
    """Return the unit in which readers expect a parameter: flux linkage in webers, which are volt-seconds."""
    definition = _definition(name)
    return definition.reader_unit or unit if definition else unit


def _definition(name: str) -> ParameterDefinition | None:
    if name in PARAMETERS:
        return PARAMETERS[name]
    # Only a parameter that is not in the table needs the procedures, whose import takes long.
    from procedures.known_parameters import known_parameters

    return known_parameters().get(name)


def phrase(words: str) -> Text:
    """Return an estimator's or a convention's fixed words as a text that the catalogue may translate."""
    return Text(words.replace("{", "{{").replace("}", "}}"))
