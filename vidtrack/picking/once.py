"""Answers that are computed once, however many threads ask at the same time."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import Future
from typing import Generic, ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")


class OnceEach(Generic[P, T]):
    """A function whose answers are kept, the last `most` of them; who asks while one is computed waits for it.

    An error goes to all who wait for it, and is not kept.
    """

    def __init__(self, work: Callable[P, T], most: int) -> None:
        self._work, self._most = work, most
        self._lock = threading.Lock()
        self._answers: OrderedDict[object, Future[T]] = OrderedDict()

    def __call__(self, *given: P.args, **named: P.kwargs) -> T:
        key = (given, tuple(sorted(named.items())))
        with self._lock:
            answer, own = self._answers.get(key), False
            if answer is None:
                answer, own = Future(), True
                self._answers[key] = answer
                while len(self._answers) > self._most:
                    self._answers.popitem(last=False)
            else:
                self._answers.move_to_end(key)
        if own:
            try:
                answer.set_result(self._work(*given, **named))
            except BaseException as error:
                with self._lock:
                    if self._answers.get(key) is answer:
                        del self._answers[key]
                answer.set_exception(error)
        return answer.result()
