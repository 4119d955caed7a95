"""From a TOML file, or a mapping, to a `Scene`: reading and overrides."""

import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

import tomli_w

from hpcclear.base.errors import InputError, content_of
from hpcclear.base.plain import plain as printable
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
        text = _read(Path(source), "scene file", "Give the path of a TOML scene file")
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
    scene._readings = (*scene.readings, *read_as)
    # results carry what was set, and the values of files: whoever has one needs nothing else
    notes = [*(f"set: {one}" for one in overrides), *map(str, read_as)]
    head = "".join(f"# {printable(' '.join(note.split()))}\n" for note in notes)
    plugins = {} if scene.plugins is None else {"plugins": plain(scene.plugins)}
    if text is None:
        scene._text = head and head + scene.to_toml()
    elif head or own_plugins:
        scene._text = head + tomli_w.dumps({**content, **plugins}, multiline_strings=True)
    else:
        below = tomli_w.dumps(plugins, multiline_strings=True)
        scene._text = f"{text}\n\n{below}" if plugins else text
    return scene


def scene_of_text(text: str, name: str) -> Scene:
    """Return the scene of a text that a result file carries.

    No file is opened, whatever the text names: it may be somebody else's. Python text in it is run in a `trusting` block
    only. Raises InputError as `load_scene`, or if values are in a file, or nobody has said that Python text in it may be run.
    """
    content = parse(text, name)
    for key in files_named(content):
        reason = "its scene names a file of values that the result does not contain"
        raise InputError(key, name, reason, "Create the result again with this version")
    check_trust(content, name)
    return load_scene(content, trust=True)


def _beside(folder: Path, module: str) -> str | None:
    """The text of a Python file beside the scene file, None where there is none."""
    path = folder / f"{module}.py"
    if not path.exists():
        return None
    return _read(path, "Python file", "Give a plug-in in Python").replace("\r\n", "\n")


def _read(path: Path, what: str, remedy: str) -> str:
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
