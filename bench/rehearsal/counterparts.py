"""The simulated instrument for each instrument of a station: the one its driver names, or one with its ratings."""

from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, fields, replace
from typing import Any

from bench.i18n.errors import InputError
from bench.plugins.catalogues import Catalogues
from bench.station.station_file import VIRTUAL, Entry, Station
from bench.virtual.simulated_units import OF_THE_UNIT, missing_counterpart, stated_options, unit_of
from bench.virtual.virtual_station import as_text, dc_voltage_for, dq_inverter_for, virtual_station
from drivers.bases.oscilloscope_data import Probe
from drivers.bases.scpi_supply import ScpiSupplyModel, SupplyData
from drivers.catalogue import MANUAL, RATING_UNITS, Driver
from drivers.interfaces import Accuracy, ProbeKind
from drivers.interfaces.text import Text, text
from procedures.core.bench import Role
from procedures.core.nameplate import Nameplate
from sim_instruments.bench import VirtualBench
from sim_instruments.catalogue import (
    DQ_INVERTER,
    FIXTURE,
    SIX_STEP,
    STANDARD,
    Options,
    SimulatedInstrument,
    SimulatedUnit,
    find,
)

_ATTENUATION = 10.0
#: Accuracy of the generic supply's meters, relative to its range, where the station file states none.
_METER = 1.0e-3


@dataclass(frozen=True)
class Counterpart:
    """The counterpart of a station's instrument: the simulated one and its driver; None is that of the virtual station."""

    entry: Entry
    unit: SimulatedUnit
    driver: Driver | None
    differences: tuple[Text, ...]


def counterparts_of(station: Station, nameplate: Nameplate | None = None) -> dict[Role, Counterpart]:
    """Return what stands for a station's instruments; a fixture's have none. An inverter's DC link, which no station file states, is
    that of a motor's plate.

    Raises InputError for a driver that names a simulated instrument which cannot be had.
    """
    found = {
        role: _counterpart(entry, station.catalogues)
        for role, entry in station.entries.items()
        if role.value not in FIXTURE
    }
    if nameplate is not None and (inverter := found.get(Role.INVERTER)) is not None:
        given = _link(inverter.unit, nameplate, own=station.source != VIRTUAL)
        unit = replace(inverter.unit, options={**given, **inverter.unit.options})
        found[Role.INVERTER] = replace(inverter, unit=unit)
    return found


def _link(unit: SimulatedUnit, nameplate: Nameplate, *, own: bool) -> Options:
    """Return what an inverter gets besides what its station states; a moteus of the station's own has its maker's limits."""
    if unit.kind.name == DQ_INVERTER:
        return {} if own else dq_inverter_for(nameplate)
    return {"dc_voltage": dc_voltage_for(nameplate)}


def twin_station(station: Station, counterparts: Mapping[Role, Counterpart], bench: VirtualBench) -> Station:
    """Return a station with the counterparts, which are on a bench, in place of its instruments; a bench's others stay."""
    virtual = virtual_station(bench.addresses())
    entries = {
        role: _entry(counterpart, virtual.entries[role], as_text(bench.address(role.value)))
        for role, counterpart in counterparts.items()
    }
    return replace(
        station,
        entries={**virtual.entries, **entries},
        way_down=replace(station.way_down, by_hand=frozenset()),
        control="",
        interlocks=(),
        watchdog_relays=(),
    )


def _counterpart(entry: Entry, catalogues: Catalogues) -> Counterpart:
    """Return what stands for an instrument: its driver's own counterpart, else what bears its ratings."""
    driver, role = entry.driver, entry.role
    options = stated_options(entry)
    if (unit := unit_of(entry, catalogues)) is not None:
        return Counterpart(entry, unit, driver, tuple(_shortfalls(entry, unit, options)))
    if (missing := missing_counterpart(entry, catalogues)) is not None:
        # A stand-in would try neither the driver nor the ranges that its author meant to be tried.
        raise InputError(
            text(
                "instruments.{role} cannot be rehearsed: {why}; correct Driver(simulated=…), or install the "
                "package that provides it; a run on the real instrument needs neither",
                role=role.value,
                why=missing.why,
            )
        )
    said: list[Text] = []
    generic = _generic_supply(options) if role is Role.SUPPLY else None
    if generic is not None:
        unit = SimulatedUnit(find("generic-supply"), role.value, options)
        said.append(
            text(
                "{role}: {real} has no simulated counterpart; a generic instrument with its driver's ratings is "
                "used instead, at most {ratings}",
                role=role.value,
                real=driver.name,
                ratings=_stated(options),
            )
        )
        return Counterpart(entry, unit, generic, tuple(said))
    kind = find({**STANDARD, **SIX_STEP}[role.value])
    unit = SimulatedUnit(kind, role.value, {"pole_pairs": 1, **options})
    said.append(_replaced(entry, kind))
    return Counterpart(entry, unit, None, (*said, *_shortfalls(entry, unit, options)))


