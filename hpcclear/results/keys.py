"""The key of a run in its files: what makes it the run it is, by which the same run goes on and another is refused."""

import json
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
    """Refuse results of another run than the one that `key` names: by scene, version, seed and so on.

    Flattened entries of a scene make the message name the entries that changed; `place`: of the results, for the message.
    Raises InputError: the keys differ; the message lists where.
    """
    found = key_of(content)
    pairs = {name: (found.get(name), key.get(name)) for name in sorted({*found, *key})}
    shown = [f"{n}: {_short(a)} there, {_short(b)} now" for n, (a, b) in pairs.items() if a != b]
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


def _short(value: object) -> str:
    text = "nothing" if value is None else str(value)
    return text if len(text) <= 40 else text[:37] + "..."
