"""PDF files, read back."""

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pypdf import PageObject


def pages_of(content: bytes) -> "Sequence[PageObject]":
    # Late: every worker imports every test's file, and two files' tests read PDFs.
    from pypdf import PdfReader

    return PdfReader(io.BytesIO(content)).pages
