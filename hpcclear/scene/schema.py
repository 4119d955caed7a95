"""The JSON schema of a scene file, for editors."""

from typing import Any

from hpcclear.scene.scene import Scene


def scene_schema() -> dict[str, Any]:
    """JSON schema (draft 2020-12) of the scene file."""
    schema = Scene.model_json_schema()
    for name in ("Variable", "RandomInput", "Case"):
        row = schema["$defs"][name]
        # The name of a row is the key it stands under; `path` and `paths` are two spellings of one
        # entry.
        del row["properties"]["name"]
        row["required"] = [key for key in row.get("required", []) if key not in ("name", "paths")]
        if "paths" in row["properties"]:
            row["properties"]["path"] = {
                "type": "string",
                "description": "a dotted path of the scene",
            }
            row["properties"]["paths"] = {"type": "array", "items": {"type": "string"}}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **schema,
        "title": "hpcclear scene",
    }
