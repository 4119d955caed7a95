"""What is wrong with a file that was read: names, dimensions and types that its table has not, outcomes that cannot be."""

import numpy as np

from hpcclear.base.outcome import JUDGED, NUMBERS, Status
from hpcclear.results.content import Results
from hpcclear.results.names import KINDS, LIMIT, ROLE, designs_in
from hpcclear.results.rows import FileVariable


def fault_of(content: Results, kind: str | None) -> str | None:
    """What is wrong with what was read, or None."""
    found = content.attrs.get("hpcclear_kind")
    if not isinstance(found, str) or found not in KINDS:
        return "it does not say which kind of result it holds"
    if kind is not None and found != kind:
        return f"it holds {found}, not {kind}"
    table = KINDS[found]
    missing = (table.required | (set(table.coords) - {*table.optional})) - set(content.variables)
    if missing:
        return f"it lacks {', '.join(sorted(missing))}"
    for name, variable in content.variables.items():
        row = table.coords.get(name) or table.data.get(name)
        if row is None:
            roles = {ROLE: table.design_dims, LIMIT: table.limit_dims}
            dims = roles.get(str(variable.attrs.get("role")))
            if dims is None:
                return f"it holds {name}, which {found} has not"
            if not isinstance(variable.attrs.get("scene_path"), str):
                return f"{name} does not say which scene path it is"
            row = FileVariable(dims, "", "", "f8")
        if variable.dims != row.dims:
            return f"{name} has dimensions {variable.dims}, not {row.dims}"
        kinds = {"f8": "f", "i8": "i", "i1": "i", "text": "U"}
        if variable.values.dtype.kind != kinds[row.dtype]:
            return f"{name} has type {variable.values.dtype}, not {row.dtype}"
        if name in table.coords and row.dtype == "f8" and not np.isfinite(variable.values).all():
            return f"{name} is not finite everywhere"
    return _outcome_fault(content) if "status" in content else None


def _outcome_fault(content: Results) -> str | None:
    """Outcomes that cannot be, such as a number in a failed sample."""
    status = content["status"].values
    if not np.isin(status, [int(code) for code in Status]).all():
        return "a status is unknown"
    finished = status == Status.OK
    if "objective" in content and (finished & ~np.isfinite(content["objective"].values)).any():
        return "a finished simulation has no objective"
    for name in NUMBERS:
        judged = name not in JUDGED or "regime" in content  # 0 where nobody looked
        there = judged and name in content and name not in content.sizes
        if there and not np.isnan(content[name].values[~finished]).all():
            return f"a failed simulation has a number in {name}"
    if "sample" in content:
        samples = content["sample"].values
        if (samples < 0).any() or (np.diff(samples) <= 0).any():
            return "sample numbers are not in order"
        if not all(np.isfinite(values).all() for values in designs_in(content).values()):
            return "a design is not finite"
    return None
