"""What a name in a scene stands for: one of ours, an installed package's, or one from a file beside the scene."""

import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Generic, TypeVar, cast

from hpcclear.base.errors import InputError, nearest
from hpcclear.plugins.sources import REFERENCE, digest, note_package, run_source, texts_in_use

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint, EntryPoints


_Offered = tuple[object, str, str]
"""What an installed package offers; its name and version."""

Plugin = TypeVar("Plugin")


class Registry(Generic[Plugin]):
    """Plug-ins of one `kind`, such as "contact law", by their names; `group`: of the entry points of installed packages.

    `needs`: attributes that every plug-in of this kind has; what lacks one is refused.
    """

    def __init__(self, kind: str, group: str, needs: tuple[str, ...] = ()) -> None:
        self.kind, self.group, self.needs = kind, group, needs
        self._ours: dict[str, object] = {}
        self._families: list[tuple[re.Pattern[str], Callable[[re.Match[str]], object]]] = []
        self._offered: dict[str, _Offered] = {}

    def add(self, name: str, target: object = None) -> None:
        """Offer one of ours: an object, or None of a name whose object the package has that uses it."""
        assert name not in self._ours, f"two {self.kind}s are called {name}"
        self._ours[name] = target

    def add_family(self, names: re.Pattern[str], maker: Callable[[re.Match[str]], object]) -> None:
        """Offer ours that a number in their name makes: a pattern of their names, and what makes one of a match."""
        self._families.append((names, maker))

    def is_ours(self, name: str) -> bool:
        """Whether a name needs nothing else to be installed, those of families included."""
        return name in self._ours or any(names.fullmatch(name) for names, _ in self._families)

    def ours(self) -> tuple[str, ...]:
        """Names that need nothing else to be installed."""
        return tuple(self._ours)

    def names(self) -> tuple[str, ...]:
        """Our names, then those of installed packages."""
        installed = {point.name for point in self._points()}
        return (*self._ours, *sorted(installed - self._ours.keys()))

    def get(self, name: str, texts: Mapping[str, str] | None = None) -> Plugin:
        """What a name stands for: one of `names`, or ``"module:Name"``.

        `texts`: source texts by module, `Scene.plugin_texts`; while a scene is read, that scene's.
        Raises InputError: there is no such plug-in, its file or package cannot be run, or it lacks what this kind needs.
        """
        if name in self._ours:
            return cast(Plugin, self._ours[name])
        for names, maker in self._families:
            if matched := names.fullmatch(name):
                return cast(Plugin, maker(matched))
        found = REFERENCE.fullmatch(name)
        if found is None:
            value = self._installed(name)
        else:
            known = texts_in_use() if texts is None else texts
            value = self._of_file(name, found[1], found[2], known)
        missing = [one for one in self.needs if not hasattr(value, one)]
        if missing:
            reason = f"has no {', no '.join(missing)}: a {self.kind} needs {', '.join(self.needs)}"
            raise InputError(self.kind, name, reason, "Add what is missing")
        return cast(Plugin, value)

    def origin(self, name: str, texts: Mapping[str, str] | None = None) -> str:
        """Where a plug-in that was taken comes from, in words; "" for one of ours."""
        if self.is_ours(name):
            return ""
        if name in self._offered:
            return "{1} {2}".format(*self._offered[name])
        module = name.partition(":")[0]
        text = (texts_in_use() if texts is None else texts)[module]
        return f"{module}.py, SHA-256 {digest(text)[:12]}"

    def _of_file(self, name: str, module: str, attribute: str, texts: Mapping[str, str]) -> object:
        if module not in texts:
            remedy = f"Write {module}.py into the folder of the scene file. {self._known(name)}"
            reason = f"there is no {module}.py beside the scene file"
            raise InputError(self.kind, name, reason, remedy)
        made = run_source(module, texts[module])
        if not hasattr(made, attribute):
            public = tuple(one for one in vars(made) if not one.startswith("_"))
            reason = f"{module}.py has no {attribute}"
            raise InputError(self.kind, name, reason, nearest(attribute, public))
        return getattr(made, attribute)

    def _installed(self, name: str) -> object:
        if name not in self._offered:
            points = list(self._points(name=name))
            if not points:
                reason = f"is not a known {self.kind}"
                raise InputError(self.kind, name, reason, self._known(name))
            if len({point.value for point in points}) > 1:
                packages = " and ".join(sorted(_package(point)[0] for point in points))
                reason = f"is offered by {packages}"
                raise InputError(self.kind, name, reason, "Uninstall all but one of them")
            self._offered[name] = self._loaded(points[0])
        value, *package = self._offered[name]
        note_package(*package)
        return value

    def _points(self, name: str | None = None) -> "EntryPoints":
        """What installed packages offer of this kind; looking for it takes a tenth of the time of `check`."""
        from importlib.metadata import entry_points

        found = entry_points(group=self.group)
        return found if name is None else found.select(name=name)

    def _loaded(self, point: "EntryPoint") -> _Offered:
        package, version = _package(point)
        try:
            return point.load(), package, version
        except (Exception, SystemExit) as error:
            raise InputError(
                self.kind, point.name,
                f"{package} {version} offers it, but importing it raised {type(error).__name__}: {error}",
                "Repair or reinstall that package",
            ) from error  # fmt: skip

    def _known(self, name: str) -> str:
        """The nearest name, and all."""
        names = self.names()
        close = nearest(name, names)
        listed = ", ".join(names)
        return close if not names or close.startswith("Use") else f"{close} Known: {listed}"


def _package(point: "EntryPoint") -> tuple[str, str]:
    """Name and version of the package that an entry point belongs to."""
    if point.dist is None:
        return point.module, "of unknown version"
    return point.dist.name, point.dist.version
