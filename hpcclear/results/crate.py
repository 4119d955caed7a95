"""What a directory of results is, for catalogues and archives: a Process Run Crate (RO-Crate 1.1).

Source: https://w3id.org/ro/crate/1.1 (S. Soiland-Reyes et al., Data Science 5, 2022, doi:10.3233/DS-210053) and the profile
https://w3id.org/ro/wfrun/process/0.5 (S. Leo et al., PLoS ONE 19, 2024, doi:10.1371/journal.pone.0309210).
"""

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from hpcclear.base.errors import InputError
from hpcclear.results import dataset, files
from hpcclear.results.content import Results

NAME = "ro-crate-metadata.json"
CRATE = "https://w3id.org/ro/crate/1.1"
PROFILE = "https://w3id.org/ro/wfrun/process/0.5"
_STATED = ("source", "license", "hpcclear_version", "versions", "processor")


def write_crate(directory: Path, notify: Callable[[str], object] = lambda text: None) -> Path:
    """Write DIRECTORY/ro-crate-metadata.json from what the result files below it say of themselves, and return its path.

    Equal files of equal ages give equal bytes. `notify` gets a sentence for each file that is damaged and left out.
    Raises InputError: there is no result file, all are damaged, or a file of that name says something else: its user may have
    added to it.
    """
    read = dict(dataset.each_in(directory))
    found = {path: one for path, one in read.items() if isinstance(one, Results)}
    for path, one in read.items():
        if isinstance(one, InputError):
            notify(f"{path} is left out: {one.reason}")
            if not found:
                raise one
    place = directory / NAME
    graph = {"@context": f"{CRATE}/context", "@graph": _graph(directory, found)}
    content = (json.dumps(graph, indent=2) + "\n").encode()
    if not (place.is_file() and place.read_bytes() == content):
        files.write_bytes(place, content)
    return place


def _graph(directory: Path, found: Mapping[Path, Results]) -> list[dict[str, Any]]:
    described = [_file(directory, path, content) for path, content in found.items()]
    parts = [{"@id": one["@id"]} for one in described]
    # Scenes of responses are made from the study's; alone they are what was asked for.
    above = [one for path, one in found.items() if path.parent == directory] or found.values()
    scenes = {_stated([one], "scene_hash"): _stated([one], "scene") for one in above}
    everywhere = {name: _stated(found.values(), name) for name in _STATED}
    last = max(path.stat().st_mtime for path in found)
    ended = datetime.fromtimestamp(last, UTC).isoformat(timespec="seconds")
    command = next((str(one["command"].item()) for one in found.values() if "command" in one), "")
    descriptor = {
        "@id": NAME, "@type": "CreativeWork", "about": {"@id": "./"}, "conformsTo": {"@id": CRATE},
    }  # fmt: skip
    root = {
        "@id": "./", "@type": "Dataset", "conformsTo": {"@id": PROFILE},
        "name": f"Results in {directory.resolve().name}",
        "description": f"Simulations of a mechanism with clearance joints, by {everywhere['source']}",
        "datePublished": ended, "license": everywhere["license"], "hasPart": parts, "mentions": {"@id": "#run"},
    }  # fmt: skip
    name = "Process Run Crate"
    profile = {"@id": PROFILE, "@type": "CreativeWork", "name": name, "version": "0.5"}
    program = {
        "@id": "#hpcclear", "@type": "SoftwareApplication", "name": "hpcclear",
        "softwareVersion": everywhere["hpcclear_version"], "softwareRequirements": everywhere["versions"],
        "processorRequirements": everywhere["processor"],
    }  # fmt: skip
    inputs = [
        {
            "@id": "#scene" if len(scenes) == 1 else f"#scene-{number}", "@type": "CreativeWork", "name": "scene file",
            "encodingFormat": "application/toml", "text": text, "identifier": known,
        }
        for number, (known, text) in enumerate(scenes.items(), 1)
    ]  # fmt: skip
    used = [{"@id": one["@id"]} for one in inputs]
    run = {
        "@id": "#run", "@type": "CreateAction", "name": "Simulation", "instrument": {"@id": "#hpcclear"},
        "object": used[0] if len(used) == 1 else used, "result": parts, "endTime": ended,
        **({"description": command} if command else {}),
    }  # fmt: skip
    return [descriptor, root, profile, program, *inputs, run, *described]


def _stated(contents: Iterable[Results], name: str) -> str:
    """What files say of themselves under a name; all of it where they differ."""
    values = dict.fromkeys(str(one.attrs[name]) for one in contents if name in one.attrs)
    return "; ".join(values) or "not stated"


def _file(directory: Path, path: Path, content: Results) -> dict[str, Any]:
    data = path.read_bytes()
    return {
        "@id": path.relative_to(directory).as_posix(), "@type": "File", "name": path.name,
        "description": str(content.attrs.get("title", "not stated")), "encodingFormat": "application/x-netcdf",
        "contentSize": str(len(data)), "sha256": hashlib.sha256(data).hexdigest(),
    }  # fmt: skip
