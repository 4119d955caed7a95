"""TOML texts to tables; of a text that is none: the line, what it reads, and the line that is likely meant."""

import itertools
import re
import tomllib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from hpcclear.base.errors import InputError, content_of
from hpcclear.base.remarks import remark

LARGEST_FILE = 1_000_000  # bytes; the paper's own study needs three thousand
DEEPEST = 16  # levels of tables and arrays; a scene needs six
_KEY = re.compile(r"[A-Za-z0-9_-]+(?:\.[A-Za-z0-9_-]+)*")
_SHORTER = "Scenes have a few thousand bytes"
# tomllib takes quadratic time over one key with very many dots, so such a key is refused before it
# is parsed.
_DOTTED = re.compile(
    r"""(?<![A-Za-z0-9_-])(?:(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){17}"""
)

_NO_QUOTES = dict.fromkeys(
    map(ord, "\u201c\u201d\u201e\u201f\u00ab\u00bb\u2033\u2018\u2019\u2032"), '"'
)
_NO_SPACES = dict.fromkeys(map(ord, "\u00a0\u2009\u202f\ufeff"), " ")
_NAME = r"""[\w.-]+"""
_HEADER = re.compile(r"\s*\[+\s*([^\]]+?)\s*(?:\]|$)")
_BEGINNING = re.compile(rf"\s*(?:{_NAME}\s*=|\[{_NAME}\]\s*$)")
"""Of a statement or a table."""
_STRING = re.compile(r""""(?:[^"\\]|\\.)*"|'[^']*'|#.*""")


def _quoted(line: str) -> str:
    """A line whose values that are no numbers stand in quotation marks."""
    line = re.sub(r"([\[,]\s*[+-]?\d+),(?=\d+\s*[^\W\d])", r"\1.", line)  # of a number with a unit

    def value(found: re.Match[str]) -> str:
        text = re.sub("[\"']", "", found[2]).strip()
        plain = re.fullmatch(r"[+-]?[\d._\s]+(?:[eE][+-]?\d+)?|true|false|", text)
        return found[0] if plain else f'{found[1]}"{text}"'

    return re.sub(
        r"""(=\s*|[\[,]\s*(?=["\d+-]))([^\[\]{},#=]+?)(?=\s*(?:[\]},#]|$))""", value, line
    )


def _closed(line: str) -> str:
    """A line with the brackets at its ends that it lacks."""
    left: list[str] = []
    for sign in _STRING.sub("", line):
        if sign in "[{":
            left.append("]" if sign == "[" else "}")
        elif sign in "]}" and (not left or left.pop() != sign):
            return "[" + line.strip() if re.fullmatch(rf"\s*{_NAME}\]\s*", line) else line
    return line.rstrip() + "".join(reversed(left))


_MENDS: dict[str, Callable[[str], str]] = {
    "typographic quotation marks": lambda line: line.translate(_NO_QUOTES),
    "spaces that are not plain ones": lambda line: line.translate(_NO_SPACES),
    "no = after the key": lambda line: re.sub(
        rf"^(\s*{_NAME})(?:\s*:|(?=\s))\s*(?!=)", r"\1 = ", line
    ),
    "a decimal comma": lambda line: re.sub(r"(=\s*[+-]?\d+),(?=\d)", r"\1.", line),
    "no digit beside a decimal point": lambda line: re.sub(
        r"(?<![\w.])\.(?=\d)", "0.", re.sub(r"(?<=\d)\.(?!\w)", ".0", line)
    ),
    "signs between the digits": lambda line: re.sub(r"(?<=\d)[ '](?=\d{3}\b)", "", line),
    "a sign after the value": lambda line: re.sub(r"\s*[;,]\s*$", "", line),
    "a capital letter": lambda line: re.sub(r"=\s*(True|False)\b", lambda m: m[0].lower(), line),
    "a backslash between double quotation marks": lambda line: re.sub(
        r'"([^"\']*\\[^"\']*)"', r"'\1'", line
    ),
    "text without quotation marks around it": _quoted,
    "an open bracket": _closed,
}
"""What a line may have that is not TOML, and how it is written."""


