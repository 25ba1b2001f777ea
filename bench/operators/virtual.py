"""Virtual hands on the virtual bench: not quite steady, and reading a dial to one degree."""

import math
from collections.abc import Callable
from typing import assert_never

import numpy as np

from bench.i18n.simulated import simulation_error
from bench.operators.hands_on import HandsOn
from bench.operators.virtual_leads import VirtualLeads
from drivers.interfaces.text import text
from procedures.core.actions import (
    FINISH,
    ChangeSetup,
    DoByHand,
    DoubtReading,
    EnterCommand,
    EnterReading,
    HandWork,
    MarkRestPositions,
    Mend,
    StartTurning,
    StopTurning,
    TurnToRest,
)
from procedures.core.bench import ProcedureError
from procedures.core.setup import LeadContact
from procedures.core.setup_change import Change, ChangeKind
from procedures.verification.stated_probes import KEY as PROBE_LIMIT

#: What the hands need (s), as a practised person does: to take one lead off, to put one on, for the shaft's lock and coupling, to read.
_OFF, _ON, _LOCK, _COUPLING, _READING = 2.0, 5.0, 3.0, 30.0, 5.0
#: A dial is read to this (rad, all errors within it equally likely).
_DIAL = math.radians(1.0)
#: The speed of a hand that tries to turn evenly varies by about this share.
_WOBBLE = 0.1
#: A shaft slower than this (rad/s) may be stopped by hand.
_SLOW = 5.0
#: And slower than this it stands for whoever looks.
_STANDING = 0.05
_SETTLE = 0.5
#: How fast (rad/s) and how long (s) a released shaft is turned to feel whether it is free.
_FEELING_SPEED, _FEELING = 0.3, 0.05
#: A shaft stands for the eye that sees it move less than this (rad) in this time (s); it looks at most this often.
_STILL, _LOOK, _PATIENCE = 5.0e-4, 0.25, 400
#: What a thermometer on the winding is off at most (K).
_THERMOMETER = 0.5
_MOST_MARKS = 500
#: A shaft that has not got this far (rad) is still at the same position; the hand tries again this often.
_SAME, _TRIES = math.radians(3.0), 3


