import threading

import pytest

from vidtrack.picking.once import OnceEach


def test_many_who_ask_at_once_get_the_answer_of_one_call():
    calls, go = [], threading.Event()

    def work(x):
        calls.append(x)
        go.wait(10)
        return 2 * x

    once, answers = OnceEach(work, 8), []
    threads = [threading.Thread(target=lambda: answers.append(once(3))) for _ in range(6)]
    for thread in threads:
        thread.start()
    go.set()
    for thread in threads:
        thread.join()
    assert answers == [6] * 6
    assert calls == [3]


def test_the_oldest_answers_are_forgotten():
    calls = []
    once = OnceEach(lambda x: calls.append(x), 2)
    for x in (1, 2, 1, 3, 1, 2):
        once(x)
    assert calls == [1, 2, 3, 2]


def test_an_error_is_handed_on_and_tried_again():
    tries = []

    def work():
        tries.append(1)
        if len(tries) == 1:
            raise ValueError("not yet")
        return "now"

    once = OnceEach(work, 2)
    with pytest.raises(ValueError, match="not yet"):
        once()
    assert once() == "now"
