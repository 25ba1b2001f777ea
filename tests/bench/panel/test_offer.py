"""What procedures are called before the panel has asked which there are."""

from bench.i18n.language import translator
from bench.panel.offer import Offer


def test_a_procedure_has_its_title_before_the_installation_was_asked() -> None:
    offer = Offer()
    title = offer.title("stator-resistance")
    assert (str(title), title.render(translator("zh"))) == ("Stator resistance", "定子电阻")
    assert str(offer.title("a-strangers")) == "a-strangers"
