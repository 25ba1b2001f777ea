"""All motors of a check."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from bench.distribution.work import Task
from bench.distribution.workforce import Workforce
from bench.eol.defects.cases import DefectCases
from bench.eol.defects.trial import MotorTrial, TrialSetup


@dataclass(frozen=True)
class Campaign:
    """The measured motors, in the order of their numbers; not `complete` if somebody stopped it. `planned` is their intended
    number.
    """

    trials: tuple[MotorTrial, ...]
    planned: int

    @property
    def complete(self) -> bool:
        """Return whether every motor was measured."""
        return len(self.trials) == self.planned


def tasks_of(cases: DefectCases, each: int, sound: int) -> tuple[Task, ...]:
    """Return case, motor of it and number of `each` motors of every case and of so many `sound` ones, evenly mixed."""
    every = len(cases.cases)
    places = [((motor + 0.5) / sound, -1, motor) for motor in range(sound)]
    places += [((motor + (case + 0.5) / every) / each, case, motor) for case in range(every) for motor in range(each)]
    places.sort()
    return tuple((case, motor, number) for number, (_, case, motor) in enumerate(places, 1))


def measure_all(
    setup: TrialSetup, tasks: Sequence[Task], workforce: Workforce, progress: Callable[[int], None] = lambda _: None
) -> Campaign:
    """Measure these motors; `progress` hears how many are done.

    Ctrl-C ends it with those that are done. Raises InputError as `Workforce.results` does.
    """
    done: list[MotorTrial] = []
    results = workforce.results(setup, tasks)
    try:
        for trial in results:
            done.append(trial)
            progress(len(done))
    except KeyboardInterrupt:
        pass
    finally:
        results.close()
    return Campaign(tuple(sorted(done, key=lambda trial: trial.number)), len(tasks))
