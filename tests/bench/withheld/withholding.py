"""Procedures that withhold figures, as plug-ins."""

PROCEDURE = """
from typing import ClassVar
import numpy as np
from procedures.core.bench import Role
from procedures.core.curves import curve
from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.procedure import Procedure, Settings
from procedures.core.steps import step
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from drivers.interfaces.text import text

OWN = ParameterDefinition("frame_capacitance", "C_f", "F", text("Capacitance to the frame"), reader_unit="s/Ω")


class Named(Procedure[Settings]):
    name: ClassVar[str] = "{name}"
    title: ClassVar[str] = "A fit"
    section: ClassVar[str] = "9.8"
    roles: ClassVar[frozenset[Role]] = frozenset()
    gives: ClassVar[tuple[str | ParameterDefinition, ...]] = ("stator_resistance", "inertia", OWN)

    def measure(self) -> None:
        self.compare()

    @step("9.8/1", "Fit it")
    def compare(self) -> None:
        time = np.linspace(0.0, 1.0, 50)
        self.findings["fit"] = dict(unit="A", **curve(time=time, fitted=np.exp(-time), residual=0.1 * np.sin(time)))
        quantity = self.bench.uncertainties.statistical("comparison", 1.01, 0.01)
        for name, answer in {answers}.items():
            found = Misfit((Finding(Cause.UNEXPLAINED, Answer(answer), (name,), 12.0),)) if answer else Misfit()
            self.report(name, quantity, section="9.8", estimator="comparison", misfit=found)
"""
NEEDING = """
from typing import ClassVar
from procedures.core.bench import ProcedureError, Role
from procedures.core.procedure import Procedure, Settings
from procedures.core.steps import step
from drivers.interfaces.text import Text


class Needing(Procedure[Settings]):
    name: ClassVar[str] = "needing"
    title: ClassVar[str] = "Who needs it"
    section: ClassVar[str] = "9.9"
    roles: ClassVar[frozenset[Role]] = frozenset()

    def measure(self) -> None:
        self.look()

    @step("9.9/1", "Look for it")
    def look(self) -> None:
        if "stator_resistance" not in self.known:
            raise ProcedureError(self.why_unknown("stator_resistance", Text("run it first")))
"""
WITHHELD = {"stator_resistance": "withheld", "frame_capacitance": "withheld", "inertia": "widened"}
GIVEN = {"stator_resistance": "", "frame_capacitance": "modelled"}
SAID = "none of the known causes"
