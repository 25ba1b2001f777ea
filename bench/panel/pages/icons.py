"""The panel's icons: outlines on a square of 32, in the colour of the words beside them."""

from nicegui import ui

_PATHS = {
    "off": "M16 2L28 7V15C28 23 23 28 16 30C9 28 4 23 4 15V7ZM10 16l4.5 4.5L22 12",
    "on": "M18 3L6 18H15L13 29L26 13H17Z",
    "unknown": "M16 3a13 13 0 1 0 .01 0M12 12.5a4 4 0 1 1 5.6 3.7c-1.1.5-1.6 1.3-1.6 2.5M16 23v.3",
    "unread": "M3 16C8 8 24 8 29 16C24 24 8 24 3 16ZM16 12a4 4 0 1 0 .01 0",
    "lost": "M3 12C11 5 21 5 29 12M8 17C13 13 19 13 24 17M13 22C15 20.5 17 20.5 19 22M16 27v.3M4 4L28 28",
    "stop": "M11 3H21L29 11V21L21 29H11L3 21V11Z",
    "back": "M14 6L4 16L14 26M4 16H28",
    "larger": "M19 4H28V13M28 4L18 14M13 28H4V19M4 28L14 18",
    "again": "M27 16a11 11 0 1 1-3.5-8M27 3v7h-7",
}


def icon(name: str) -> ui.element:
    """Build an icon; what it means stands in words beside it."""
    svg = ui.element("svg")
    svg.props["data-icon"] = name
    svg.props('viewBox="0 0 32 32" fill=none stroke=currentColor stroke-width=3 aria-hidden=true')
    svg.props("stroke-linecap=round stroke-linejoin=round")
    with svg:
        ui.element("path").props["d"] = _PATHS[name]
    return svg
