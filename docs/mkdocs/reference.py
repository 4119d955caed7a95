"""Pages of the reference that come from the package itself: `python docs/mkdocs/reference.py` writes them, a test compares.

Commands from their `--help`, entries of a scene from its schema with examples out of the scene files here, result files
from the tables that write them. Each stands between two marks of its page. Long references are several pages by subject;
the first lists the sections of the others, at the anchors that these sections had before.
"""

import re
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import click
import tomli_w

from hpcclear.cli import cli
from hpcclear.results.names import KINDS
from hpcclear.scene import scene_schema

ROOT = Path(__file__).resolve().parents[2]
PAGES = ROOT / "docs" / "reference"
ANY = "NAME"
"""A part of a path that the user chooses."""
LONGEST = 12
"""Lines of an example."""
WIDEST = 140
"""Characters of one of its lines."""


def commands() -> Iterator[str]:
    """The `--help` of every command."""
    for name, command in cli.every().items():
        context = click.Context(command, info_name=f"hpcclear {name}", max_content_width=88)
        yield from (f"## {name}", "", "```text", command.get_help(context), "```", "")


SCENE_PAGES = {
    "scene": ("The file", "[about", "[output", "[plugins"),
    "scene-slider-crank": ("[mechanism] of kind slider-crank", "[mechanism.crank", "[mechanism.slider", "[drive", "[joints"),
    "scene-linkage": ("[mechanism] of kind planar", "[mechanism.bodies", "[mechanism.ground", "[mechanism.joints"),
    "scene-loads": ("[mechanism.drives", "[mechanism.loads"),
    "scene-effects": ("[effects", "[numerics", "[wear"),
    "scene-study": ("[study",),
}  # fmt: skip
"""Pages of a scene's tables, and how the headings on each begin."""

FILES_PAGES = {
    "files": ("bifurcation", "statistics", "wear", "effects", "identify", "timing", "accuracy"),
    "files-response": ("response",),
    "files-samples": ("samples",),
    "files-study": (
        "sensitivity", "kriging", "front", "verification", "chaos", "contributions", "worst", "claims", "readings",
    ),
}  # fmt: skip
"""Pages of result files, and the kinds on each."""

SHARED = 3
"""So many equal entries of two tables are described once."""


def _page_of(heading: str, pages: dict[str, tuple[str, ...]]) -> str:
    return next(page for page, begins in pages.items() if heading.startswith(begins))


def _moved(first: str, pages: dict[str, tuple[str, ...]], headings: list[str]) -> Iterator[str]:
    """The sections of other pages, each at its anchor of the time when all stood on the first."""
    for page in pages:
        if page != first:
            title = (
                (PAGES / f"{page}.md").read_text(encoding="utf-8").partition("\n")[0].strip("# ")
            )
            links = ", ".join(
                f'<a id="{_anchor(one)}" class="moved"></a>[`{one}`]({page}.md#{_anchor(one)})'
                for one in headings
                if _page_of(one, pages) == page
            )
            yield from (f"- **[{title}]({page}.md)**: {links}",)
    yield ""


