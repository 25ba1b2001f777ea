"""Photos that stand beside a motor's or a station's file: checked when the file is read, made small when a run keeps them."""

import io
import warnings
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

from bench.i18n.errors import FileError
from drivers.interfaces.text import Text, reason_of, text

if TYPE_CHECKING:
    from PIL.Image import Image

#: No photo of a camera or phone is larger (bytes, pixels).
LARGEST = 32 * 1024 * 1024
MOST_PIXELS = 120_000_000
#: The longer side of what a run keeps (pixels).
KEPT = 800
_FORMATS = ("JPEG", "PNG")


@dataclass(frozen=True)
class Photo:
    """A photo's file, as the key of a motor's or station's file names it."""

    path: Path
    key: str

    def small(self) -> bytes:
        """Return it as a JPEG of at most 800 pixels, upright, without what a camera writes into it. Raises FileError."""
        from PIL import ImageOps

        with self._opened() as image:
            try:
                image.draft("RGB", (KEPT, KEPT))
                upright = ImageOps.exif_transpose(image).convert("RGB")
                upright.thumbnail((KEPT, KEPT))
                made = io.BytesIO()
                upright.save(made, "JPEG", quality=80)
            except (OSError, SyntaxError, ValueError) as error:
                # Pillow raises SyntaxError for a broken PNG.
                raise self._refused(text("it is incomplete or damaged ({error})", error=str(error))) from None
        return made.getvalue()

    def check(self) -> None:
        """Look whether there is such a picture. Raises FileError."""
        self._opened().close()

    def _opened(self) -> "Image":
        from PIL import Image, UnidentifiedImageError

        try:
            size = self.path.stat().st_size
        except FileNotFoundError:
            raise self._refused(text("there is no such file")) from None
        except OSError as error:
            raise self._refused(reason_of(error)) from None
        if size > LARGEST:
            raise self._refused(text("it has more than {most} MiB", most=LARGEST // 2**20))
        try:
            with warnings.catch_warnings():
                # Our own bound on the pixels follows.
                warnings.simplefilter("ignore", Image.DecompressionBombWarning)
                image = Image.open(self.path, formats=_FORMATS)
        except (UnidentifiedImageError, Image.DecompressionBombError, SyntaxError, ValueError):
            raise self._refused(text("it is not a JPEG or PNG picture")) from None
        except OSError as error:
            raise self._refused(reason_of(error)) from None
        if image.width * image.height > MOST_PIXELS:
            image.close()
            raise self._refused(text("it has more than {most} million pixels", most=MOST_PIXELS // 1_000_000))
        return image

    def _refused(self, why: Text) -> FileError:
        return FileError(
            text(
                "{key}: the photo {path} cannot be shown: {why}; name a JPEG or PNG file beside this one, or leave the key out",
                key=self.key,
                path=str(self.path),
                why=why,
            )
        )


def photo_beside(source: str, key: str, name: str) -> Photo | None:
    """Return the photo that a key of the file `source` names, None for an empty name. Raises FileError where it cannot be shown."""
    if not name:
        return None
    parts = PurePath(name)
    place = f"{source}: {key}"
    if parts.is_absolute() or ".." in parts.parts or "\0" in name:
        raise FileError(
            text(
                "{place} = {name!r}: a photo must be in the folder of its file, or in a folder below it",
                place=place,
                name=name,
            )
        )
    photo = Photo(Path(source).parent / parts, place)
    photo.check()
    return photo
