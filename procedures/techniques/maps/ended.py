"""Messages about a map whose readings ended early, were limited, or contradict those of an earlier session."""

import math
from typing import Any

from drivers.interfaces.text import Text, text
from procedures.core.procedure import Procedure
from procedures.estimation.flux.map_fit import SessionUnknowns
from procedures.estimation.flux.session_ties import BrokenTie
from procedures.techniques.maps.readings import MapReadings

#: What becomes of readings that contradict each other, by whether there was time to read all again.
READ_AGAIN = text("they are left out, and what they had read was read again")
LEFT_OUT = text("the map is of the session with the most readings; measure again with --repeat flux-map")


def tell_left_out(procedure: Procedure[Any], taken: MapReadings, planned: int, speed: float | None = None) -> None:
    """Say why readings ended before so many were taken, at how many currents the inverter was limited, and at how many the speed (rad/s)
    was not held.
    """
    if taken.unheld and speed is not None:
        procedure.notice("dynamometer-limit", unheld_words(taken, speed))
    if taken.ended is not None:
        procedure.notice(
            "ended-early",
            text(
                "{read} of {planned} readings were taken: {why}. The map is of these",
                read=len(taken.points),
                planned=planned,
                why=taken.ended,
            ),
        )
    if taken.limited:
        procedure.notice(
            "limited",
            text(
                "at {count} of the currents the inverter's output was limited, and they are left out; lower speed_share, or raise "
                "the bus voltage",
                count=len(taken.limited),
            ),
        )


def unheld_words(taken: MapReadings, speed: float) -> Text:
    """Return at how many currents, and how, the dynamometer did not hold a speed (rad/s), and what may be done."""
    farthest = max(taken.unheld, key=lambda each: abs(abs(each.speed) - speed))
    return text(
        "at {count} of the currents the dynamometer did not hold {speed:.0f} rpm: the shaft turned at {read:.0f} rpm under "
        "{torque:.3g} N·m, so its drive is at its torque limit. They are left out; lower current_share, raise the drive's limit, or use "
        "a stronger dynamometer",
        count=len(taken.unheld),
        speed=speed * 30.0 / math.pi,
        read=abs(farthest.speed) * 30.0 / math.pi,
        torque=max((each.torque for each in taken.unheld), key=abs),
    )


def broken_words(broken: BrokenTie, answer: Text) -> Text:
    """Return that sessions contradict each other, and what is done about it."""
    return text(
        "currents that were read again contradict the readings of earlier sessions: flux linkages differ by "
        "{share:.2g} % of the largest, gains by {gain:.2g} %, more than temperatures, the angle's zero and stated "
        "limits explain; {answer}",
        share=100.0 * broken.share,
        gain=100.0 * broken.gain,
        answer=answer,
    )


def session_row(session: SessionUnknowns) -> dict[str, Any]:
    """Return what a session's readings have of their own, as it stands among the findings."""
    return {name: each if isinstance(each, int) else vars(each) for name, each in vars(session).items()}
