"""The public surface: what may not change without a word and a minor version of warning.

    python tests/surface.py            writes tests/data/surface.json: of the last release, renewed with each one
    python tests/surface.py --changes  prints what differs from it for those who use it; exit code 1 if anything does

Python names with their parameters, commands with their options, entries of the scene file with units, values and defaults,
variables of result files with dimensions and units, codes. What is new is no change; what is gone or means another thing is.
"""

import importlib
import inspect
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

STORED = Path(__file__).parent / "data" / "surface.json"
MODULES = ("hpcclear", "hpcclear.report")
"""Modules whose `__all__` is public."""
MEMBERS = {"Scene": ("hash", "number", "numeric_paths", "to_toml", "unit", "with_")}
"""What is public of a class besides its constructor."""
Surface = dict[str, dict[str, dict[str, Any]]]


def _parameters(function: Any) -> list[list[str]]:
    """Name, kind and default of each parameter of a function."""
    return [
        [one.name, one.kind.name, "" if one.default is one.empty else _shown(one.default)]
        for one in inspect.signature(function).parameters.values()
        if one.name != "self"
    ]


def _shown(default: Any) -> str:
    """A plain default; others, such as functions and tables, only count as given."""
    return repr(default) if default is None or isinstance(default, str | int | float) else "given"


def python() -> Iterator[tuple[str, dict[str, Any]]]:
    """Public functions, and classes with their constructor and `MEMBERS`."""
    for module in MODULES:
        found = importlib.import_module(module)
        for name in found.__all__:
            thing = getattr(found, name)
            yield f"{module}.{name}", {"parameters": _parameters(thing)}
            for one in MEMBERS.get(name, ()):
                member = inspect.getattr_static(thing, one)
                kept = {"parameters": _parameters(member)} if inspect.isfunction(member) else {}
                yield f"{module}.{name}.{one}", kept


def commands() -> Iterator[tuple[str, dict[str, Any]]]:
    """Commands; their arguments by position and options by name."""
    from hpcclear.cli import cli

    for name, command in cli.every().items():
        arguments = 0
        yield name, {}
        context = command.make_context(name, [], resilient_parsing=True)
        for one in command.to_info_dict(context)["params"]:
            kept = {
                "values": list(one["type"].get("choices", ())),
                "required": one["required"],
                "default": repr(one["default"]) if isinstance(one["default"], str | int | float) else "",
            }  # fmt: skip
            if one["param_type_name"] == "argument":
                arguments += 1
                yield f"{name} argument {arguments}", kept
            for option in [*one["opts"], *one["secondary_opts"]]:
                if option.startswith("-"):
                    yield f"{name} {option}", kept


def scene() -> dict[str, dict[str, Any]]:
    """Entries of the scene file by path, those of all kinds of a table together; NAME is the user's."""
    from hpcclear.scene import scene_schema

    schema = scene_schema()
    found: dict[str, dict[str, Any]] = {}

    def walk(part: dict[str, Any], path: str, above: tuple[str, ...]) -> None:
        entry = found.setdefault(
            path, {"units": [], "values": [], "required": False, "default": ""}
        )
        name = part.get("$ref", "").rpartition("/")[2]
        if name and name not in above:
            walk(schema["$defs"][name], path, (*above, name))
        told = re.search(r"unit of (\S+)", part.get("description", ""))
        fixed = [part["const"]] if "const" in part else part.get("enum", ())
        for key, more in (("units", told.groups() if told else ()), ("values", fixed)):
            entry[key] = sorted({*entry[key], *map(str, more)})
        if not isinstance(part.get("default", {}), dict):
            entry["default"] = json.dumps(part["default"])
        for kind in ("anyOf", "oneOf", "allOf"):
            for one in part.get(kind, ()):
                walk(one, path, above)
        for name, one in part.get("properties", {}).items():
            if one is False:  # refused there, so that a word stands for it
                continue
            place = f"{path}.{name}".lstrip(".")
            walk(one if isinstance(one, dict) else {}, place, above)
            found[place]["required"] |= name in part.get("required", ())
        others = [
            one
            for one in (part.get("additionalProperties"), part.get("items"))
            if isinstance(one, dict)
        ]
        for one in others:
            walk(
                one,
                f"{path}.NAME".lstrip(".") if one is part.get("additionalProperties") else path,
                above,
            )

    walk(schema, "", ())
    return found


def files() -> Iterator[tuple[str, dict[str, Any]]]:
    """Variables of result files."""
    from hpcclear.results.names import KINDS

    for kind, table in KINDS.items():
        for name, one in {**table.coords, **table.data}.items():
            yield (
                f"{kind}: {name}",
                {"dims": list(one.dims), "units": one.units, "dtype": one.dtype},
            )


def codes() -> Iterator[tuple[str, dict[str, Any]]]:
    """Exit codes, and the codes of outcomes and warnings."""
    from hpcclear.base.outcome import Flag, Regime, Status
    from hpcclear.ranks.stopping import Exit

    for kind in (Exit, Status, Flag, Regime):
        for one in kind:
            yield f"{kind.__name__}.{one.name}", {"value": int(one)}


def surface() -> Surface:
    """All of it."""
    parts = {
        "Python": python(),
        "command": commands(),
        "scene": scene().items(),
        "file": files(),
        "code": codes(),
    }
    return {name: dict(entries) for name, entries in parts.items()}


def _differing(before: dict[str, Any], now: dict[str, Any]) -> Iterator[str]:
    """What breaks whoever uses an entry."""
    for key in before:
        old, new = before[key], now.get(key)
        if key == "parameters":
            yield from _broken_calls(old, new)
        elif key == "values":
            if lost := sorted(set(old) - set(new)) if new or not old else ():
                yield f"no longer takes {', '.join(map(str, lost))}"
        elif key == "required":
            if new and not old:
                yield "is required now"
        elif old != new:
            yield f"{key}: {old or 'none'} before, {new or 'none'} now"


def _broken_calls(before: list[list[str]], now: list[list[str]]) -> Iterator[str]:
    known = {name: rest for name, *rest in now}
    for name, kind, default in before:
        if name not in known:
            yield f"parameter {name} is gone"
        elif known[name] != [kind, default] and (default or known[name][0] != kind):
            yield f"parameter {name}: {kind} {default} before, {' '.join(known[name])} now"
    names = [name for name, *_ in before]
    for name, kind, default in now:
        if name not in names and not default and not kind.startswith("VAR"):
            yield f"parameter {name} is new and has no default"
    order = [name for name, kind, _ in now if name in names and kind != "KEYWORD_ONLY"]
    if order != [name for name, kind, _ in before if name in known and kind != "KEYWORD_ONLY"]:
        yield "parameters stand in another order"


def changes(before: Surface, now: Surface) -> list[str]:
    """Sentences on what is gone or has changed since."""
    found = []
    for part, entries in before.items():
        for name, old in entries.items():
            new = now[part].get(name)
            said = ["is gone"] if new is None else _differing(old, new)
            found += [f"{part} {name}: {text}" for text in said]
    return found


def stored() -> Surface:
    """That of the last release."""
    return json.loads(STORED.read_text(encoding="utf-8"))


def main() -> int:
    if "--changes" in sys.argv[1:]:
        found = changes(stored(), surface())
        print("\n".join(found) or "nothing that is public has changed")
        return bool(found)
    lines = []
    for part, entries in surface().items():
        inside = [
            f"  {json.dumps(name)}: {json.dumps(one)}" for name, one in sorted(entries.items())
        ]
        lines.append(f" {json.dumps(part)}: {{\n" + ",\n".join(inside) + "\n }")
    STORED.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
