"""The spellings of a serial number: a letter with an accent is one character or two, and the motor is the same."""

from unicodedata import normalize


def spelled(serial_number: str) -> str:
    """Return the spelling in which a serial number is kept (Unicode's form NFC)."""
    return normalize("NFC", serial_number)


def spellings(serial_number: str) -> tuple[str, ...]:
    """Return the spellings in which records may have a serial number: those of earlier versions have it as it was sent."""
    return tuple(dict.fromkeys((spelled(serial_number), normalize("NFD", serial_number), serial_number)))
