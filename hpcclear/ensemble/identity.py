"""What makes a run what it is, so that only the same run goes on from its results."""

import hashlib
import json

from hpcclear.plugins.sources import digest
from hpcclear.results.provenance import program
from hpcclear.scene import Scene
from hpcclear.scene.about import inputs_of
from hpcclear.scene.paths import flatten
from hpcclear.scene.points import Points


def run_key(scene: Scene, command: str) -> dict[str, str]:
    """Return what every run is made of: its scene, the versions and the processor.

    The scene entry by entry, so that a message can name those that changed; besides, all that
    shapes the last bits of a result. The numbers of ranks and of lanes are not among it.
    """
    origin = program()
    entries = {path: json.dumps(value) for path, value in flatten(inputs_of(scene.resolved()))}
    for module, text in scene.plugin_texts.items():
        entries[f"plugins.files.{module}.source"] = f"SHA-256 {digest(text)}"
    made_by = {name: origin[name] for name in ("hpcclear_version", "versions", "processor")}
    return {"command": command, **made_by, **entries}


def sample_key(scene: Scene, points: Points) -> dict[str, str]:
    """The key of `sample`: the run's, and the points themselves."""
    labels = (points.labels,) if points.labels else ()
    named = repr((points.names, points.paths, *labels))
    digest = hashlib.sha256(points.values.tobytes() + named.encode())
    return {**run_key(scene, "sample"), "points": digest.hexdigest()[:16]}
