"""Order of the phases: does forward rotation give A before B before C?"""

from typing import ClassVar

from GTC import ureal

from drivers.interfaces import ProbeKind
from drivers.interfaces.text import text
from procedures.core.actions import ALL_OPEN, CoupleDynamometer, ReleaseRotor, Terminal, phases_on
from procedures.core.bench import ProcedureError, Role
from procedures.core.demand import Demand, Demands
from procedures.core.procedure import Procedure
from procedures.core.steps import step
from procedures.estimation.emf.probed_phases import phase_order
from procedures.estimation.fitting.fit import EstimationError
from procedures.techniques.shaft.driven_shaft import DrivenRecord, record_driven
from procedures.verification.messages import wire
from procedures.verification.settings import TurnedWiringSettings


class PhaseOrderSettings(TurnedWiringSettings):
    """Settings of the order of the phases: those of the slow turn that shows it."""


class PhaseOrder(Procedure[PhaseOrderSettings]):
    """Order of the phases, +1 for A, B, C with the dynamometer turning forwards, −1 for A, C, B.

    The order of the letters against the direction of rotation is that of IEC 60034-8; forwards is the dynamometer's.
    """

    name: ClassVar[str] = "phase-order"
    title: ClassVar[str] = "Order of the phases"
    section: ClassVar[str] = "L2"
    roles: ClassVar[frozenset[Role]] = frozenset({Role.DYNAMOMETER, Role.OSCILLOSCOPE})
    gives: ClassVar[tuple[str, ...]] = ("phase_order",)
    needs: ClassVar[Demands] = {
        Role.DYNAMOMETER: Demand(automatic=True),
        Role.OSCILLOSCOPE: Demand(automatic=True, probes={ProbeKind.VOLTAGE: 3}),
    }
    end_of_line: ClassVar[bool] = True

    def measure(self) -> None:
        """Turn, look, judge."""
        self.prepare()
        self.conclude(self.turn())

    @step("L2/1", "Open the terminals, couple the drive motor", by_hand=True)
    def prepare(self) -> None:
        """Leave nothing on the terminals but probes."""
        self.bench.perform(ALL_OPEN, ReleaseRotor(), CoupleDynamometer())

    @step(
        "L2/2",
        "Probe three phases against an artificial star point, and turn the shaft slowly forwards",
        by_hand=True,
    )
    def turn(self) -> DrivenRecord:
        """Return the three phases' voltages while the shaft turns forwards; raises ProcedureError where no record is to be had."""
        bench = self.bench
        channels = list(bench.oscilloscope.channels(ProbeKind.VOLTAGE))[:3]
        if len(channels) < 3:
            raise ProcedureError(
                text("the order of three phases needs three voltage probes, the station has {n}", n=len(channels))
            )
        if bench.dynamometer.read_by_hand or bench.oscilloscope.read_by_hand:
            raise ProcedureError(
                text("the order of the phases needs a dynamometer and an oscilloscope that are read automatically")
            )
        self.wiring.shaft.connect_probes(phases_on(channels), report_order=False)
        return record_driven(
            bench, self.nameplate, channels, self.settings.wiring_speed_share, self.known_value("pole_pairs")
        )

    @step("L2/3", "The order of the phases: +1 for A, B, C, −1 for A, C, B")
    def conclude(self, record: DrivenRecord) -> None:
        """Report it; raises ProcedureError where three phases cannot be recognised."""
        try:
            order = phase_order(record.voltages, record.resolution)
        except EstimationError as error:
            raise ProcedureError(
                text(
                    "the order of the phases cannot be determined: the three channels show too little voltage, or not three "
                    "phases of one size; check the probes and the star point, or turn the shaft faster (wiring_speed_share)"
                )
            ) from error
        if order < 0:
            self.notice(
                "phase-order",
                text(
                    "with the dynamometer turning forwards the phases follow each other as A, C, B: two of the three wires {wires} are "
                    "interchanged. Exchanging any two corrects the order; it does not show which two were interchanged",
                    wires=[wire(terminal.value, self.nameplate.wire_colours) for terminal in Terminal],
                ),
            )
        self.report(
            "phase_order",
            ureal(float(order), 0.0),
            section=self.section,
            estimator="order of the phases' voltages in time",
        )
