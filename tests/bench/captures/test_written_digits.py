"""What a file's numbers say of the converter's steps, and of an error that few digits leave in all of them."""

import numpy as np
import pytest

from bench.captures.reading import read_captures
from bench.captures.written_digits import steps_and_rounding
from tests.studies.few_digits import write

STEP = 1.0 / 64.0


def settled(level: float, noise: float, step: float = STEP, number: int = 4000) -> np.ndarray:
    """Return what a converter makes of zero and a level with noise (both in steps)."""
    random = np.random.default_rng(1)
    values = np.where(np.arange(number) < number // 5, 0.0, level * step) + random.normal(0.0, noise * step, number)
    return np.round(values / step) * step


def written(values: np.ndarray, form: str) -> np.ndarray:
    return np.array([float(format(value, form)) for value in values])


@pytest.mark.parametrize("form", [".2e", ".2f"])
@pytest.mark.parametrize("level", [102.3, 72.5])
def test_steps_rounded_by_the_file_have_an_error_in_common(form: str, level: float) -> None:
    exact = settled(level, 0.4)
    seen = written(exact, form)
    large = exact > 0.5 * level * STEP
    off = abs(np.mean(seen[large]) / np.mean(exact[large]) - 1.0)
    _, rounding = steps_and_rounding(seen)
    assert off <= rounding <= 0.005 / (level * STEP)


@pytest.mark.parametrize(
    "values",
    [
        pytest.param(written(settled(60.3, 0.4, 0.08), ".2e"), id="steps of 0.08 below 10 V in three digits"),
        pytest.param(written(settled(102.3, 0.4, 0.02), ".3e"), id="steps of 0.02 in four digits"),
        pytest.param(np.round(np.linspace(3000.0, 1000.0, 40000)), id="whole numbers of a falling speed"),
        pytest.param(np.linspace(0.0, 1.0, 400), id="a computed line"),
        pytest.param(np.zeros(400), id="nothing"),
        pytest.param(settled(102.3, 0.4), id="all digits"),
    ],
)
def test_what_holds_the_steps_has_none(values: np.ndarray) -> None:
    assert steps_and_rounding(values)[1] < 1e-12


def test_digits_finer_than_the_noise_leave_little() -> None:
    random = np.random.default_rng(1)
    values = np.round(1.6 + random.normal(0.0, 0.05, 20000), 2)
    assert steps_and_rounding(values)[1] < 1e-3


def test_a_rigol_file_of_three_digits_carries_it_and_a_factor_does_not_change_it(tmp_path) -> None:
    path = tmp_path / "rigol.csv"
    current = settled(102.3, 0.4)
    write(path, np.arange(current.size) * 1e-6, (current, settled(60.3, 0.4, 0.08)), ("Volt", "Volt"), 3)
    capture = read_captures([path])
    first, second = (channel.rounding for channel in capture.channels)
    assert first == pytest.approx(0.002, rel=0.5)
    assert second == 0.0
    assert capture.scaled({"CH1": 0.1075}).channel("CH1").rounding == first
