"""What an English reader reads in place of short names."""

from bench.i18n.english_names import NAMES, PROCEDURES
from bench.i18n.language import catalogue, translator
from drivers.interfaces.text import word
from procedures.catalogue import ORDER
from procedures.catalogue import catalogue as installed


def test_a_procedures_name_reads_as_its_title() -> None:
    titles = installed()
    # By hand nothing is found that would be said to come from it.
    assert {name: str(titles[name].title) for name in ORDER if name != "by-hand"} == PROCEDURES


def test_short_names_are_words_in_every_language() -> None:
    assert NAMES.keys() <= catalogue("zh").keys()
    assert word("repeats-differ").render(translator("en")) == "repeats differ"
    assert str(word("repeats-differ")) == "repeats-differ"