def fault(text: str, error: ValueError) -> tuple[str, str]:
    """Return reason and remedy of the first error of a text, as tomllib raised it."""
    lines = text.split("\n")
    if "integer string conversion" in str(error):
        number = next(n for n, one in enumerate(lines, 1) if re.search(r"[\d_]{4300}", one))
        return f"line {number} has a number of more than 4300 digits", "Write 1e300, say"
    place = re.search(r"line (\d+)", str(error))
    number = int(place[1]) if place else len(lines)
    if re.search("Unclosed|at end", str(error)) or _BEGINNING.match(lines[number - 1]):
        number = _opened(lines[:number]) or number
    if 'Expected "\'"' in str(error):
        number = next(n for n, one in enumerate(lines, 1) if "'" in _STRING.sub("", one))
    while number > 1 and not lines[number - 1].strip():
        number -= 1
    line = lines[number - 1]
    read = f"line {number}, {line.strip()[:80]!r},"
    if re.search("overwrite|twice|Duplicate|Cannot mutate|redefine", str(error)):
        return _repeated(lines[:number], read)
    if re.search(r"[\[{(,]\s*$", _STRING.sub("", line)):
        return f"{read} opens a bracket", "Close it, and separate entries in it by commas"
    before = "\n".join(lines[: number - 1])
    for size in (1, 2, 3):
        for names in itertools.combinations(_MENDS, size):
            written = line
            for name in names:
                written = _MENDS[name](written)
            if written != line and _reads(f"{before}\n{written}\n"):
                return f"{read} has {' and '.join(names)}", f"Write {written.strip()}"
    if re.fullmatch(rf"\s*{_NAME}\s*=?\s*", line):
        return f"{read} has no value", f"Write {line.strip(' =')} = value, or remove the line"
    if not _STRING.sub("", line).partition("#")[0].partition("=")[0].isascii():
        return f"{read} has letters beyond a to z in a name", "Use letters a to z, digits and _"
    said = re.sub(r" \(at .*", "", str(error))
    return f"{read} is not valid TOML: {said}", "Write key = value, and text in quotation marks"


def _reads(text: str) -> bool:
    """Whether a text is TOML, but for an array that goes on."""
    try:
        tomllib.loads(text)
    except ValueError as error:
        return "(at end of document)" in str(error) and "string" not in str(error)
    return True


def _opened(lines: list[str]) -> int:
    """The number of the line with a bracket that is still open where the text ends; 0: none."""
    depth = opened = 0
    for number, line in enumerate(lines, 1):
        bare = _STRING.sub("", line)
        if depth > 0 and _BEGINNING.match(bare):
            break
        change = sum(map(bare.count, "[{")) - sum(map(bare.count, "]}"))
        opened = number if depth == 0 and change > 0 else opened
        depth = max(depth + change, 0)
    return opened if depth else 0


def _repeated(lines: list[str], read: str) -> tuple[str, str]:
    """Reason and remedy where the last line gives a key or table again."""
    last = lines[-1]
    if header := _HEADER.match(last):
        name = header[1]
        head, _, key = name.rpartition(".")
    else:
        tables = [_HEADER.match(line) for line in lines]
        head = next((one[1] for one in reversed(tables) if one), "")
        key = last.partition("=")[0].strip()
        name = key
    earlier, table = 0, ""
    for number, line in enumerate(lines[:-1], 1):
        if found := _HEADER.match(line):
            table = found[1]
            earlier = number if table == name else earlier
        elif table == head and re.match(rf"\s*{re.escape(key.partition('.')[0])}\s*[.=]", line):
            earlier = number
    first = f", first in line {earlier}" if earlier else ""
    return f"{read} gives {name} twice{first}", "Keep one of the two" + (
        "; entries of one table stand together" if header else ""
    )


def file_text(path: Path, what: str, remedy: str) -> str:
    """The text of a file; raises InputError where it cannot be read, is longer than a scene may be, or no UTF-8."""
    try:
        return content_of(path, what, LARGEST_FILE, remedy, _SHORTER).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        reason = f"is not UTF-8 text (byte {error.start})"
        raise InputError(what, str(path), reason, "Save it as UTF-8") from None


def parse(text: str, name: str) -> dict[str, object]:
    """The tables of a TOML text, which stands at `name`. Raises InputError where it is none, too long or nested too deeply."""
    where = "scene file", name
    if len(text) > LARGEST_FILE:
        raise InputError(*where, f"is larger than {LARGEST_FILE} bytes", _SHORTER)
    if _DOTTED.search(text):
        raise InputError(*where, "a key has too many dots", f"Nest at most {DEEPEST} tables")
    try:
        return tomllib.loads(text.replace("\r\n", "\n"))
    except RecursionError:
        raise InputError(*where, "is nested too deeply", f"Nest at most {DEEPEST} levels") from None
    except ValueError as error:
        raise InputError(*where, *fault(text.replace("\r\n", "\n"), error)) from None


def overriding(overrides: Sequence[str]) -> Iterator[tuple[str, object]]:
    """Keys and values of ``"key.path=value"`` entries; of two for one entry the last counts, and a remark says so. Raises
    InputError of what is no such entry."""
    given = dict[str, str]()
    for override in overrides:
        key, value = _override(override)
        if given.get(key, override) != override:
            remark(f"Note: {override} replaces {given[key]}")
        given[key] = override
        yield key, value


def _override(text: str) -> tuple[str, object]:
    key, equals, value = (part.strip() for part in text.partition("="))
    if not equals or not dotted(key):
        reason = "is not of the form key.path=value"
        raise InputError("--set", text, reason, "Write, say, --set numerics.rtol=1e-8")
    try:
        parsed = tomllib.loads(f"value = {value}")
    except (ValueError, RecursionError):
        parsed = {}
    # A value with a line break could smuggle in a second key; then it is just a string.
    return key, parsed["value"] if parsed.keys() == {"value"} else value


def dotted(path: object) -> bool:
    """Whether this is a dotted path, no deeper than a scene may be."""
    return isinstance(path, str) and _KEY.fullmatch(path) is not None and path.count(".") < DEEPEST
