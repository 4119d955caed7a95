"""Every figure that results allow, by the name that `hpcclear plot` gives it."""

from collections.abc import Callable, Mapping
from functools import partial

from hpcclear.report.figures import response, style
from hpcclear.report.parts import FigureOf, Files, declared
from hpcclear.results.content import Results


def drawings(
    files: Files, responses: Mapping[str, Results]
) -> "dict[str, Callable[[], style.Figure]]":
    """Return what draws each figure that results allow, by its name; several responses stand beside each other in a figure."""
    made = {one.name: one.of(files) for one in declared(FigureOf) if one.kind in files}
    if responses:
        first = next(iter(responses.values()))
        shown = first if len(responses) == 1 else dict(responses)
        made["response"] = partial(response.response_figure, shown)
        made |= {figure.name: partial(figure.draw, shown) for figure in of_response(first)}
    return made


def of_response(found: Results) -> list[FigureOf]:
    """Return the figures that a response allows, beside `response_figure`."""
    every = (one for one in declared(FigureOf) if one.kind == "response")
    return [one for one in every if not one.along or one.along in found.sizes]
