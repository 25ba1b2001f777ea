"""Keysight 34970A, 34972A and 34980A as a switch matrix (34970A/34972A Command Reference, ROUTe subsystem)."""

from collections.abc import Collection, Iterable

from drivers.bases.crosspoints import conflict
from drivers.bases.scpi_driver import ScpiDriver
from drivers.interfaces import (
    Clock,
    CrosspointError,
    IdentityError,
    ReportedError,
    SwitchMatrix,
)
from drivers.interfaces.found_state import FoundSetting
from drivers.interfaces.text import Text, text
from drivers.keysight.options import SWITCH_UNIT_IDENTITY, Keysight34970AOptions
from drivers.transport.visa.opening import identify
from drivers.transport.visa.session import WAY_DOWN_TIME, ScpiSession

#: Its channels are `snnn` and its slots called 1 … 8; those of the other two are `snn` and 100, 200, 300.
_LARGE = "34980A"


class Keysight34970A(ScpiDriver, SwitchMatrix):
    """A 34970A, 34972A or 34980A; unit and modules are identified when this is made, the latter not for `guarding`.

    Raises IdentityError where another instrument answers or a slot that the station uses is empty.
    """

    def __init__(
        self,
        session: ScpiSession,
        clock: Clock,
        options: Keysight34970AOptions,
        *,
        name: str = "switch_matrix",
        guarding: bool = False,
    ) -> None:
        super().__init__(session, clock, name)
        self._options = options
        self._channels = dict(options.crosspoints)
        self._names = {channel: crosspoint for crosspoint, channel in self._channels.items()}
        self._all = sorted(self._names)
        self._read_back = f"ROUT:CLOS? {_listed(self._all)}"
        #: The channels that are closed; None where nobody can tell.
        self._held: frozenset[int] | None = None
        self._identity = identify(session, SWITCH_UNIT_IDENTITY, options.serial_number)
        self._left: frozenset[int] | None = None
        if guarding:
            return
        for slot in self._slots():
            self._check_module(slot)
        session.check_left_errors()
        self._left = self._closed()

    @property
    def found_state(self) -> tuple[FoundSetting, ...]:
        """Crosspoints of the station that were found closed; they open before any crosspoint closes."""
        if self._left is None:
            return ()
        names = sorted(self._names[channel] for channel in self._left)
        effect = text(
            "crosspoints left closed make connections that the next wiring does not have; all open before any closes"
        )
        return (FoundSetting("ROUT:CLOS?", ", ".join(names) or "-", "", effect),)

    @property
    def crosspoints(self) -> frozenset[str]:
        """Names of the crosspoints that the station file gives a channel."""
        return frozenset(self._channels)

    @property
    def fixed(self) -> frozenset[str]:
        """Names of permanent connections."""
        return frozenset(self._options.fixed)

    def connect(self, crosspoints: Collection[str]) -> None:
        """Close exactly these crosspoints; what else is closed opens first, and all are read back.

        Returns once the contacts have settled. Raises CrosspointError, before anything is switched, for crosspoints that
        there are not or that may not be closed together, and ReportedError, with all of them opened, where one did not follow.
        """
        wanted = frozenset(crosspoints)
        unknown = sorted(wanted - self.crosspoints)
        if unknown:
            raise CrosspointError(
                self._name,
                text("there is no crosspoint {unknown}", unknown=unknown),
                remedy=text("Give it a channel in the station file's crosspoints"),
            )
        reason = conflict(wanted)
        if reason is not None:
            raise CrosspointError(self._name, reason)
        self._bring(frozenset(self._channels[name] for name in wanted))

    def closed(self) -> frozenset[str]:
        """Return the crosspoints that are closed now by the unit's own account."""
        return frozenset(self._names[channel] for channel in self._closed())

    def make_safe(self) -> None:
        """Open all crosspoints and make sure of it, over a renewed connection where the present one fails.

        Raises ReportedError naming those that stay closed.
        """
        with self._session.within(WAY_DOWN_TIME):
            self._session.insist(self._open_all)

    def _bring(self, wanted: frozenset[int]) -> None:
        held, self._held = self._held, None
        # What is refused shows in what is read back: one look at the error queue for the whole change.
        if held is None:
            # Channels that the station does not name may be closed as well.
            self._switch("SYST:CPON ALL")
            held = frozenset()
        if held - wanted:
            self._switch("ROUT:OPEN", held - wanted)
        if wanted - held:
            self._switch("ROUT:CLOS", wanted - held)
        found = self._closed()
        if found == wanted:
            self._held = found
            return
        fault = self._not_followed(found, wanted)
        try:
            self._session.check_errors(fault.command)
        except ReportedError as reported:
            fault.add_note(str(reported))
        try:
            self._open_all()
        except ReportedError as stuck:
            fault.add_note(str(stuck))
        raise fault

    def _open_all(self) -> None:
        self._held = None
        if self._all:
            self._switch("ROUT:OPEN", self._all)
        found = self._closed()
        if found:
            raise self._not_followed(found, frozenset())
        self._held = found

    def _switch(self, command: str, channels: Collection[int] = ()) -> None:
        self._session.send(f"{command} {_listed(sorted(channels))}" if channels else command)
        self._clock.sleep(self._options.settling)

    def _closed(self) -> frozenset[int]:
        if not self._all:
            return frozenset()
        states = self._session.query_numbers(self._read_back, len(self._all))
        return frozenset(channel for channel, state in zip(self._all, states, strict=True) if state)

    def _not_followed(self, found: frozenset[int], wanted: frozenset[int]) -> ReportedError:
        findings = [
            text("{name} (channel {channel}) stays closed", name=self._names[channel], channel=channel)
            if channel in found
            else text("{name} (channel {channel}) does not close", name=self._names[channel], channel=channel)
            for channel in sorted(found ^ wanted)
        ]
        return ReportedError(
            self._name,
            Text("{findings}", {"findings": findings}),
            command=self._read_back,
            remedy=text("Check the module in that slot, its relays and the channels in the station file"),
        )

    def _slots(self) -> list[int]:
        """Return the slots used, as the unit's own commands name them."""
        large = self._identity.model.upper().startswith(_LARGE)
        for channel in self._all:
            if (channel >= 1000) is not large:
                raise IdentityError(
                    self._name,
                    text(
                        "{model} has channels of {digits} digits, not {channel} ({name})",
                        model=self._identity.model,
                        digits=4 if large else 3,
                        channel=channel,
                        name=self._names[channel],
                    ),
                    remedy=text("Correct the channels in the station file"),
                )
        return sorted({channel // 1000 if large else channel // 100 * 100 for channel in self._all})

    def _check_module(self, slot: int) -> None:
        reply = self._session.query(f"SYST:CTYP? {slot}")
        model = reply.partition(",")[2].partition(",")[0].strip()
        if model in ("", "0"):
            channels = ", ".join(str(channel) for channel in self._all if str(channel)[0] == str(slot)[0])
            raise IdentityError(
                self._name,
                text("slot {slot} is empty ('{reply}')", slot=slot, reply=reply),
                command=f"SYST:CTYP? {slot}",
                remedy=text(
                    "Correct the channels {channels} in the station file, or fit the module", channels=channels
                ),
            )


def _listed(channels: Iterable[int]) -> str:
    return f"(@{','.join(map(str, channels))})"