@cache
def scene_sections() -> dict[str, list[str]]:
    """Every table of a scene file by its heading: its entries, and an example; a part is described where it is first used."""
    schema = scene_schema()
    parts = {"Scene": schema, **schema["$defs"]}
    for name, part in parts.items():  # a pair in a list is the same as a table
        parts[name] = next((one for one in part.get("anyOf", ()) if "properties" in one), part)
        parts[name].setdefault("description", part.get("description", ""))
    places = _places(parts)
    names = {part: _heading(parts[part], paths) for part, paths in places.items()}
    sections: dict[str, list[str]] = {}
    before: dict[str, dict[str, str]] = {}
    for name, paths in places.items():
        part, heading = parts[name], names[name]
        page = _page_of(heading, SCENE_PAGES)
        lines = sections[heading] = [f"## {heading}", "", _cell(part.get("description", "")), ""]
        if paths[1:]:
            lines += ["Also " + ", ".join(f"`[{path}]`" for path in paths[1:]) + ".", ""]
        rows = {}
        for entry, field in part["properties"].items():
            if entry == "kind" and "const" in field and "default" not in field:
                continue  # stands in the heading
            required = entry in part.get("required", ())
            default = "required" if required else _default(field)
            meaning = _cell(field.get("description") or _first_meaning(field, parts))
            rows[entry] = f"| `{entry}` | {_value(field, names, page)} | {default} | {meaning} |"
        equal = {one: [e for e in rows if rows[e] == before[one].get(e)] for one in before}
        most = max(equal, key=lambda one: len(equal[one]), default="")
        shared = equal.get(most, []) if len(equal.get(most, ())) >= SHARED else []
        before[heading] = rows
        if rest := [row for entry, row in rows.items() if entry not in shared]:
            lines += [
                "| entry | value | default | meaning |",
                "| --- | --- | --- | --- |",
                *rest,
                "",
            ]
        if shared:
            words = ", ".join(f"`{entry}`" for entry in shared)
            lines += [f"{words}: as in {_link(most, most, page)}.", ""]
        lines += _example(paths, part)
    return sections


def scene_entries(page: str = "scene") -> Iterator[str]:
    """The tables of a scene on one page."""
    sections = scene_sections()
    if page == "scene":
        yield from _moved(page, SCENE_PAGES, list(sections))
    for heading, lines in sections.items():
        if _page_of(heading, SCENE_PAGES) == page:
            yield from lines


def _link(words: str, heading: str, page: str) -> str:
    """A link from a page to the section of a table."""
    other = _page_of(heading, SCENE_PAGES)
    return f"[`{words}`]({'' if other == page else other + '.md'}#{_anchor(heading)})"


def _places(parts: dict[str, Any]) -> dict[str, list[str]]:
    """Paths of the tables that each part describes, in the order in which a reader meets them."""
    found: dict[str, list[str]] = {"Scene": [""]}
    for name in (queue := ["Scene"]):
        for entry, field in parts[name]["properties"].items():
            below = f".{ANY}" if "additionalProperties" in field else ""
            for part in _named(field):
                if part not in found:
                    queue.append(part)
                    found[part] = []
                new = (f"{path}.{entry}{below}".lstrip(".") for path in found[name])
                found[part] += [path for path in new if path not in found[part]]
    return _depth_first(found)


def _named(field: dict[str, Any]) -> list[str]:
    """Parts that a field may be, the default first."""
    ordered = {key: value for key, value in field.items() if key != "discriminator"}
    return list(dict.fromkeys(re.findall(r"#/\$defs/(\w+)", str(ordered))))


def _depth_first(found: dict[str, list[str]]) -> dict[str, list[str]]:
    """Tables next to those they are part of, as in a file."""
    first = [paths[0] for paths in found.values()]

    def rank(name: str) -> list[int]:
        path = found[name][0].split(".")
        above = [".".join(path[: k + 1]) for k in range(len(path))]
        return [first.index(one) for one in above if one in first]

    return {name: found[name] for name in sorted(found, key=rank)}


def _heading(part: dict[str, Any], paths: list[str]) -> str:
    if not paths[0]:
        return "The file"
    kind = part["properties"].get("kind", {}).get("const")
    return f"[{paths[0]}]" + (f" of kind {kind}" if kind else "")


def _anchor(heading: str) -> str:
    """Where a heading is found, on the site and in the repository alike."""
    return re.sub(r"[^\w\- ]", "", heading).lower().replace(" ", "-")


def _first_meaning(field: dict[str, Any], parts: dict[str, Any]) -> str:
    """What the part that a field refers to is."""
    named = _named(field)
    return str(parts[named[0]].get("description", "")) if len(named) == 1 else ""


def _default(field: dict[str, Any]) -> str:
    if field.get("default") is None:
        return ""
    return "see there" if isinstance(field["default"], dict | list) else f"`{field['default']}`"


