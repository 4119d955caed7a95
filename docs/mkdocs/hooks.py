"""What the pages say about commands, scene entries and files comes from the package itself, so that it cannot grow stale."""

import re
from collections.abc import Iterator
from typing import Any

import click

from hpcclear.cli import cli
from hpcclear.results.names import KINDS
from hpcclear.scene import scene_schema

NOT_RUN = re.compile(r"^(`{3,})(\w+) no-run: (.*)$", re.MULTILINE)
SLOW = re.compile(r"^(`{3,})(\w+) slow\b.*$", re.MULTILINE)


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Fences without our marks, the reason of those that no test runs beside them, and generated tables."""
    text = NOT_RUN.sub(r"*(not run by the tests: \3)*\n\n\1\2", markdown)
    text = SLOW.sub(r"\1\2", text)
    for mark, made in (("commands", commands), ("scene entries", scene_entries), ("files", files)):
        if f"<!-- {mark} -->" in text:
            text = text.replace(f"<!-- {mark} -->", "\n".join(made()))
    return text


def commands() -> Iterator[str]:
    """The `--help` of every command."""
    for name, command in cli.commands.items():
        context = click.Context(command, info_name=f"hpcclear {name}", max_content_width=88)
        yield from (f"## {name}", "", "```text", command.get_help(context), "```", "")


def scene_entries() -> Iterator[str]:
    """A table for each part of a scene file, from its JSON schema, in the order in which they are named."""
    schema = scene_schema()
    parts = {"Scene": schema, **schema["$defs"]}
    for name in _in_order(parts):
        part = parts[name]
        yield from (f"## {name}", "", _cell(part.get("description", "")), "")
        yield from ("| entry | value | default | meaning |", "| --- | --- | --- | --- |")
        for entry, field in part["properties"].items():
            required = entry in part.get("required", ())
            default = "needed" if required else _default(field)
            meaning = _cell(field.get("description") or _first_meaning(field, parts))
            yield f"| `{entry}` | {_value(field)} | {default} | {meaning} |"
        yield ""


def _in_order(parts: dict[str, Any]) -> list[str]:
    found = ["Scene"]
    for name in found:
        named = re.findall(r"#/\$defs/(\w+)", str(parts[name]["properties"]))
        found += [part for part in dict.fromkeys(named) if part not in found]
    return found


def _first_meaning(field: dict[str, Any], parts: dict[str, Any]) -> str:
    """What the part that a field refers to is."""
    named = re.findall(r"#/\$defs/(\w+)", str(field))
    return str(parts[named[0]].get("description", "")) if len(named) == 1 else ""


def _default(field: dict[str, Any]) -> str:
    if field.get("default") is None:
        return ""
    return "see there" if isinstance(field["default"], dict) else f"`{field['default']}`"


def _value(field: dict[str, Any]) -> str:
    """Kind and bounds of an entry, in words."""
    if "$ref" in field:
        part = field["$ref"].rpartition("/")[2]
        return f"[{part}](#{part.lower()})"
    if "enum" in field:
        return ", ".join(f"`{word}`" for word in field["enum"])
    if "const" in field:
        return f"`{field['const']}`"
    for key in ("anyOf", "oneOf"):
        if key in field:
            words = [_value(choice) for choice in field[key] if choice.get("type") != "null"]
            return " or ".join(dict.fromkeys(words))
    if field.get("type") == "array":
        inside = field.get("items") or field.get("prefixItems", [{}])[0]
        return f"list of {_value(inside)}"
    if field.get("type") == "object":
        return f"table of {_value(field.get('additionalProperties', {}))}"
    if field.get("type") == "string":
        return "text with a unit" if "unit" in field.get("description", "") else "text"
    bounds = {
        "exclusiveMinimum": "above",
        "minimum": "from",
        "maximum": "to",
        "exclusiveMaximum": "below",
    }
    limits = [f"{word} {field[key]:g}" for key, word in bounds.items() if key in field]
    kind = {"integer": "whole number", "boolean": "true or false"}.get(
        field.get("type", ""), "number"
    )
    return " ".join([kind, *limits])


def files() -> Iterator[str]:
    """A table for each kind of result file."""
    for kind, table in KINDS.items():
        yield from (
            f"## {kind}",
            "",
            "| name | dimensions | unit | what |",
            "| --- | --- | --- | --- |",
        )
        for name, row in {**table.coords, **table.data}.items():
            unit = _cell(row.unit("that of the objective"))
            yield f"| `{name}` | {', '.join(row.dims)} | {unit} | {_cell(row.long_name)} |"
        yield ""


def _cell(text: str) -> str:
    """Text in one line of a table."""
    return " ".join(text.split()).replace("|", "\\|").replace("[[", "\\[[").replace("<", "&lt;")
