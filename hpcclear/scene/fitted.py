"""Fits of joints in the content of a scene: random inputs that follow them, and entries that stand in each other's place."""

from collections.abc import Iterator, Mapping

from hpcclear.base.errors import at
from hpcclear.base.units import note
from hpcclear.scene.fields import Content, Quantity, Tables, invalid, table_at
from hpcclear.scene.fits import INSTEAD, with_clearance
from hpcclear.scene.named import paths_of
from hpcclear.scene.paths import quantities, replace


def with_fits_of_joints(content: Tables) -> Tables:
    """The content of a file whose random inputs with distribution "fit" say which: that of the joints that they drive."""
    for name, row, joints in _rows_of_fits(content):
        if "fit" in row or not joints:
            continue
        fits = {one["fit"] for one in joints if isinstance(one.get("fit"), str)}
        if len(fits) == 1 and all("fit" in one for one in joints):
            content = replace(content, f"study.random.{name}.fit", fits.pop())
    return content


def with_shares(content: Tables) -> Tables:
    """The content of a file with `half_width = "3 %"` of its random inputs as that share of the number that they scatter about;
    where the study varies that, it stays a share, and the input is `relative`. An error for validators if the number is not
    there.
    """
    variables = table_at(content, "study.variables")
    for name, row in table_at(content, "study.random").items():
        if not isinstance(row, Mapping):
            continue
        variable = variables.get(name)
        given = row.keys() & {"path", "paths"}
        own = row if given or not isinstance(variable, Mapping) else variable
        path = next(iter(paths_of(name, own)), "")
        for key in ("half_width", "deviation"):
            share = row.get(key)
            if not is_share(share) or path not in quantities():
                continue
            where, unit = f"study.random.{name}.{key}", quantities()[path].unit
            if isinstance(variable, Mapping) and "mean" not in row:
                others = [row[k] for k in ("half_width", "deviation") if k in row]
                if not all(map(is_share, others)):
                    reason = "is a share of the design's value, and what stands beside it is none"
                    remedy = f"Write both in % or {f'both in {unit}' if unit else 'none of them'}"
                    raise invalid(reason, remedy, where, share)
                content = replace(content, f"study.random.{name}.relative", True)
                note_share(str(share), unit, "the value that each design has")
                continue
            owner, _, leaf = path.rpartition(".")
            middle = row.get("mean")
            if "mean" not in row:  # that of the file, a clearance by its fit, too
                middle = with_clearance(table_at(content, owner)).get(leaf)
            if middle is None:
                raise invalid(f"no number stands at {path}", "Give that entry first", where, share)
            with at(where, share):
                about = Quantity(unit).number(middle)
                value = abs(about) * Quantity("").number(share)
            note_share(str(share), unit, f"{about:g}")
            content = replace(content, f"study.random.{name}.{key}", value)
    return content


def is_share(entry: object) -> bool:
    """Whether an entry is a text in percent."""
    return isinstance(entry, str) and entry.rstrip().lower().endswith(("%", "‰", "percent", "pct"))


def note_share(share: str, unit: str, about: str) -> None:
    """Note how a percentage is read where the number itself has no unit, so that it might be one of its own."""
    if not unit:
        instead = "for a width of that many hundredths write a plain number"
        note(share, f"{share.strip()} of {about}; {instead}")


def entry_replaced(content: Tables, path: str, value: object) -> Content:
    """The content of a scene with an entry replaced, and without what it stands in place of: a fit takes a clearance's."""
    owner, _, leaf = path.rpartition(".")
    before = table_at(content, owner)
    made = replace(content, path, value)
    if leaf not in INSTEAD or value is None or not before:
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


def _rows_of_fits(content: Tables) -> Iterator[tuple[str, Tables, list[Tables]]]:
    """Random inputs of the distribution "fit": names, rows, and the open joints whose clearances they drive."""
    for name, row in table_at(content, "study.random").items():
        if isinstance(row, Mapping) and row.get("distribution") == "fit":
            owners = (path.rpartition(".")[0] for path in paths_of(name, row))
            joints = [table for owner in owners if (table := table_at(content, owner))]
            yield name, row, [one for one in joints if one.get("kind") != "ideal"]