def _value(field: dict[str, Any], names: dict[str, str], page: str) -> str:
    """Kind and bounds of an entry, in words."""
    if "$ref" in field:
        heading = names[field["$ref"].rpartition("/")[2]]
        return _link(heading, heading, page)
    if "enum" in field:
        return ", ".join(f"`{word}`" for word in field["enum"])
    if "const" in field:
        return f"`{field['const']}`"
    for key in ("anyOf", "oneOf"):
        if key in field:
            kept = [choice for choice in field[key] if not {"null", "like"} & _shape(choice)]
            return _choice([_value(choice, names, page) for choice in kept])
    if isinstance(field.get("type"), list):
        return _choice([_value({**field, "type": one}, names, page) for one in field["type"]])
    if field.get("type") == "array":
        inside = field.get("items") or field.get("prefixItems", [{}])[0]
        return f"list of {_value(inside, names, page)}"
    if field.get("type") == "object":
        return f"table of {_value(field.get('additionalProperties', {}), names, page)}"
    if field.get("type") == "string" and "%" in field.get("pattern", ""):
        return "text in %"
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


def _choice(words: list[str]) -> str:
    """Alternatives: a number or text with its unit is a quantity or a ratio, and tables differ in their kind alone."""
    words = list(dict.fromkeys(words))
    for text, name in {"text with a unit": "quantity", "text in %": "ratio"}.items():
        if text in words and words[0].startswith("number"):
            words.remove(text)
            words[0] = name + words[0].removeprefix("number")
    kinds = [re.fullmatch(r"\[`(\[.*\]) of kind (.*)`\](\(.*\))", one) for one in words]
    if words[1:] and all(kinds):
        return f"`{kinds[0][1]}` of kind " + ", ".join(
            f"[`{one[2]}`]{one[3]}" for one in kinds if one
        )
    return " or ".join(words)


def _shape(choice: dict[str, Any]) -> set[str]:
    """Its type and needed entries: rows that are like others are told in words."""
    return {str(choice.get("type")), *choice.get("required", ())}


def _example(paths: list[str], part: dict[str, Any]) -> Iterator[str]:
    """The fullest short table of this kind in the scene files, with where it stands."""
    kind = part["properties"].get("kind", {})
    best: tuple[tuple[int, int], str, str] | None = None
    for source, scene in _scenes():
        for path in paths if paths[0] else ():
            for where, table in _tables(scene, path.split("."), []):
                known = set(table) <= set(part["properties"]) or part.get("additionalProperties")
                of_kind = table.get("kind", kind.get("default")) == kind.get("const")
                if not (known and of_kind):
                    continue
                opening = f"[[{where}" if where.endswith("]") else f"[{where}"
                text = "\n".join([f"{opening}]", *_lines(table)])
                rank = (-min(len(table), 6), text.count("\n"))
                narrow = max(map(len, text.split("\n"))) <= WIDEST
                if narrow and text.count("\n") < LONGEST and (best is None or rank < best[0]):
                    best = rank, source, text
    if best is not None:
        yield from (f"```toml from {best[1]}", best[2], "```", "")


def _scenes() -> Iterator[tuple[str, dict[str, Any]]]:
    """Scene files of the repository, and scenes on its pages: tests run all of them."""
    for pattern in (
        "jobs/*.toml",
        "jobs/linkages/*.toml",
        "hpcclear/cli/*.toml",
        "docs/mkdocs/examples/*.toml",
    ):
        for file in sorted(ROOT.glob(pattern)):
            yield str(file.relative_to(ROOT)), tomllib.loads(file.read_text(encoding="utf-8"))
    for page in sorted((ROOT / "docs").glob("*/*.md")):
        for text in re.findall(r"^```toml[^\n]*\n(.*?)^```", page.read_text("utf-8"), re.M | re.S):
            if page.parent != PAGES:
                yield str(page.relative_to(ROOT)), tomllib.loads(text)


