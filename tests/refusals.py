"""What a user is told whose entry is refused: at which key, why, and what to write instead."""

from contextlib import contextmanager

import pytest

from hpcclear.base.errors import InputError


@contextmanager
def refused(key=None, *, reason="", remedy="", said="", match=None):
    """Statements within raise InputError of `key`, with a remedy, and with these words in reason, remedy and whole text."""
    with pytest.raises(InputError, match=match) as caught:
        yield caught
    error = caught.value
    assert key in (None, error.key), f"{error.key!r}, not {key!r}: {error}"
    assert reason in error.reason, f"{reason!r} not in {error.reason!r}"
    assert remedy in error.remedy, f"{remedy!r} not in {error.remedy!r}"
    assert said in str(error), f"{said!r} not in {str(error)!r}"
    assert error.remedy, f"no remedy: {error}"
