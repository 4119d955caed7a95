"""The key of a run in its files: what makes it the run it is, by which the same run goes on and another is refused."""

import json
import os
from collections.abc import Mapping
from pathlib import Path

from hpcclear.base.errors import InputError
from hpcclear.results.content import Results

KEY = "run_key"
"""Global attribute with the key of a run, in part, stage and final files."""


def key_attribute(key: Mapping[str, str]) -> dict[str, str]:
    """The key of a run as a global attribute, for files that `check_key` is to recognise."""
    return {KEY: json.dumps(dict(sorted(key.items())), ensure_ascii=False)}


def check_key(content: Results, key: Mapping[str, str], place: Path) -> None:
    """Raise InputError where results at a place are of another run than `key` names; it lists the entries that differ."""
    found = key_of(content)
    pairs = {name: (found.get(name), key.get(name)) for name in sorted({*found, *key})}
    shown = [f"{name}: {_apart(*pair)}" for name, pair in pairs.items() if pair[0] != pair[1]]
    if shown:
        listed = shown if len(shown) <= 10 else [*shown[:10], f"and {len(shown) - 10} more"]
        reason = f"it contains results of another run ({'; '.join(listed)})"
        remedy = "Choose another output, or start a new run beside it with --fresh"
        raise InputError("output", str(place), reason, remedy)


def key_of(content: Results) -> dict[str, object]:
    """The key of the run that made results; empty where it carries none, as a single response."""
    try:
        found = json.loads(str(content.attrs.get(KEY, "{}")))
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _apart(there: object, now: object) -> str:
    """Two values in words; of long ones the part from a little before the place where they begin to differ."""
    texts = ["nothing" if value is None else str(value) for value in (there, now)]
    most, same = 40, os.path.commonprefix(texts)  # noqa: RUF071 - texts, not places
    if len(same) > most // 2:
        first = max(same.rfind(", ") + 2, len(same) - most // 2)
        texts = [f"...{text[first:]}" for text in texts]
    before, after = (text if len(text) <= most else f"{text[:most]}..." for text in texts)
    return f"{before} there, {after} now"
