"""Fits of joints in the content of a scene: random inputs that follow them, and entries that stand in each other's place."""

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic_core import PydanticCustomError

from hpcclear.scene.fields import Quantity, invalid
from hpcclear.scene.fits import INSTEAD, with_clearance
from hpcclear.scene.named import paths_of
from hpcclear.scene.paths import quantities, replace


def with_fits_of_joints(content: Mapping[str, object]) -> Mapping[str, Any]:
    """The content of a file whose random inputs with distribution "fit" say which: that of the joints that they drive."""
    for name, row, joints in _rows_of_fits(content):
        if "fit" in row or not joints:
            continue
        fits = {one["fit"] for one in joints if isinstance(one.get("fit"), str)}
        if len(fits) == 1 and all("fit" in one for one in joints):
            content = replace(content, f"study.random.{name}.fit", fits.pop())
    return content


def with_shares(content: Mapping[str, object]) -> Mapping[str, Any]:
    """The content of a file with `half_width = "3 %"` of its random inputs as that share of the number that they scatter about;
    where the study varies that, it stays a share, and the input is `relative`.

    Raises
    ------
    PydanticCustomError
        If the number is not there.
    """
    rows = _at(content, "study.random")
    for name, row in rows.items() if isinstance(rows, Mapping) else ():
        for key in ("half_width", "deviation"):
            share = row.get(key) if isinstance(row, Mapping) else None
            if not isinstance(share, str) or not share.rstrip().endswith("%"):
                continue
            where = f"study.random.{name}.{key}"
            path = next(iter(paths_of(name, row)), "")
            if path not in quantities() or not quantities()[path].unit:
                continue  # a percentage is a number of its own there
            if isinstance(_at(content, f"study.variables.{name}"), Mapping) and "mean" not in row:
                others = [row[k] for k in ("half_width", "deviation") if k in row]
                if not all(isinstance(one, str) and one.rstrip().endswith("%") for one in others):
                    raise invalid(
                        "is a share of the design's value, and what stands beside it is none",
                        f"Write both in % or both in {quantities()[path].unit}", where, share,
                    )  # fmt: skip
                content = replace(content, f"study.random.{name}.relative", True)
                continue
            middle = row["mean"] if "mean" in row else _number(content, path)
            if middle is None:
                raise invalid(
                    f"there is no number at {path}", "Give that entry first", where, share
                )
            try:
                about = Quantity(quantities()[path].unit).number(middle)
                value = abs(about) * Quantity("").number(share)
            except PydanticCustomError as error:
                context = error.context or {}
                raise invalid(context["reason"], context["remedy"], where, share) from None
            content = replace(content, f"study.random.{name}.{key}", value)
    return content


def _number(content: Mapping[str, object], path: str) -> Any:
    """What a file has at a path, a clearance by its fit, too."""
    owner, _, leaf = path.rpartition(".")
    table = _at(content, owner)
    return with_clearance(table).get(leaf) if isinstance(table, Mapping) else None


def entry_replaced(content: Mapping[str, object], path: str, value: object) -> dict[str, Any]:
    """The content of a scene with an entry replaced, and without what it stands in place of: a fit takes a clearance's."""
    owner, _, leaf = path.rpartition(".")
    before = _at(content, owner)
    made = replace(content, path, value)
    if leaf not in INSTEAD or value is None or not isinstance(before, Mapping):
        return made
    if leaf in ("clearance", "bearing_radius") and "fit" in before:
        before = with_clearance(before)
    kept = {key: entry for key, entry in before.items() if key not in INSTEAD[leaf]}
    made = replace(made, owner, {**kept, leaf: value})
    if leaf == "fit":
        for name, row, _ in _rows_of_fits(made):
            if f"{owner}.clearance" in paths_of(name, row) and "fit" in row:
                made = replace(made, f"study.random.{name}.fit", None)
    return made


def _at(content: object, path: str) -> object:
    for key in path.split("."):
        content = content.get(key) if isinstance(content, Mapping) else None
    return content


def _rows_of_fits(
    content: Mapping[str, object],
) -> Iterator[tuple[str, Mapping[str, object], list[Mapping[str, object]]]]:
    """Random inputs of the distribution "fit": names, rows, and the open joints whose clearances they drive."""
    rows = _at(content, "study.random")
    for name, row in rows.items() if isinstance(rows, Mapping) else ():
        if isinstance(row, Mapping) and row.get("distribution") == "fit":
            owners = [path.rpartition(".")[0] for path in paths_of(name, row)]
            joints = [one for one in (_at(content, o) for o in owners) if isinstance(one, Mapping)]
            yield name, row, [one for one in joints if one.get("kind") != "ideal"]
