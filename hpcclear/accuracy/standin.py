"""A study for scenes that have none, or none with random inputs: what surrogates and moments are measured on."""

from hpcclear.accuracy.looked_at import mass_of
from hpcclear.scene import Scene
from hpcclear.scene.named import SHORT_NAMES

CASE = "about_the_scene"
WIDTH = 0.2
"""Half-width of a variable's range about the scene's value, relative, where the scene has no study."""
SHARE = 0.05
"""Half-width of a random input about the design, as a share of the variable's range, where a study has none."""


def with_case(scene: Scene) -> tuple[Scene, str, str]:
    """The scene with a study that has a case, the name of the case, and where the study comes from, in words."""
    scene = scene.with_({"numerics.target_error": None})
    if scene.study is not None and scene.study.cases:
        case = scene.study.cases[-1].name
        return scene, case, f"the scene's study, case {case}"
    if scene.study is not None:
        where = f"the scene's study, inputs uniform within {100 * SHARE:.0f} % of their range about a design"
    else:
        scene = scene.with_({"study": {"seed": 1, "variables": _variables(scene)}})
        where = f"no study in the scene: variables within {100 * WIDTH:.0f} % of its values"
    assert scene.study is not None
    names, random = scene.study.optimisation, dict[str, object]()
    for row in scene.study.variables:
        if row.range is not None and row.name in names:
            width = SHARE * (row.range[1] - row.range[0])
            random[row.name] = {"distribution": "uniform", "half_width": width}
    changes = {"study.random": random, "study.cases": {CASE: list(random)}}
    return scene.with_(changes), CASE, where


def _variables(scene: Scene) -> dict[str, object]:
    """Rod mass, slider mass and the clearances, each about the scene's value; of a linkage, the mass of one body."""
    if scene.template is None:
        gaps = [path for path in scene.numeric_paths() if path.endswith(".clearance")]
        paths = {"mass": [mass_of(scene)], **{f"C{k}": [path] for k, path in enumerate(gaps, 1)}}
        return {name: {"paths": one, **_about(scene, one[0])} for name, one in paths.items()}
    known = set(scene.numeric_paths())
    clearances = {scene.number(path) for path in SHORT_NAMES["C"] if path in known}
    names = ["m2", "m3", *(["C"] if len(clearances) == 1 else ["C12", "C23"])]
    first = {name: next(path for path in SHORT_NAMES[name] if path in known) for name in names}
    return {name: _about(scene, path) for name, path in first.items()}


def _about(scene: Scene, path: str) -> dict[str, object]:
    value = scene.number(path)
    return {"range": [(1.0 - WIDTH) * value, (1.0 + WIDTH) * value]}
