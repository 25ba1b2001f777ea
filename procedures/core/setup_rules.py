"""The instruments that may be connected to the motor together: by their stated ratings, otherwise by their roles."""

from collections.abc import Collection, Mapping
from typing import cast

from drivers.interfaces import Instrument, InsulationTester, Oscilloscope, ProbeKind, Role, Supply, Voltmeter
from drivers.interfaces.role import ROLES
from drivers.interfaces.text import text
from procedures.core.procedure_error import ProcedureError
from procedures.core.setup import BenchSetup


class SetupRules:
    """Rules of a station with these instruments, while a procedure works with the roles `in_use` (None: with any)."""

    def __init__(
        self, instruments: Mapping[Role, Instrument], in_use: Collection[Role] | None, motor_voltage: float | None
    ) -> None:
        self._instruments = instruments
        self._in_use = in_use
        self._motor_voltage = motor_voltage

    def may_stay(self, role: Role, source: Role | None) -> bool:
        """Tell whether an unmentioned instrument may stay connected beside a source, or (None) at open terminals at rest."""
        if self._in_use is not None and role not in self._in_use:
            return False
        if source is None:
            return ROLES[role].withstands > 0.0
        voltage = self._voltage(source)
        if ROLES[source].alone or voltage is None or (ROLES[role].direct_only and source is not Role.SUPPLY):
            return False
        stated = self._stated(role)
        return (ROLES[role].withstands if stated is None else stated) >= voltage

    def check(self, setup: BenchSetup) -> None:
        """Raise ProcedureError for a forbidden setup: two sources, an instrument beside one that must be alone, too low a rating."""
        sources = sorted({contact.role for contact in setup.contacts if contact.is_socket}, key=lambda role: role.value)
        beside = sorted(setup.roles - set(sources), key=lambda role: role.value)
        if len(sources) > 1:
            raise ProcedureError(
                text(
                    "{roles} would be on the motor together; connect one after the other",
                    roles=[role.value for role in sources],
                )
            )
        source = sources[0] if sources else Role.DYNAMOMETER if setup.coupled else None
        if source is None:
            return
        if ROLES[source].alone and beside:
            raise ProcedureError(
                text(
                    "{role} would be on the motor beside {source}, which is to be alone there",
                    role=beside[0].value,
                    source=source.value,
                )
            )
        voltage = self._voltage(source)
        for role in beside:
            stated = self._stated(role)
            if voltage is not None and stated is not None and stated < voltage:
                raise ProcedureError(
                    text(
                        "{role} withstands {stated:g} V, and {source} brings up to {voltage:g} V; use an instrument or a probe that is "
                        "made for it",
                        role=role.value,
                        stated=stated,
                        source=source.value,
                        voltage=voltage,
                    )
                )

    def _voltage(self, source: Role) -> float | None:
        """Return the largest voltage (V) that a source brings to the terminals, None where nobody knows."""
        instrument = self._instruments.get(source)
        if instrument is not None and source in (Role.SUPPLY, Role.INSULATION_TESTER):
            return cast("Supply | InsulationTester", instrument).maximum_voltage
        return self._motor_voltage

    def _stated(self, role: Role) -> float | None:
        """Return the least voltage (V) that an instrument states for its leads, None where it states none for one of them."""
        instrument = self._instruments.get(role)
        if instrument is not None and role is Role.VOLTMETER:
            return cast("Voltmeter", instrument).maximum_voltage
        if instrument is not None and role is Role.OSCILLOSCOPE:
            scope = cast("Oscilloscope", instrument)
            stated = [scope.maximum_voltage(channel) for channel in scope.channels(ProbeKind.VOLTAGE)]
            return None if None in stated else min((each for each in stated if each is not None), default=None)
        return None