def _tables(table: Any, path: list[str], above: list[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Tables at a path, with their own names where it says `ANY`; of a list, its first."""
    if isinstance(table, list) and table:
        table, above = table[0], [*above[:-1], f"{above[-1]}]"]
    if not path:
        if isinstance(table, dict):
            yield ".".join(above), table
        return
    if isinstance(table, dict):
        for name in table if path[0] == ANY else [path[0]]:
            if name in table:
                yield from _tables(table[name], path[1:], [*above, name])


def _lines(table: dict[str, Any]) -> Iterator[str]:
    for name, value in table.items():
        yield f"{name} = {_written(value)}"


def _written(value: Any) -> str:
    """A value as TOML in one line."""
    if isinstance(value, dict):
        return "{ " + ", ".join(_lines(value)) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_written, value)) + "]"
    return tomli_w.dumps({"value": value}).removeprefix("value = ").strip()


def files(page: str = "files") -> Iterator[str]:
    """A table for each kind of result file on one page."""
    if page == "files":
        yield from _moved(page, FILES_PAGES, list(KINDS))
    for kind, table in KINDS.items():
        if _page_of(kind, FILES_PAGES) != page:
            continue
        yield from (
            f"## {kind}",
            "",
            "| name | dimensions | unit | meaning |",
            "| --- | --- | --- | --- |",
        )
        for names, dims, unit, meaning in _alike({**table.coords, **table.data}):
            yield f"| {names} | {dims} | {unit} | {meaning} |"
        yield ""


ORDINALS = "first|second|third|fourth|fifth"


def _alike(rows: dict[str, Any]) -> Iterator[tuple[str, str, str, str]]:
    """Variables of a file: those of several objectives, both ends of an interval, and half-widths are a row each."""
    groups: dict[tuple[str, ...], list[str]] = {}
    meanings: dict[tuple[str, ...], str] = {}
    differs = rf"(?<![a-z])({ORDINALS}|lower|upper)(?![a-z])"
    for name, row in rows.items():
        dims = ", ".join(f"`{one}`" for one in row.dims)
        unit, meaning = _cell(row.unit("that of the objective")), _cell(row.long_name)
        key = re.sub(differs, "", name), dims, unit, re.sub(differs, "", meaning)
        interval = "half-width of the 95 % confidence interval of "
        if meaning == interval + name.removesuffix("_limit"):
            meaning = f"{interval}the variable without `_limit`"
            key = "", dims, "as there", meaning
        groups.setdefault(key, []).append(name)
        meanings.setdefault(key, meaning)
    for key, names in groups.items():
        meaning = meanings[key]
        if names[1:] and names[0].endswith("_lower"):
            meaning = meaning.replace("lower", "lower and upper")
        several = [
            re.search(rf"(?<![a-z])({ORDINALS})(?![a-z])", one) for one in (names[0], names[-1])
        ]
        if len(names) > 2 and all(several):
            words = " to ".join(one[0] for one in several if one)
            meaning = re.sub(rf"\b({ORDINALS})\b", words, meaning)
        yield ", ".join(f"`{name}`" for name in names), key[1], key[2], meaning


def _cell(text: str) -> str:
    """Text in one line of a table."""
    return " ".join(text.split()).replace("|", "\\|").replace("[[", "\\[[").replace("<", "&lt;")


MADE = ("commands", *SCENE_PAGES, *FILES_PAGES)
"""Pages with a generated part."""


def made(name: str) -> Iterator[str]:
    """What is generated of a page."""
    if name in SCENE_PAGES:
        return scene_entries(name)
    return files(name) if name in FILES_PAGES else commands()


def page(name: str) -> tuple[Path, str]:
    """A page, and its text as it should be."""
    path = PAGES / f"{name}.md"
    text = path.read_text(encoding="utf-8")
    begin, end = f"<!-- {name}: begin (docs/mkdocs/reference.py) -->\n", f"<!-- {name}: end -->\n"
    before, _, rest = text.partition(begin)
    after = rest.partition(end)[2]
    lines = "\n".join(line.rstrip() for part in made(name) for line in part.split("\n"))
    return path, f"{before}{begin}\n{lines}\n{end}{after}"


if __name__ == "__main__":
    for each in MADE:
        target, wanted = page(each)
        target.write_text(wanted, encoding="utf-8")
