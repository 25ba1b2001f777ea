"""`python -m tests.studies.connections FILE.svg`: a step's hand work as it is drawn, for the documentation.

With a folder instead: every connection that any procedure makes, in both forms and both languages, to be looked at.
"""

import sys
from pathlib import Path

from bench.drawings.canvas import Form
from bench.drawings.connections import Scene, draw, draw_connections
from bench.drawings.layout import Layout
from bench.i18n.language import translator
from bench.motor.motor_file import load_motor
from procedures.core.actions import STEP_NEGATIVE, CurrentProbe, Node, Terminal, VoltageProbe, meter_across
from tests.bench.drawings.scenes import every_scene


def main(target: Path) -> None:
    """Write the picture, or all of them."""
    plate = load_motor("lg-400w").nameplate
    if target.suffix == ".svg":
        before = Layout(meter_across(Terminal.A, Terminal.B).complete())
        probes = (VoltageProbe(1, Node.A, Node.B), CurrentProbe(4, Terminal.A))
        after = Layout(STEP_NEGATIVE.complete(), probes, rotor_locked=True)
        target.write_text(draw_connections(after, plate, before=before) + "\n", encoding="utf-8")
        return
    target.mkdir(parents=True, exist_ok=True)
    for number, scene in enumerate(every_scene()):
        for form in Form:
            for language in ("en", "zh"):
                path = target / f"{number:03d}-{form.value}-{language}.svg"
                path.write_text(_svg(scene, form, language), encoding="utf-8")


def _svg(scene: Scene, form: Form, language: str) -> str:
    return draw(scene, load_motor("lg-400w").nameplate, translator(language), form=form).svg


if __name__ == "__main__":
    main(Path(sys.argv[1]))
