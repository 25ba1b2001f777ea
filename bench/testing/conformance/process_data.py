"""Checks of what a CANopen node sends unasked (CiA 301): its transmit PDOs as a driver maps, reads and gives them back."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any

from bench.testing.conformance.network_management import PDO_MAPPINGS, PDOS, OtherMaster
from bench.testing.conformance.played import play
from bench.testing.conformance.report import Checks
from bench.testing.conformance.session import Trial, plain_readings
from drivers.interfaces import InstrumentError, Reading
from sim_instruments.instruments.cia402.power import numbered

#: The transmit PDOs' parameters: the identifier, with a bit that says that it is not valid, and the type.
_PDO_PARAMETERS, _NOT_VALID = 0x1800, 1 << 31
#: The last bytes of what is put into an object: no two are alike, and the highest bit, the sign of one that has a sign, is set.
_PATTERN = b"\x12\x34\x56\x9a"


def check_process_data(trial: Trial) -> None:
    """Check a CANopen node's transmit PDOs: objects in their own lengths, read as by SDO, all put back by `close()`.

    Ones that stop meanwhile are told or done without.
    """
    checks = trial.checks
    with trial.stand() as made:
        if made.transport != "can":
            return
        trial.session.prepare(made)
        with OtherMaster(made) as other:
            before = _pdos(other)
            instrument = made.open()
            wrong = [
                f"{index:04X}h {subindex} with {bits} bits instead of {length}"
                for index, subindex, bits in other.mapped
                if (length := other.length(index, subindex)) not in (None, bits)
            ]
            checks.that("PDOs: each object in its length", not wrong, ", ".join(wrong), "Map it as the manual types it")
            used = {number: one for number, one in _pdos(other).items() if one != before[number]}
            for number in used:
                identifier = int.from_bytes(other.read(_PDO_PARAMETERS + number, 1) or b"", "little") | _NOT_VALID
                other.write(_PDO_PARAMETERS + number, 1, identifier.to_bytes(4, "little"))
            during = Checks()
            with suppress(InstrumentError):
                trial.session.brief(made, instrument, during)
            remedy = "Read one by one what is not sent, or tell it"
            checks.that("PDOs that stop never become a value", not during.wrong, during.wrong, remedy)
            with suppress(InstrumentError):
                instrument.make_safe()
            instrument.close()
            remedy = "Write back identifier, type and mapping of each PDO that was changed"
            checks.that("PDOs: put back", _pdos(other) == before, f"{_pdos(other)} instead of {before}", remedy)
            mapped = [
                (index, subindex) for index, subindex, bits in other.mapped if other.length(index, subindex) == bits
            ]
    _check_values(trial, mapped)


def _check_values(trial: Trial, mapped: Sequence[tuple[int, int]]) -> None:
    """Check that an object means the same in a PDO and by SDO, by a number in it that no other object and no other sign has."""
    said: list[dict[int, int | None]] = [{} for _ in mapped]
    sent = _readings(trial, mapped, said, {})
    with suppress(InstrumentError):
        # A driver may refuse a node that lets nothing be mapped.
        asked = _readings(trial, mapped, said, {rf"^write {PDO_MAPPINGS >> 8:X}": None})
        for (index, subindex), by_pdo, by_sdo in zip(mapped, sent, asked, strict=True):
            wrong = [f"{name}: {one} instead of {by_sdo[name]}" for name, one in by_pdo.items() if one != by_sdo[name]]
            what, remedy = (
                f"{index:04X}h {subindex}: {', '.join(wrong)}",
                "Take its sign and its bytes as the manual types it",
            )
            trial.checks.that("PDOs: each object as by SDO", not wrong, what, remedy)


def _readings(
    trial: Trial, mapped: Sequence[tuple[int, int]], said: Sequence[dict[int, int | None]], refused: Mapping[str, None]
) -> list[dict[str, Any]]:
    """Return what each reading of the role gives, or the error it raises, with each mapped object in turn replaced.

    `said` holds what the node says of its objects at each of these, and is added to: it says the same when it is asked again.
    """
    with trial.stand() as made:
        trial.session.prepare(made)
        play(made, refused)
        instrument: Any = made.open()
        device, result = made.simulated, []
        read, kinds = device.read, {(one.index, one.subindex): one.kind for one in device.entries}
        try:
            for (index, subindex), so_far in zip(mapped, said, strict=True):
                kind = kinds[index, subindex]
                pattern = _PATTERN[-int(kind[1:]) // 8 :]
                so_far[numbered(index, subindex)] = int.from_bytes(pattern, "little", signed=kind.startswith("i"))
                device.read = partial(_held, so_far, read)
                result.append({name: _read(instrument, name) for name in plain_readings(trial.subject.role)})
        finally:
            device.read = read
            instrument.close()
        return result


def _held(said: dict[int, int | None], read: Callable[[int], int | None], place: int) -> int | None:
    if place not in said:
        said[place] = read(place)
    return said[place]


def _read(instrument: Any, name: str) -> Any:
    try:
        found = getattr(instrument, name)()
    except InstrumentError as error:
        return type(error)
    return replace(found, time=0.0) if isinstance(found, Reading) else found


def _pdos(other: OtherMaster) -> dict[int, tuple[bytes | None, ...]]:
    """Return parameters and mapping of each transmit PDO: the entries that count."""
    found: dict[int, tuple[bytes | None, ...]] = {}
    for number in PDOS:
        count = other.read(PDO_MAPPINGS + number, 0)
        entries = range(1, 1 + (count[0] if count else 0))
        parameters = (other.read(_PDO_PARAMETERS + number, subindex) for subindex in (1, 2))
        mapping = (other.read(PDO_MAPPINGS + number, subindex) for subindex in entries)
        found[number] = (*parameters, count, *mapping)
    return found
