"""The installed procedures, found by an entry-point group, and the order in which a whole measurement takes them."""

from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import TYPE_CHECKING, Any

from drivers.interfaces.strangers_code import strangers_code

if TYPE_CHECKING:
    from procedures.core.procedure import Procedure

GROUP = "motorbench.procedures"

#: What a whole measurement takes, and in this order; after them what is not ours and belongs to one.
WHOLE: tuple[str, ...] = (
    "nameplate",
    "pole-pairs-static",
    "stator-resistance",
    "stator-resistance-dc",
    "dq-inductance-extremes",
    "dq-inductance-aligned",
    "dq-inductance-time-constant",
    "pole-pairs-inverter",
    "pole-pairs-back-emf",
    "back-emf-constant",
    "inertia",
    "torque-constant",
    "equivalent-resistance",
)
#: By name; the end-of-line checks come last, and after them what is not among these.
ORDER: tuple[str, ...] = (
    *WHOLE,
    "flux-map",
    "flux-map-standstill",
    "open-circuit",
    "short-circuit",
    "load-points",
    "winding-balance",
    "phase-order",
    "back-emf-shape",
    "no-load-current",
    "no-load-current-six-step",
    "cogging-torque",
    "hall-sensors",
    "insulation-resistance",
    "probe-verification",
    "by-hand",
)


@cache
def catalogue() -> "Mapping[str, type[Procedure[Any]]]":
    """Return the installed procedures by name; of those that cannot be used `bench.plugins` knows why."""
    places = {name: place for place, name in enumerate(ORDER)}

    def order(point: EntryPoint) -> tuple[int, bool, str]:
        # As `bench.plugins` has them: of two that differ on a parameter, the same one counts in both.
        name = point.dist.name if point.dist is not None else ""
        return places.get(point.name, len(places)), name != "motorbench", name

    points = sorted(entry_points(group=GROUP), key=order)
    found: dict[str, Any] = {}
    for point in points:
        if point.name not in found:
            with suppress(Exception), strangers_code():
                found[point.name] = point.load()
    return {name: found[name] for name in dict.fromkeys(point.name for point in points) if name in found}
