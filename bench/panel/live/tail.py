"""A journal that is still being written, read as it grows."""

from collections.abc import Iterator
from pathlib import Path

from bench.journal.codec import RecordedEvent, decode
from bench.journal.packed import open_journal

#: Read at most this much (bytes) at once: a long journal must not hold up who waits for its end.
_PIECE = 1 << 20


class JournalTail:
    """Reads a journal's whole lines once each; the hashes are proved elsewhere (`motorbench results verify`)."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._offset = 0
        self._begun = b""
        self._packed = False

    def read_new(self) -> Iterator[RecordedEvent]:
        """Give the events written since the last call; a line still being written waits for the next call.

        A journal that is not there yet gives none.
        """
        if self._packed:
            return
        try:
            with open_journal(self._path) as file:
                file.seek(self._offset)
                while piece := file.read(_PIECE):
                    self._offset += len(piece)
                    *whole, self._begun = (self._begun + piece).split(b"\n")
                    # A torn line in the middle is where a killed run was resumed.
                    yield from (decoded[0] for line in whole if (decoded := decode(line)))
        except FileNotFoundError:
            return
        # Nothing is added to a journal once it is packed.
        self._packed = not self._path.exists()