def _replaced(entry: Entry, kind: SimulatedInstrument) -> Text:
    """Say what stands for an instrument without a counterpart, with which ratings, and what would make it stand better."""
    about: dict[str, Any] = {"role": entry.role.value, "virtual": kind.name, "real": entry.driver.name}
    if entry.driver.name == MANUAL:
        return text("{role}: {virtual} simulates the station's {real}", **about)
    usual = virtual_station({entry.role.value: "-"}).entries[entry.role].options
    bounds = [name for name in RATING_UNITS if hasattr(usual, name)]
    ratings = _stated({name: bound for name, bound in stated_options(entry).items() if name in bounds})
    if ratings:
        return text(
            "{role}: {real} has no simulated counterpart; a generic instrument with its driver's ratings is used "
            "instead, at most {ratings}; it reads as accurately as {virtual}",
            **about,
            ratings=ratings,
        )
    if bounds:
        return text(
            "{role}: {real} has no simulated counterpart and declares no ratings; {virtual} is used instead, with "
            "its own ranges and accuracies: give Driver(ratings=…) {bounds}, or name a simulated instrument of "
            "its own by Driver(simulated=…)",
            **about,
            bounds=bounds,
        )
    return text(
        "{role}: {real} has no simulated counterpart; {virtual} is used instead, with its own ranges and "
        "accuracies, which ratings cannot describe: name a simulated instrument of its own by Driver(simulated=…)",
        **about,
    )


def _generic_supply(options: Options) -> Driver | None:
    """Return a driver for a supply of these ratings; None where they are not known."""
    voltage, current = options.get("maximum_voltage"), options.get("maximum_current")
    if voltage is None or current is None:
        return None
    meters = [Accuracy(offset=_METER * highest, source="generic supply") for highest in (voltage, current)]
    data = SupplyData(voltage, current, 1.1 * voltage, meters[0], meters[1])
    return ScpiSupplyModel(("motorbench",), ("GENERIC SUPPLY",), data).driver("generic-supply")


def _shortfalls(entry: Entry, unit: SimulatedUnit, options: Options) -> Iterator[Text]:
    """Say which of a family the simulated instrument is, and where it cannot do as the station's would."""
    role, ratings = entry.role.value, unit.kind.ratings(options)
    if unit.kind.model:
        yield text(
            "{role}: the station file names no model; {model} is taken, at most {ratings}",
            role=role,
            model=unit.kind.model.format(**{"channel": 1, **options}),
            ratings=_stated(ratings),
        )
    for name, bound in ratings.items():
        wanted = options.get(name)
        if wanted is not None and wanted > bound:
            yield text(
                "{role}: the station's {name} is {wanted:g} {unit}, but the twin's {role} reaches only {bound:g} "
                "{unit}; set points that follow the instrument's range are those of the twin",
                role=role,
                name=name,
                wanted=wanted,
                unit=RATING_UNITS.get(name, ""),
                bound=bound,
            )


def _stated(ratings: Mapping[str, Any]) -> list[str]:
    return [f"{ratings[name]:g} {unit}" for name, unit in RATING_UNITS.items() if ratings.get(name) is not None]


def _entry(counterpart: Counterpart, virtual: Entry, address: str) -> Entry:
    """Return a role's instrument on the twin: the simulated unit, with the station's options, name and limits."""
    entry, driver = counterpart.entry, counterpart.driver
    if driver is entry.driver:
        base: Any = virtual.options if virtual.driver is driver else None
        fixed = {
            option.name: _default(option) if base is None else getattr(base, option.name)
            for option in fields(entry.options)  # type: ignore[arg-type]
            if option.name in OF_THE_UNIT and (base is not None or _default(option) is not MISSING)
        }
        options = replace(entry.options, **fixed)  # type: ignore[type-var]
    else:
        # Of another make: what bounds it, how it is read, and how well.
        options = virtual.options if driver is None else driver.options()
        known = {option.name for option in fields(options)}  # type: ignore[arg-type]
        stated = counterpart.unit.options
        given = {
            name: value
            for name, value in stated.items()
            if name in known and (name in RATING_UNITS or name.endswith("_accuracy"))
        }
        if "probes" in known and stated.get("probes"):
            given["probes"] = _probes(stated["probes"])
        if "rated_torque" in known:
            torque = stated.get("rated_torque") or stated.get("maximum_torque")
            given |= {"pole_pairs": stated["pole_pairs"], **({"rated_torque": torque} if torque else {})}
        options = replace(options, **given)  # type: ignore[type-var]
    return replace(entry, driver=driver or virtual.driver, address=address, options=options, calibration=None)


def _default(option: Any) -> Any:
    return option.default_factory() if option.default_factory is not MISSING else option.default


def _probes(probes: Mapping[int, Any]) -> dict[int, Probe]:
    """Return the probes of an oscilloscope that may only know their kinds."""
    kinds = {channel: getattr(probe, "kind", probe) for channel, probe in probes.items()}
    return {channel: Probe(ProbeKind(kind), _ATTENUATION) for channel, kind in kinds.items()}
