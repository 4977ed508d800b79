import pytest

from vidtrack.errors import VidtrackError
from vidtrack.exchange.xml import parsed


def test_whole_xml_is_parsed(tmp_path):
    (tmp_path / "a.xml").write_text("<a><b c='1'/></a>")
    assert parsed(tmp_path / "a.xml")[0].get("c") == "1"


@pytest.mark.parametrize(
    ("text", "what"),
    [("<a><b>", "cut off or damaged"), ('<!DOCTYPE a [<!ENTITY b "b">]><a>&b;</a>', "declares entities")],
)
def test_what_breaks_off_or_declares_entities_is_refused(tmp_path, text, what):
    (tmp_path / "a.xml").write_text(text)
    with pytest.raises(VidtrackError, match=what):
        parsed(tmp_path / "a.xml")
