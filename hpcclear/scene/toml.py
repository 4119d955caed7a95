"""Plain content to TOML text."""

import json
from collections.abc import Iterator, Mapping
from typing import Any


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    if isinstance(value, Mapping):
        return (
            "{ " + ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items()) + " }"
        )
    return repr(value)


def _key(key: str) -> str:
    return (
        key
        if key and key.isascii() and key.replace("_", "").replace("-", "").isalnum()
        else _value(key)
    )


def _lines(content: Mapping[str, Any], prefix: str) -> Iterator[str]:
    plain = {key: value for key, value in content.items() if not isinstance(value, Mapping)}
    if prefix and (plain or not content):
        yield f"\n[{prefix}]"
    for key, value in plain.items():
        yield f"{_key(key)} = {_value(value)}"
    for key, value in content.items():
        if isinstance(value, Mapping):
            yield from _lines(value, f"{prefix}.{_key(key)}" if prefix else _key(key))


def to_toml(content: Mapping[str, Any]) -> str:
    """TOML text of nested tables of strings, numbers, booleans and lists; floats keep every bit."""
    return "\n".join(_lines(content, "")) + "\n"