class VirtualOperator:
    """Performs actions on a virtual bench; the unsteadiness of hand and eye follows from `seed`.

    `hand_time` counts the bench time (s) that hand work took.
    """

    def __init__(self, world: HandsOn, seed: int = 0) -> None:
        self._world = world
        self._random = np.random.default_rng([seed, 0x0BE4A7])
        # One thermometer, and so one error of all that it says.
        self._thermometer_error = float(self._random.uniform(-_THERMOMETER, _THERMOMETER))
        self.hand_time = 0.0
        # When turning began (s), at which angle (rad), how fast (rad/s).
        self._turning: tuple[float, float, float] | None = None
        self._leads = VirtualLeads(world)

    def thermometer(self) -> float:
        """Return the winding's temperature (°C) as this operator's thermometer shows it."""
        truth = self._world.truth()
        winding, hidden = truth["winding_temperature"], 1.0 - self._hands("thermometer_share", 1.0)
        return float(winding - hidden * (winding - truth["ambient_temperature"]) + self._thermometer_error)

    def _hands(self, name: str, usual: float) -> float:
        """Return what disturbs these hands; a bench that says nothing of it has usual ones."""
        return float(self._world.truth().get("hands", {}).get(name, usual))

    def perform(self, action: HandWork) -> object:
        """Do it; raises ProcedureError if it is not possible on the bench."""
        start = self._world.clock.now()
        try:
            return self._do(action)
        except (RuntimeError, ValueError) as finding:
            raise ProcedureError(
                text("the virtual operator cannot do it: {finding}", finding=simulation_error(finding))
            ) from finding
        finally:
            self.hand_time += self._world.clock.now() - start

    def wait(self, seconds: float) -> None:
        """Run the bench for a time (s)."""
        self._take(seconds)

    def _do(self, action: HandWork) -> object:
        world = self._world
        match action:
            case ChangeSetup():
                for change in action.changes:
                    self._change(change)
                self._leads.wire(action)
            case TurnToRest():
                self._next_rest()
            case MarkRestPositions():
                return self._mark(action.turns)
            case StartTurning():
                self._turning = (world.clock.now(), world.dial_angle(), action.speed)
                world.turn_shaft(action.speed, _WOBBLE)
            case StopTurning():
                world.hold_shaft()
                self._take(_SETTLE)
                world.let_go()
                self._feel()
            case EnterReading():
                return self._read(action)
            case EnterCommand():
                # There is nothing that these hands would want to know.
                return FINISH
            case DoByHand():
                self._take(_SETTLE)
            case Mend():
                # These hands did as they were told; what is wrong all the same is for a person to find.
                return False
            case DoubtReading():
                # Nobody can tell; what was read stays, and the result says that it contradicts the rest.
                return False
            case _:
                assert_never(action)
        return None

    def _move_a_little(self) -> None:
        """Feel that the shaft is free, forth and back; the world says where it is not."""
        for speed in (_FEELING_SPEED, -_FEELING_SPEED):
            self._world.turn_shaft(speed)
            self._take(_FEELING)
        self._world.hold_shaft()
        self._world.let_go()

    def _feel(self) -> None:
        """Raise RuntimeError where the shaft has not turned as the hand would have it."""
        if self._turning is None:
            return
        began, angle, speed = self._turning
        self._turning = None
        expected = abs(speed) * (self._world.clock.now() - began - _SETTLE)
        turned = abs(self._world.dial_angle() - angle)
        if turned < 0.5 * expected:
            turns = f"{turned / (2.0 * math.pi):.2g}"
            raise RuntimeError(text("the shaft got stuck after {turns} turns", turns=turns))

    def _wait_for_rest(self) -> None:
        """Look until a rotor that rings about its position stands; nobody locks a swinging shaft."""
        # Two looks in a row: at its turning points a swinging shaft stands as well.
        before, quiet = self._world.dial_angle(), 0
        for _ in range(_PATIENCE):
            self._take(_LOOK)
            here = self._world.dial_angle()
            quiet = quiet + 1 if abs(here - before) < _STILL else 0
            if quiet == 2:
                return
            before = here

    def _typed(self, value: float) -> float:
        """Return a value as a person types it, whose decimal point slips now and then."""
        slips = self._hands("slips", 0.0)
        if not slips or self._random.uniform() >= slips:
            return value
        return value * float(self._random.choice([0.1, 10.0]))

    def _take(self, seconds: float) -> None:
        self._world.clock.sleep(seconds)

    def _change(self, change: Change) -> None:
        world = self._world
        match change.kind:
            case ChangeKind.STAND_STILL:
                self._wait_for_slow(_STANDING)
                self._wait_for_rest()
            case ChangeKind.CLEAR:
                self._take(_OFF)
                self._leads.clear()
            case ChangeKind.TAKE_OFF:
                self._take(_OFF)
                self._leads.take_off(LeadContact(change.lead, change.place))
            case ChangeKind.MOVE | ChangeKind.PUT_ON:
                self._take(_ON)
                self._leads.put_on(LeadContact(change.lead, change.place), LeadContact(change.lead, change.origin))
            case ChangeKind.CLIP_TOGETHER | ChangeKind.TAKE_APART:
                self._take(_ON)
                world.short_leads(change.kind is ChangeKind.CLIP_TOGETHER)
            case ChangeKind.LOCK:
                self._take(_LOCK)
                self._wait_for_rest()
                world.lock_rotor()
            case ChangeKind.FREE:
                self._take(_LOCK)
                world.release_rotor()
                self._move_a_little()
            case ChangeKind.COUPLE:
                self._at_rest(world.couple_dynamometer)
            case ChangeKind.UNCOUPLE:
                self._at_rest(world.uncouple_dynamometer)
            case _:
                assert_never(change.kind)

    def _next_rest(self) -> float:
        self._take(self._world.nudge_to_next_rest() + _SETTLE)
        self._wait_for_rest()
        return self._world.dial_angle()

    def _mark(self, turns: int) -> list[float]:
        start = here = self._world.dial_angle()
        marks = [start + self._dial_error()]
        while len(marks) < _MOST_MARKS:
            before = here
            for _ in range(_TRIES):
                here = self._next_rest()
                if here - before > _SAME:
                    break
            else:
                break
            self._take(_READING)
            marks.append(here + self._dial_error())
            # The mark made first has come round again: the turn is complete.
            if here - start > 2.0 * math.pi * turns - 0.5 * (here - before):
                break
        return marks

    def _dial_error(self) -> float:
        return float(self._random.uniform(-_DIAL, _DIAL))

    def _wait_for_slow(self, speed: float) -> None:
        """Look until the shaft is slower than this (rad/s)."""
        for _ in range(600):
            if abs(self._world.truth()["shaft_speed"]) < speed:
                break
            self._take(1.0)

    def _at_rest(self, work: Callable[[], None]) -> None:
        world = self._world
        self._wait_for_slow(_SLOW)
        locked = world.truth()["rotor_locked"]
        if not locked:
            world.hold_shaft()
        self._take(_COUPLING)
        work()
        if not locked:
            world.let_go()

    def _read(self, action: EnterReading) -> float:
        self._take(_READING)
        if action.key == "winding_temperature":
            return self._typed(self.thermometer())
        if action.key == PROBE_LIMIT:
            # What is off on a virtual bench is its oscilloscope; its probes are not.
            return 0.0
        raise ProcedureError(
            text(
                "the virtual operator has no value for {key}; put it into the motor file's [nameplate]",
                key=action.key,
            )
        )
