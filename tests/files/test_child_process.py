import faulthandler
import os
import signal

import pytest

from vidtrack.files.child_process import ChildDied, in_child


def doubled(text):
    return 2 * text


def raising(text):
    raise KeyError(text)


def dying(text):
    faulthandler.disable()  # pytest's would fill the terminal with what is meant to happen
    os.kill(os.getpid(), signal.SIGSEGV)


def test_the_answer_comes_back():
    assert in_child(doubled, "ab") == "abab"


def test_an_error_comes_back_by_its_words():
    with pytest.raises(ValueError, match="KeyError: 'x'"):
        in_child(raising, "x")


def test_a_child_that_dies_is_an_error_and_not_the_end_of_its_parent():
    with pytest.raises(ChildDied, match="-11"):
        in_child(dying, "")
