"""The one error that a user can mend: what is wrong, where, and what to do, on one line."""


class VidtrackError(Exception):
    """Bad input, told in one line that names the place, the value met and the cure.

    A job that meets it prints the line, writes no output and ends with exit code 1.
    Several problems of one kind may be told together: pass each as its own argument.
    """

    def __init__(self, *problems: str) -> None:
        super().__init__(*problems)
        self.problems: tuple[str, ...] = problems

    def __str__(self) -> str:
        return "\n".join(self.problems)
