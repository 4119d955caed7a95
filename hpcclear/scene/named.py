"""What study variables and random inputs share: names, and the paths that they drive."""

import re
from collections.abc import Mapping

from hpcclear.base.outcome import JUDGED, ON_REQUEST
from hpcclear.scene.fields import Content, Table, check_known, invalid
from hpcclear.scene.paths import quantities

SHORT_NAMES: Mapping[str, tuple[str, ...]] = {
    "m1": ("mechanism.crank.mass",),
    "u1": ("mechanism.crank.mass_center",),
    "I1": ("mechanism.crank.inertia",),
    "m2": ("mechanism.rod.mass",),
    "u2": ("mechanism.rod.mass_center",),
    "I2": ("mechanism.rod.inertia",),
    "m3": ("mechanism.slider.mass",),
    "C": ("joints.crank_rod.clearance", "joints.rod_slider.clearance"),
    "C12": ("joints.crank_rod.clearance",),
    "C23": ("joints.rod_slider.clearance",),
}
"""Names that stand for scene entries where no path is given; nothing else depends on a name."""

RESERVED = frozenset((
    "sample", "joint", "objective", "objective_spread", "objective_uncertainty", "mean_gap", "peak_contact_force", "latched",
    "rhs_evaluations", "status", "flags", "case", "run", "solution", "design", "model", "mean", "deviation", "label",
    "searched_first", "searched_second", *ON_REQUEST, *JUDGED,
))  # fmt: skip
"""Names of dimensions and results in the datasets."""

NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")
"""What variables, random inputs and cases may be called."""
Range = tuple[float, float]


def resolved_paths(data: Mapping[str, object]) -> tuple[str, ...]:
    """The paths a named row drives, from `paths`, `path` or its name."""
    name = data.get("name")
    if not isinstance(name, str) or not NAME.fullmatch(name) or name in RESERVED:
        reason = "is taken by a result" if name in RESERVED else "is not a name"
        remedy = "Use a letter, then letters, digits or _, and give the path as path = ..."
        raise invalid(reason, remedy)
    if "path" in data and "paths" in data:
        raise invalid("path and paths contradict each other", "Keep one of them", key="path")
    given = data.get("paths", data.get("path"))
    key = "path" if "path" in data else "paths"
    if given is None:
        if name not in SHORT_NAMES:
            remedy = f'Add path = "drive.speed", say; known names are {", ".join(SHORT_NAMES)}'
            raise invalid("is not one of the known names, so it needs a path", remedy)
        return SHORT_NAMES[name]
    paths = texts_in(given)
    if not paths:
        raise invalid("a dotted path or a list of them is expected here", "Write it in quotes", key)
    for path in paths:
        check_known(path, quantities(), "is not a physical number of a scene", key)
    if len(set(paths)) < len(paths):
        raise invalid("a path stands there twice", "Remove one", key=key)
    if len({quantities()[path].unit for path in paths}) > 1:
        raise invalid("the paths have different units", "Use a variable for each unit", key=key)
    return paths


class NamedInput(Table):
    """A named row of the study and the scene entries that get its value."""

    name: str
    paths: tuple[str, ...]
    """Scene entries that are set to its value."""


def with_paths(data: Mapping[str, object]) -> tuple[Content, tuple[str, ...]]:
    """A row of a file with its `paths` resolved, and these; () if it has none already."""
    paths = () if data.get("paths") == () else resolved_paths(data)
    return {key: value for key, value in data.items() if key != "path"} | {"paths": paths}, paths


def paths_of(name: str, row: Mapping[str, object]) -> tuple[str, ...]:
    """Paths of a row of a file, or those of a short name."""
    return texts_in(row.get("paths", row.get("path", SHORT_NAMES.get(name))))


def texts_in(value: object) -> tuple[str, ...]:
    """One text or several, of an entry that is not validated yet."""
    several = (value,) if isinstance(value, str) else value
    if not isinstance(several, (list, tuple)) or not all(isinstance(one, str) for one in several):
        return ()
    return tuple(several)
