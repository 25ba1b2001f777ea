"""The run in which a person uses the station's instruments one command at a time."""

from collections.abc import Collection
from math import isfinite
from typing import ClassVar

from pydantic import Field

from bench.by_hand.command_loop import CommandLoop
from bench.by_hand.commands import commands_of
from bench.by_hand.outputs import Outputs
from drivers.interfaces import InstrumentError, Role
from drivers.interfaces.text import text
from procedures.core.bench import ProcedureError
from procedures.core.procedure import Procedure
from procedures.core.settings import Settings
from procedures.core.steps import step


class ByHandSettings(Settings):
    """Settings of the instruments by hand."""

    roles: tuple[Role, ...] = Field(
        default=(), description="instruments that can be commanded, by role; all of the station when not given"
    )
    idle_time: float = Field(
        default=600.0, gt=0.0, le=86_400.0, description="time without a command after which everything goes off, s"
    )


class ByHand(Procedure[ByHandSettings]):
    """Every instrument of the station under a person's commands: within the limits, in the journal, off at the end."""

    name: ClassVar[str] = "by-hand"
    title: ClassVar[str] = "Instruments by hand"
    section: ClassVar[str] = "S3"
    roles: ClassVar[frozenset[Role]] = frozenset()
    manual: ClassVar[bool] = True

    @classmethod
    def roles_at(cls, settings: ByHandSettings, station: Collection[Role]) -> frozenset[Role]:
        """Return the roles that are chosen, all of the station where none is. Relays make connections, which hands make here."""
        return frozenset(settings.roles or station) - {Role.SWITCH_MATRIX}

    def measure(self) -> None:
        """Open what there is, do what is said, and leave nothing on."""
        present, ranges = self.open()
        with Outputs(lambda role: self.bench.instrument(role).make_safe()) as outputs:
            self.command(CommandLoop(self.bench, present, ranges, outputs, self.settings.idle_time))

    @step("S3/1", "Open the station's instruments")
    def open(self) -> tuple[tuple[Role, ...], dict[str, float]]:
        """Return the roles whose instruments answer, and the largest values that their commands take by role, method and argument.

        Raises ProcedureError where none answers.
        """
        chosen = self.roles_at(self.settings, [role for role in Role if self.bench.has(role)])
        present, ranges = [], dict[str, float]()
        for role in (role for role in Role if role in chosen):
            try:
                instrument = self.bench.instrument(role)
                # Asking who it is opens it.
                found = instrument.identity
                ranges |= {
                    key: most for each in commands_of(role).values() for key, most in each.ranges(instrument).items()
                }
            except InstrumentError as error:
                self.notice("not-there", text("left out: {error}", error=error))
                continue
            present.append(role)
            self.findings.setdefault("instruments", {})[role.value] = f"{found.manufacturer} {found.model}".strip()
        if not present:
            raise ProcedureError(text("no instrument of the station answers; motorbench station check says why"))
        return tuple(present), {key: most for key, most in ranges.items() if isfinite(most)}

    @step(
        "S3/2",
        "Carry out what is commanded, until finish; after {idle_time:g} s without a command everything goes off",
        by_hand=True,
    )
    def command(self, commanding: CommandLoop) -> None:
        """Do what is typed, and keep what was read."""
        try:
            commanding.until_finished()
        finally:
            self.findings["read"] = commanding.read
            if commanding.refused:
                self.notice(
                    "refused-commands",
                    text(
                        "these commands were refused and did nothing: {commands}. What was said of each is in the run's journal",
                        commands=commanding.refused,
                    ),
                )
