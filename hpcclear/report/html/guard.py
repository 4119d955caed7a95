"""Parts of the page that cannot be made are left out, each with a sentence on why.

A file's seal says that it is as it was written, not that its numbers make a picture: a limit may be NaN,
an axis 1e308 long, a scene's text nested a thousand levels deep.
"""

from collections.abc import Callable
from typing import TypeVar

from hpcclear.base.errors import InputError, StorageError
from hpcclear.base.host import time_limit

LONGEST = 25.0
"""Seconds of processor time that a part may take: an honest one takes less than one, also of millions of samples some."""

Made = TypeVar("Made")


def attempt(what: str, make: Callable[[], Made], troubles: list[str]) -> Made | None:
    """What `make` returns; None if it fails or takes too long, and why as a sentence in `troubles`.

    Raises what the user can mend (InputError) and what the machine refuses (StorageError, OSError): not the content's
    fault.
    """
    try:
        with time_limit(LONGEST):
            return make()
    except TimeoutError:
        reason = f"it takes longer than {LONGEST:g} s of processor time"
    except (InputError, StorageError, OSError):
        raise
    except Exception as error:  # noqa: BLE001 - whatever strange numbers do, one panel must not cost the page
        reason = f"{type(error).__name__}: {error}"[:200]
    troubles.append(f"{what} was left out: the content cannot be shown ({reason}).")
    return None
