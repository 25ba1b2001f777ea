"""Base of all procedures: settings, steps, and the way a result is put together."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType
from typing import Any, ClassVar, Generic, Literal, TypeVar, get_args

from GTC.lib import UncertainReal

from drivers.interfaces.text import Text, text
from procedures.core.bench import Bench, ProcedureError, Role
from procedures.core.demand import Demands
from procedures.core.earlier_call import EarlierAttempt
from procedures.core.events import WarningGiven
from procedures.core.figure_check import possible, unusual
from procedures.core.misfit_text import misfit_row, sentence
from procedures.core.nameplate import Nameplate, WindingConnection
from procedures.core.parameter_definition import ParameterDefinition, ParameterTable
from procedures.core.parameters import PARAMETERS
from procedures.core.result import Notice, Parameter, ProcedureResult, Withheld
from procedures.core.safety_test import SafetyTest
from procedures.core.settings import Settings
from procedures.core.steps import Step, steps_of
from procedures.estimation.fitting.misfit import NO_MISFIT, Misfit
from procedures.verification.settings import wiring_settings
from procedures.verification.verified_channels import RANGE_WARNING
from procedures.verification.verifier import ConnectionVerifier
from procedures.verification.wiring import Wiring

__all__ = ["Procedure", "Settings"]


C = TypeVar("C", bound=Settings)


class Procedure(ABC, Generic[C]):
    """One measurement of the document.

    A subclass names itself (`name`, `title`, `section`), the roles it needs, its settings type as the generic
    argument, and defines its steps as decorated methods in the document's order. It `gives` parameters: names of the
    table's rows, or definitions of its own; `parameters` has them all by name. One that is `end_of_line` finds a defect
    rather than a controller's parameter, one that is `at_load` what becomes of the parameters at every current, one that is `manual` does
    what a person commands: they run where they are named, not with `all`.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    section: ClassVar[str]
    roles: ClassVar[frozenset[Role]]
    gives: ClassVar[tuple[str | ParameterDefinition, ...]] = ()
    #: What is needed of the instruments whatever the settings: a station that lacks it is refused before anything is connected.
    needs: ClassVar[Demands] = {}
    #: Whose readings in later procedures its result corrects: no order puts these before it.
    corrects: ClassVar[frozenset[Role]] = frozenset()
    #: What it proves of the motor's safety: no order puts it after one that feeds the motor or turns its shaft.
    safety_test: ClassVar[SafetyTest | None] = None
    parameters: ClassVar[ParameterTable]
    end_of_line: ClassVar[bool] = False
    at_load: ClassVar[bool] = False
    manual: ClassVar[bool] = False
    #: What earlier procedures of the run withheld and none gave, by name.
    withheld_before: Mapping[str, Sequence[Withheld]] = MappingProxyType({})
    #: Whether it can go on in a resumed run with what it had read before it was left, and what it did then, oldest first.
    goes_on: ClassVar[bool] = False
    earlier: Sequence[EarlierAttempt] = ()

    def __init_subclass__(cls) -> None:
        """Look up what the procedure gives. Raises TypeError for a parameter that nothing defines, or that is defined otherwise."""
        super().__init_subclass__()
        try:
            cls.parameters = PARAMETERS.resolved(cls.gives)
        except ValueError as error:
            raise TypeError(f"{cls.__name__}.gives: {error}") from None

    def __init__(self, bench: Bench, nameplate: Nameplate, settings: C, known: Mapping[str, Parameter]) -> None:
        self.bench = bench
        self.nameplate = nameplate
        self.settings = settings
        self.known = known
        self._parameters: list[Parameter] = []
        self._notices: list[Notice] = []
        self._withheld: list[Withheld] = []
        self.findings: dict[str, Any] = {}
        #: Has connections made, and proves them.
        self.wiring = Wiring(
            ConnectionVerifier(bench, nameplate, wiring_settings(settings), known, self.findings, self.notice)
        )

    @classmethod
    def settings_type(cls) -> type[Settings]:
        """Return the settings model, the generic argument of the class."""
        for base in getattr(cls, "__orig_bases__", ()):
            for argument in get_args(base):
                if isinstance(argument, type) and issubclass(argument, Settings):
                    return argument
        raise TypeError(f"{cls.__name__} names no settings type")

    @classmethod
    def in_all(cls) -> bool:
        """Tell whether it belongs to a whole measurement of a motor."""
        return not (cls.end_of_line or cls.at_load or cls.manual)

    @classmethod
    def roles_at(cls, settings: C, station: Collection[Role]) -> frozenset[Role]:
        """Return the roles that it may use at a station that has these."""
        return cls.roles

    @classmethod
    def needed(cls, settings: C) -> Demands:
        """Return what is needed of the instruments with these settings."""
        return cls.needs

    @classmethod
    def wanted_before(cls, settings: C, nameplate: Nameplate) -> Mapping[str, str]:
        """Return the parameters that an earlier procedure must give with these settings, each with the setting that can replace it."""
        return {}

    @classmethod
    def check_capability(cls, bench: Bench, nameplate: Nameplate, settings: C) -> Sequence[Notice]:
        """Return which requirements of the settings the station's instruments cannot meet, as far as this is known now.

        Called before anything is energised; instruments may be asked for their accuracy, not set or read.
        """
        return ()

    @classmethod
    def steps(cls) -> tuple[Step, ...]:
        """Return the steps in the document's order."""
        return steps_of(cls)

    @abstractmethod
    def measure(self) -> None:
        """Take the steps in order, adding parameters, findings and notices on the way."""

    def run(self) -> ProcedureResult:
        """Measure, and return what was found.

        Raises ProcedureError where something is still on at the end, where a figure is no number, and where there is none and no
        notice says why.
        """
        used = self.roles_at(self.settings, [role for role in Role if self.bench.has(role)])
        self.bench.state.begin(used, self.nameplate.voltage_bound)
        self.measure()
        self.bench.check_off()
        return self._result()

    def partial_result(self, why: Text) -> ProcedureResult | None:
        """Return the result of a procedure that ended early for the reason `why`, from the data taken until then; None without any.

        Everything is off by then, and no instrument answers any more.
        """
        self.bench = self.bench.without_instruments()
        self._parameters, self._notices, self._withheld = [], [], []
        return self._result() if self.conclude_early(why) else None

    def conclude_early(self, why: Text) -> bool:
        """Report results from the data taken before the procedure ended early; return whether there are any (none by default)."""
        return False

    def _result(self) -> ProcedureResult:
        kept, withheld = possible(self._parameters)
        withheld += self._withheld
        for each in unusual(kept):
            self.notice(each.identifier, each.message)
        for message in self.bench.state.verified_channels.resting_on_data_sheet(kept):
            self.notice(RANGE_WARNING, message)
        if self.parameters and not kept and not withheld and not self._notices:
            raise ProcedureError(
                text(
                    "it ended without a figure and without a reason, although it gives {names}: this is an error "
                    "of the procedure",
                    names=[*self.parameters],
                )
            )
        said, findings = tuple(self._notices), dict(self.findings)
        return ProcedureResult(self.name, self.section, tuple(kept), said, findings, tuple(withheld))

    def step_values(self) -> dict[str, object]:
        """Return the settings by name, for the steps' sentences."""
        return {**self.settings.model_dump(), "rated_current": self.nameplate.rated_current}

    @property
    def winding(self) -> Literal["wye", "delta"]:
        """Connection of the windings, by the estimators' names."""
        return "delta" if self.is_delta else "wye"

    @property
    def is_delta(self) -> bool:
        """True if the nameplate states a delta connection."""
        return self.nameplate.connection is WindingConnection.DELTA

    def by_winding(self, values: Sequence[float]) -> dict[str, float]:
        """Return three figures by the names of the windings: A, B, C of a wye, AB, BC, CA of a delta."""
        return dict(zip(("AB", "BC", "CA") if self.is_delta else ("A", "B", "C"), values, strict=True))

    def report(
        self,
        name: str,
        quantity: UncertainReal,
        *,
        section: str,
        estimator: str,
        note_value: float | None = None,
        winding: float | None = None,
        misfit: Misfit = NO_MISFIT,
    ) -> Parameter | None:
        """Add a parameter, in the unit and by the convention of its definition, with uncertainty and budget to the result.

        `misfit` is what the record shows beyond the model (see `Misfit.of`): it is told, and where it says so the parameter is withheld
        and None returned. Raises KeyError for one that the procedure does not give, TypeError for a plain number.
        """
        definition = self.parameters[name]
        self.tell_misfit(misfit)
        reason = misfit.withholding(name)
        if reason is not None:
            self._withheld.append(Withheld(name, self.name, section, reason.cause.value, sentence(reason), definition))
            return None
        parameter = self.bench.uncertainties.parameter(
            name,
            definition.unit,
            quantity,
            procedure=self.name,
            section=section,
            estimator=estimator,
            note_value=note_value,
            convention=definition.convention,
            winding=winding,
            definition=definition,
        )
        self._parameters.append(parameter)
        return parameter

    def tell_misfit(self, misfit: Misfit) -> None:
        """Add what a record shows beyond its model: a warning once a cause, and a row of the finding `misfit`."""
        rows = self.findings.setdefault("misfit", []) if misfit else []
        for finding in misfit.findings:
            row = misfit_row(finding)
            if row in rows:
                continue
            rows.append(row)
            told = Notice(finding.cause.value, sentence(finding))
            if told not in self._notices:
                self.notice(told.identifier, told.message)

    def enter(self, name: str, value: float, *, section: str) -> None:
        """Add a parameter that was not measured but taken from a data sheet.

        Raises KeyError for one that the procedure does not give.
        """
        definition = self.parameters[name]
        self._parameters.append(
            Parameter(
                name=name,
                value=value,
                unit=definition.unit,
                standard_uncertainty=0.0,
                degrees_of_freedom=float("inf"),
                coverage_interval=(value, value),
                procedure=self.name,
                section=section,
                estimator="as printed on the data sheet",
                convention=definition.convention,
                source="data sheet",
                definition=definition,
            )
        )

    def notice(self, identifier: str, message: Text, replaced: Text | None = None) -> None:
        """Add a warning: an erratum's id (`E1` …) or a short name of the finding, and the sentence for people.

        One that was added before is `replaced` by it.
        """
        self._notices = [told for told in self._notices if replaced is None or told.message is not replaced]
        self._notices.append(Notice(identifier, message))
        self.bench.recorder.record(WarningGiven(id=identifier, message=message.render()))

    def known_value(self, name: str) -> float | None:
        """Return an earlier result's value, or None where it was not measured."""
        parameter = self.known.get(name)
        return parameter.value if parameter else None

    def why_unknown(self, name: str, needed: Text) -> Text:
        """Return the message for a missing earlier result: `needed`, and the reason if it was withheld."""
        reasons = self.withheld_before.get(name, ())
        return text("{needed}; {withheld}", needed=needed, withheld=reasons[0].sentence) if reasons else needed

    def aligning_current(self, share: float) -> float:
        """Return the current (A) that aligns the rotor: a share of the rated one, as far as motor and supply allow."""
        return min(
            share * self.nameplate.rated_current, self.nameplate.current_bound, self.bench.supply.maximum_current
        )

    def current_level(self, setting: str, what: Text, most: float = 1.0, *, share: float | None = None) -> float:
        """Return a current (A): the share of the rated one that a setting asks for, kept within the motor's limit and the supply's.

        A default that is more than the share `most` of what the supply gives is lowered to it and told; what was set otherwise is
        refused where the supply cannot give it. `share` is one of a setting's several.
        """
        own = getattr(self.settings, setting) if share is None else share
        asked = share is not None or own != type(self.settings).model_fields[setting].default
        wanted, limit = own * self.nameplate.rated_current, self.bench.supply.maximum_current
        given = limit if asked else most * limit
        # A share that was made from one of the bounds may lie above it by its last digit.
        for bound in (self.nameplate.current_bound, given):
            if bound < wanted <= bound * (1.0 + 1e-9):
                wanted = bound
        if wanted > self.nameplate.current_bound:
            raise ProcedureError(
                text(
                    "{what}: {wanted:.3g} A is above the motor's largest current {bound:.3g} A; lower the setting",
                    what=what,
                    wanted=wanted,
                    bound=self.nameplate.current_bound,
                )
            )
        if wanted <= given:
            return wanted
        if asked:
            raise ProcedureError(
                text(
                    "{what}: the supply cannot give {wanted:.3g} A, its limit is {bound:.3g} A; "
                    "lower the setting {setting} or use a larger supply",
                    what=what,
                    wanted=wanted,
                    bound=limit,
                    setting=setting,
                )
            )
        self._tell_lowered(what, wanted, given)
        return given

    def _tell_lowered(self, what: Text, wanted: float, lowered: float) -> None:
        told = self.findings.setdefault("lowered_currents", {})
        if str(what) in told:
            return
        told[str(what)] = lowered
        self.notice(
            "small-supply",
            text(
                "{what}: {lowered:.3g} A, {share:.1%} of the rated current, instead of {wanted:.3g} A, because the supply gives "
                "{limit:.3g} A at most",
                what=what,
                lowered=lowered,
                share=lowered / self.nameplate.rated_current,
                wanted=wanted,
                limit=self.bench.supply.maximum_current,
            ),
        )
