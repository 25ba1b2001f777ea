"""Progress of a run: when it last did something, and what it is waiting for."""

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from time import monotonic

from bench.safety.interrupts import Interrupts
from bench.station.sharing import Sharing
from drivers.interfaces import Clock
from drivers.interfaces.text import Text
from drivers.manual.prompt import Option, Prompt
from procedures.core.actions import HandWork
from procedures.core.bench import Operator, Role


class ProgressStamps:
    """Time stamps of the progress of the run's own thread, which others read."""

    def __init__(self) -> None:
        self._last = monotonic()
        self._waiting = 0

    def stamp(self) -> None:
        """Say that the run has got on."""
        self._last = monotonic()

    @contextmanager
    def excused(self) -> Iterator[None]:
        """Within the block the run waits for something that ends by itself or for a person, and is not stuck."""
        self._waiting += 1
        try:
            yield
        finally:
            self._waiting -= 1
            self.stamp()

    def age(self) -> float:
        """Return for how long (s) the run has made no progress without a reason."""
        return 0.0 if self._waiting else max(0.0, monotonic() - self._last)


class Waits:
    """A run's clock for waiting: a stop request is checked first, and waiting does not count as being stuck.

    An `interruptible` wait is also ended by one, which the bench's clock must bear.
    """

    def __init__(self, interrupts: Interrupts, life: ProgressStamps, *, interruptible: bool) -> None:
        self._interrupts = interrupts
        self._life = life
        self._interruptible = interruptible

    @contextmanager
    def sleeping(self) -> Iterator[None]:
        """Wait for time to pass, or for an answer from another process."""
        with self._interrupts.waiting(interruptible=self._interruptible), self._life.excused():
            yield

    @contextmanager
    def asking(self) -> Iterator[None]:
        """Wait for somebody who looks at requests to stop himself."""
        with self._interrupts.waiting(interruptible=False), self._life.excused():
            yield


class WatchedClock:
    """A clock whose sleepers are no dead ones."""

    def __init__(self, clock: Clock, waits: Waits) -> None:
        self._clock = clock
        self._waits = waits

    def now(self) -> float:
        """Return the bench time (s)."""
        return self._clock.now()

    def sleep(self, seconds: float) -> None:
        """Wait for bench time (s)."""
        with self._waits.sleeping():
            self._clock.sleep(seconds)


class WatchedOperator:
    """An operator who may take as long as it takes."""

    def __init__(self, operator: Operator, waits: Waits) -> None:
        self._operator = operator
        self._waits = waits

    def perform(self, action: HandWork) -> object:
        """Perform an action by the operator."""
        with self._waits.asking():
            return self._operator.perform(action)


class WatchedSharing:
    """Waiting for an instrument of another socket does not count as being stuck either."""

    def __init__(self, sharing: Sharing, waits: Waits) -> None:
        self._sharing = sharing
        self._waits = waits

    @property
    def roles(self) -> frozenset[Role]:
        """The roles whose instrument others use too."""
        return self._sharing.roles

    def acquire(self, roles: Collection[Role], purpose: str) -> float:
        """Acquire shared instruments; return once the run has them."""
        with self._waits.sleeping():
            return self._sharing.acquire(roles, purpose)

    def release(self) -> None:
        """Give back what there is to give back."""
        self._sharing.release()


class WatchedPrompt:
    """The same for who sets and reads an instrument by hand."""

    def __init__(self, prompt: Prompt, waits: Waits) -> None:
        self._prompt = prompt
        self._waits = waits

    def ask(self, quantity: Text, unit: str, minimum: float, maximum: float, context: Text | None) -> float:
        """Return the number given."""
        with self._waits.asking():
            return self._prompt.ask(quantity, unit, minimum, maximum, context)

    def choose(self, quantity: Text, options: Sequence[Option]) -> float:
        """Return the number of the answer chosen."""
        with self._waits.asking():
            return self._prompt.choose(quantity, options)

    def confirm(self, task: Text) -> None:
        """Return once it is done."""
        with self._waits.asking():
            self._prompt.confirm(task)


def watched_prompts(prompts: Callable[[Role], Prompt | None], waits: Waits) -> Callable[[Role], Prompt | None]:
    """Return the ways to the person for each role, watched."""

    def watched(role: Role) -> Prompt | None:
        prompt = prompts(role)
        return None if prompt is None else WatchedPrompt(prompt, waits)

    return watched
