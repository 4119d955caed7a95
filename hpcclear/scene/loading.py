"""From a TOML file, or a mapping, to a `Scene`: reading and overrides."""

import ast
import itertools
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

import tomli_w

from hpcclear.base.errors import InputError, content_of
from hpcclear.base.written import Reading
from hpcclear.scene.fitted import entry_replaced
from hpcclear.scene.paths import files_named
from hpcclear.scene.plugged import check_trust, with_texts
from hpcclear.scene.scene import Scene
from hpcclear.scene.syntax import fault
from hpcclear.scene.tables import plain
from hpcclear.scene.validation import DEEPEST, dotted, scene_of

LARGEST_FILE = 1_000_000  # bytes; the paper's own study needs three thousand
_SHORTER = "Scenes have a few thousand bytes"
# tomllib takes quadratic time over one key with very many dots, so such a key is refused before it
# is parsed.
_DOTTED = re.compile(
    r"""(?<![A-Za-z0-9_-])(?:(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){17}"""
)


_NOTE = "# set: "  # before each override, at the head of a scene's text
_CHANGE = "# changed: "  # before each entry that `Scene.with_` replaced, the latest first


def load_scene(
    source: str | Path | Mapping[str, object], overrides: Sequence[str] = (), *, trust: bool = False
) -> Scene:
    """Read and validate a scene.

    Parameters
    ----------
    source : path or mapping
        A TOML file, or its parsed content.
    overrides : sequence of str
        ``"key.path=value"`` entries that replace what the file says; the value is read as TOML if
        it can be, else as a string, so ``joints.crank_rod.clearance=0.5 mm`` needs no quotes.
    trust : bool
        Whether Python text that the content itself carries may be run, as results carry that of plug-ins. Files beside the
        scene file that it names are run without it.

    Raises
    ------
    InputError
        If the file cannot be read or the content makes no mechanism; it names key, value, reason
        and remedy.
    """
    if isinstance(source, Mapping):
        text, content = None, dict(source)
    else:
        text = _read(Path(source))
        content = parse(text, str(source))
    for override in overrides:
        content = entry_replaced(content, *_override(override))
    folder = Path() if isinstance(source, Mapping) else Path(source).parent
    named, read_as = files_named(content), list[Reading]()
    if named:
        from hpcclear.scene.file_curves import with_values  # with the readers of all kinds of files

        filled, read_as = with_values(content, folder)
        content = dict(filled)
    own_plugins = "plugins" in content
    if not trust:
        check_trust(content, "mapping" if text is None else str(source))
    if text is not None and not own_plugins:
        content = with_texts(content, lambda module: _beside(folder, module))
    scene = scene_of(Scene, content)
    notes = "".join(f"{_NOTE}{override}\n" for override in overrides)
    if text is None or named or own_plugins:
        # results carry the values: whoever has one need not have the file
        head = "".join(f"# {line}\n" for line in read_as)
        own = scene.to_toml() if text is None else tomli_w.dumps(content, multiline_strings=True)
        scene._text = head + own
        scene._readings = (*scene.readings, *read_as)
    else:
        # an empty line ends the notes, whatever a file's own first comment says
        own = "\n" + text if text.startswith((_NOTE, _CHANGE)) else text
        plugins = {} if scene.plugins is None else {"plugins": plain(scene.plugins)}
        below = "\n\n" + tomli_w.dumps(plugins, multiline_strings=True) if plugins else ""
        scene._text = notes + own + below
    return scene


def scene_of_text(text: str, name: str) -> Scene:
    """Return the scene of a text that a result file carries, with what was set or changed noted at its head.

    No file is opened, whatever the text names: it may be somebody else's. Python text in it is run in a `trusting` block
    only. Raises InputError as `load_scene`, or if values are in a file, or nobody has said that Python text in it may be run.
    """
    content = parse(text, name)
    notes = list(
        itertools.takewhile(lambda line: line.startswith((_NOTE, _CHANGE)), text.splitlines())
    )
    for line in notes:
        if line.startswith(_NOTE):
            content = entry_replaced(content, *_override(line.removeprefix(_NOTE)))
    changes = dict(_change(line) for line in reversed(notes) if line.startswith(_CHANGE))
    files = [path for path in changes if path.rpartition(".")[2] == "file"]
    for key in (*files_named(content), *files):
        reason = "its scene names a file of values that the result does not contain"
        raise InputError(key, name, reason, "Create the result again with this version")
    changed = content
    for path, value in changes.items():
        changed = entry_replaced(changed, path, value)
    check_trust(content, name)
    check_trust(changed, name)
    scene = load_scene(content, trust=True)
    return scene.with_(changes) if changes else scene


def _change(line: str) -> tuple[str, object]:
    """Path and value of a note that `Scene.with_` left."""
    path, _, value = line.removeprefix(_CHANGE).partition(" = ")
    try:
        return path, ast.literal_eval(value)
    except (ValueError, SyntaxError, RecursionError, MemoryError):
        reason = "the note of a change cannot be read"
        raise InputError("scene", line, reason, "Correct the line, or remove it") from None


def _beside(folder: Path, module: str) -> str | None:
    """The text of a Python file beside the scene file, None where there is none."""
    path = folder / f"{module}.py"
    if not path.exists():
        return None
    return _read(path, "Python file", "Give a plug-in in Python").replace("\r\n", "\n")


def _read(
    path: Path, what: str = "scene file", remedy: str = "Give the path of a TOML scene file"
) -> str:
    try:
        return content_of(path, what, LARGEST_FILE, remedy, _SHORTER).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        reason = f"is not UTF-8 text (byte {error.start})"
        raise InputError(what, str(path), reason, "Save it as UTF-8") from None


def parse(text: str, name: str) -> dict[str, object]:
    """The tables of a TOML text, whatever it holds; `name` says in errors where it stands.

    Raises InputError if it is none, is longer than a scene may be, or nested so deeply that nothing could read it.
    """
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
