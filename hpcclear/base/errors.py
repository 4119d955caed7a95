"""Errors a user can mend: one message with key, value, reason and remedy."""

import os


class InputError(ValueError):
    """Bad input; the command line prints the message and exits with code 2.

    Parameters
    ----------
    key : str
        Where the value stands: a dotted scene path, an option, or a file.
    value : object
        What was found there.
    reason : str
        Why it cannot be used.
    remedy : str
        What to write instead.
    """

    def __init__(self, key: str, value: object, reason: str, remedy: str) -> None:
        self.key = key
        self.value = value
        self.reason = reason
        self.remedy = remedy
        super().__init__(key, value, reason, remedy)  # args, so that pickling keeps all four

    def __str__(self) -> str:
        shown = repr(self.value)
        # a file's place is of use only whole
        if len(shown) > 80 and os.sep not in shown:
            shown = shown[:77] + "..."
        return f"{self.key} = {shown}: {self.reason}. {self.remedy}"


class StorageError(RuntimeError):
    """The disk refused a write; what was there before is intact. Exit code 1.

    Parameters
    ----------
    path : str
        The file that was to be written.
    reason : str
        What the operating system said.
    remedy : str
        What to do about it.
    """

    def __init__(self, path: str, reason: str, remedy: str) -> None:
        self.path = path
        self.reason = reason
        self.remedy = remedy
        super().__init__(path, reason, remedy)  # args, so that pickling keeps all three

    def __str__(self) -> str:
        return f"cannot write {self.path}: {self.reason}. {self.remedy}"
