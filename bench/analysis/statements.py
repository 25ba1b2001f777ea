"""Accuracy statements of the user for a capture: on the command line, in a file."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import Field

from bench.captures.units import si
from bench.files.toml_file import Section, read, validate
from bench.i18n.errors import InputError, UsageError, at
from drivers.interfaces.text import Text, text

_RELATIVE = {"%": 1e-2, "ppm": 1e-6}
_TERM = re.compile(r"\s*(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)\s*(%|[^\d\s+.%][^\s+%]*)\s*")
_FULL_SCALE = re.compile(
    r"±?\s*(\d+\.?\d*|\.\d+)\s*%\s*fs\b\s*(?:@\s*(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+)\s*([^\s+%\d]+))?", re.IGNORECASE
)
_RANGE = re.compile(r"\s*(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)\s*([^\s+%\d]+)\s*")
_WANTED = text(
    "a gain in % or ppm, of the reading or of full scale (1.5%fs@8V), an offset with its unit, none below 0, as in 2%+5mV"
)
#: A larger error of gain makes no interval: the reading says next to nothing.
_LARGEST_GAIN = 0.5


@dataclass(frozen=True)
class Statement:
    """Limits of error of a channel, or of all channels of a kind (half-widths, rectangular).

    `gain` is relative, `offset` in SI; its `unit` is SI, empty where none was written. Channels of one `instrument` (empty: the
    kind's own) err together. `full_scale_share` is the limit of the gain's error as a share of `full_scale` (SI, 0 where the capture is
    to say it). `given` is how the user wrote it, for messages; `typed` whether on the command line. With `range_only` it states a
    channel's full scale and no limit.
    """

    name: str
    gain: float
    offset: float
    unit: str
    given: str
    instrument: str = ""
    typed: bool = False
    full_scale_share: float = 0.0
    full_scale: float = 0.0
    range_only: bool = False

    def error(self, what: Text | str) -> InputError:
        """Return the error that says what is wrong with this statement."""
        kind = UsageError if self.typed else InputError
        return kind(at(self.given, what))


class _Table(Section):
    """`[NAME]` of an accuracy file."""

    gain: float = Field(
        0.0, ge=0.0, le=_LARGEST_GAIN, strict=True, json_schema_extra={"unit": ""}, description="relative: 0.02 is 2 %"
    )
    offset: float = Field(
        0.0, ge=0.0, strict=True, json_schema_extra={"unit": ""}, description="in V, A, N·m, rad/s or H, as the channel"
    )
    full_scale_gain: float = Field(
        0.0, ge=0.0, le=_LARGEST_GAIN, strict=True, json_schema_extra={"unit": ""}, description="share of full_scale"
    )
    full_scale: float = Field(
        0.0,
        ge=0.0,
        strict=True,
        json_schema_extra={"unit": ""},
        description="the channel's range, in V or A, as the channel",
    )
    instrument: str = Field(
        "", description="the common instrument of channels whose errors are the same, text in quotes"
    )


def read_statements(
    words: Sequence[str] = (), file: Path | None = None, full_scales: Sequence[str] = ()
) -> tuple[Statement, ...]:
    """Return what `--accuracy NAME=LIMITS`, `--accuracy-file` and `--full-scale NAME=RANGE` state; on the command line overrules the file.

    Raises UsageError or InputError naming option or file and key, what was given and what is allowed.
    """
    stated = {statement.name: statement for statement in _of_file(file)} if file else {}
    typed: dict[str, Statement] = {}
    for word in words:
        name, mark, limits = word.rpartition("=")
        name = name.strip()
        message = f"--accuracy {word}"
        if not (name and mark):
            raise UsageError(
                text(
                    "{given}: give NAME=LIMITS: a channel's name or a kind, then {wanted}",
                    given=message,
                    wanted=_WANTED,
                )
            )
        if name in typed:
            raise UsageError(
                text(
                    "{given}: {name} was already stated by {before}; state each name once",
                    given=message,
                    name=name,
                    before=typed[name].given,
                )
            )
        typed[name] = _parse(name, limits, message, typed=True)
    return (*{**stated, **typed}.values(), *(_range_of(word) for word in full_scales))


def _of_file(file: Path) -> list[Statement]:
    _, content = read(file, text("accuracy file"))
    result = []
    for name, entry in content.items():
        if isinstance(entry, str):
            result.append(_parse(name, entry, f'{file}: {name} = "{entry}"', typed=False))
        elif isinstance(entry, Mapping):
            table = validate(_Table, entry, str(file), name)
            stated = Statement(
                name,
                table.gain,
                table.offset,
                "",
                f"{file}: [{name}]",
                table.instrument,
                full_scale_share=table.full_scale_gain,
                full_scale=table.full_scale,
            )
            if table.full_scale and not table.full_scale_gain:
                raise stated.error(text("full_scale without full_scale_gain states no limit; give full_scale_gain"))
            result.append(stated)
        else:
            raise InputError(
                text(
                    "{file}: {name} = {entry}; allowed is text with {wanted}, or a table with gain, offset, instrument",
                    file=file,
                    name=name,
                    entry=repr(entry),
                    wanted=_WANTED,
                )
            )
    return result


def _parse(name: str, limits: str, given: str, *, typed: bool) -> Statement:
    blank = Statement(name, 0.0, 0.0, "", given, typed=typed)
    gain: float | None = None
    offset: float | None = None
    unit = ""
    share, full_scale, of_scale, limits = _full_scale(blank, limits)
    for number, written in _terms(blank, limits) if limits.strip() or not share else ():
        if written in _RELATIVE:
            if gain is not None:
                raise blank.error(text("two gains; give one, in % or ppm"))
            gain = number * _RELATIVE[written]
            continue
        known = si(written)
        if known is None:
            raise blank.error(
                text(
                    "the unit '{written}' is not known; known are %, ppm, V, A, H, N·m, rad/s and rpm, with "
                    "prefixes n, u, m, k",
                    written=written,
                )
            )
        if offset is not None:
            raise blank.error(text("two offsets; give one, their sum"))
        unit, offset = known[0], number * known[1]
    if unit and of_scale and unit != of_scale:
        raise blank.error(
            text("an offset in {unit} and a full scale in {scale}; give both alike", unit=unit, scale=of_scale)
        )
    if gain is not None and gain > _LARGEST_GAIN:
        raise blank.error(
            text(
                "a gain known to {gain:g} % only; allowed is up to {most:g} %",
                gain=100 * gain,
                most=100 * _LARGEST_GAIN,
            )
        )
    return Statement(
        name,
        gain or 0.0,
        offset or 0.0,
        unit or of_scale,
        given,
        typed=typed,
        full_scale_share=share,
        full_scale=full_scale,
    )


def _full_scale(blank: Statement, limits: str) -> tuple[float, float, str, str]:
    """Return what is stated of full scale: its share, the full scale and its unit, SI, and the rest of the statement."""
    match = _FULL_SCALE.search(limits)
    if match is None:
        return 0.0, 0.0, "", limits
    known = ("", 0.0) if match[2] is None else si(match[3])
    empty = match[2] is not None and not float(match[2]) > 0.0
    if known is None or empty or not 0.0 < float(match[1]) / 100.0 <= _LARGEST_GAIN:
        raise blank.error(
            text(
                "'{scale}' of {share} % is not a full scale; allowed is a range above 0 with its unit, and up to "
                "{most:g} %",
                scale=f"{match[2] or ''}{match[3] or ''}",
                share=match[1],
                most=100 * _LARGEST_GAIN,
            )
        )
    before, after = limits[: match.start()].strip(), limits[match.end() :].strip()
    rest = "+".join(part for part in (before.removesuffix("+").strip(), after.removeprefix("+").strip()) if part)
    return float(match[1]) / 100.0, float(match[2] or 0.0) * known[1], known[0], rest


def _range_of(word: str) -> Statement:
    """Return what `--full-scale NAME=RANGE` says."""
    name, mark, given = word.rpartition("=")
    match = _RANGE.fullmatch(given)
    known = si(match[2]) if match else None
    if not (name.strip() and mark) or match is None or known is None or not float(match[1]) > 0.0:
        raise UsageError(
            text(
                "--full-scale {word}: give NAME=RANGE: a channel's name or a kind, then the range that was set, the screen's divisions "
                "times volts a division, as in CH1=40V",
                word=word,
            )
        )
    size = float(match[1]) * known[1]
    return Statement(
        name.strip(), 0.0, 0.0, known[0], f"--full-scale {word}", typed=True, full_scale=size, range_only=True
    )


def _terms(blank: Statement, limits: str) -> list[tuple[float, str]]:
    given = limits.strip().replace("±", "")
    terms, position = [], 0
    while position < len(given):
        match = _TERM.match(given, position)
        after = match.end() if match else 0
        if match is None or (after < len(given) and given[after] != "+") or after == len(given) - 1:
            break
        terms.append((float(match[1]), match[2]))
        position = after + 1
    if not terms or position <= len(given) - 1:
        raise blank.error(
            text("'{limits}' is not understood; allowed is {wanted}", limits=limits.strip(), wanted=_WANTED)
        )
    return terms
