"""The signatures of a run: whose, what each means, and whether it still holds; and the form for one more."""

from collections.abc import Sequence
from datetime import UTC, datetime

from nicegui import ui

from bench.i18n.errors import InputError
from bench.journal.signatures import MEANINGS, Meaning, Signature, asked_of, sign, signatures
from bench.panel.live.live_run import LiveRun
from bench.panel.pages.parts import named
from bench.panel.pages.reader import Reader
from bench.panel.server.access import Access, TooManyTriesError
from bench.panel.server.sessions import Session
from drivers.interfaces.text import text


class SignOffPart:
    """The card of signatures; with accounts, `access` checks the password of who signs."""

    def __init__(self, run: LiveRun, session: Session, reader: Reader, access: Access | None) -> None:
        self._run = run
        self._session = session
        self._reader = reader
        self._access = access if session.logged_in else None

    def build(self) -> None:
        """Build it."""
        title = self._reader.say(text("Signatures"))
        self._card = named(ui.element("section").classes("mb-card mb-4").props("id=signatures tabindex=-1"), title)
        self._fill()

    def _fill(self) -> None:
        say = self._reader.say
        self._card.clear()
        with self._card:
            ui.label(say(text("Signatures"))).classes("text-lg font-semibold").props("role=heading aria-level=2")
            try:
                signed = signatures(self._run.folder)
            except InputError as error:
                ui.label(self._reader.fault(error)).classes("mb-refused")
                return
            self._list(signed)
            if self._session.may_change and self._run.view.ended:
                self._form()
            elif self._run.view.ended:
                ui.label(say(text("Only an engineer may sign."))).classes("text-base")

    def _list(self, signed: Sequence[Signature]) -> None:
        say = self._reader.say
        for signature in signed:
            when = datetime.fromisoformat(signature.time).strftime("%Y-%m-%d %H:%M:%S UTC")
            meaning = say(MEANINGS[signature.meaning]) if signature.meaning in MEANINGS else ""
            parts = [f"{signature.person} ({signature.role})", meaning, when, signature.words]
            parts.append(f"SHA-256 {signature.sha256[:12]}…")
            ui.label(" · ".join(part for part in parts if part)).classes("text-base")
            if not signature.holds:
                words = text("This signature is not valid: the run was continued, or changed, after it.")
                ui.label(say(words)).classes("mb-refused")
        asked = asked_of(self._run.view.run.start)
        people = {signature.person for signature in signed if signature.holds}
        if len(people) < asked:
            words = text(
                "{count} of {asked} signatures that this station asks for; each by another person",
                count=len(people),
                asked=asked,
            )
            ui.label(say(words)).classes("text-base mb-refused")

    def _form(self) -> None:
        say = self._reader.say
        with ui.row().classes("items-end gap-3 mt-2"):
            meanings = {name: say(words) for name, words in MEANINGS.items()}
            meaning = ui.select(meanings, value=Meaning.MEASURED.value, label=say(text("I sign that")))
            meaning.props("outlined dense").classes("w-72")
            name = ui.input(say(text("Name")), value=self._session.person).props("outlined dense")
            password = ui.input(say(text("Password"))).props("outlined dense type=password")
            # An account signs by itself: nobody signs in another's name.
            name.set_enabled(self._access is None)
            password.set_visibility(self._access is not None)
            remark = ui.input(say(text("Remark"))).props("outlined dense").classes("w-72")

            async def signed() -> None:
                person = self._session.person if self._access is not None else str(name.value or "")
                await self._sign(person, str(password.value or ""), str(meaning.value), str(remark.value or ""))

            ui.button(say(text("Sign off")), on_click=signed).props("no-caps")
        self._fault = ui.label().props("role=alert").classes("mb-refused")

    async def _sign(self, person: str, password: str, meaning: str, words: str) -> None:
        say = self._reader.say
        try:
            if (
                self._access is not None
                and await self._access.check(person, password, ui.context.client.ip or "") is None
            ):
                self._fault.set_text(say(text("The password is wrong; nothing was signed.")))
                return
            role = self._session.right.value
            sign(self._run.folder, person, role, words, datetime.now(UTC), Meaning(meaning))
        except TooManyTriesError as error:
            self._fault.set_text(say(text("Too many tries; the next one in {wait} s.", wait=error.wait)))
            return
        except InputError as error:
            self._fault.set_text(self._reader.fault(error))
            return
        # The button that was pressed goes with the form.
        ui.run_javascript("document.getElementById('signatures').focus()")
        self._fill()
