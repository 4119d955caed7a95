"""The JSON schema of a scene file, for editors."""

from typing import Any

from hpcclear.scene.scene import Scene

_NUMBER = {"anyOf": [{"type": "number"}, {"type": "string"}]}
_BOUNDS = {"type": "array", "items": _NUMBER, "minItems": 2, "maxItems": 2}


def scene_schema() -> dict[str, Any]:
    """JSON schema (draft 2020-12) of the scene file.

    It says which keys and kinds of values there are; what makes a mechanism is checked by
    `load_scene` alone.
    """
    schema = Scene.model_json_schema()
    definitions = schema["$defs"]
    for name in ("Variable", "RandomInput", "Case"):
        row = definitions[name]
        # The name of a row is the key it stands under.
        del row["properties"]["name"]
        row["required"] = [key for key in row.get("required", []) if key not in ("name", "paths")]
    for name in ("Variable", "RandomInput"):
        entries = definitions[name]["properties"]
        # Entries whose unit depends on the path are converted before their fields see them.
        for key in {"range", "ratio", "mean", "half_width", "deviation"} & entries.keys():
            bounds = _BOUNDS if key in ("range", "ratio") else _NUMBER
            entries[key] = {**bounds, "description": entries[key].get("description", "bounds, SI")}
        if "values" in entries:
            entries["values"] = {
                "type": "array", "items": _NUMBER, "minItems": 2,
                "description": entries["values"].get("description", ""),
            }  # fmt: skip
        entries["path"] = {"type": "string", "description": "a dotted path of the scene"}
        entries["paths"] = {"type": "array", "items": {"type": "string"}, "minItems": 1}
    effects = definitions["Effects"]["properties"]
    for key in ("friction", "guide_friction"):  # one word switches them off
        entry = effects[key]
        choices = entry.get("anyOf", [{"$ref": entry.get("$ref")}])
        kept = {word: entry[word] for word in ("description", "default") if word in entry}
        effects[key] = {"anyOf": [*choices, {"const": "none"}], **kept}
    case = {"anyOf": [{"$ref": "#/$defs/Case"}, definitions["Case"]["properties"]["random"]]}
    definitions["Study"]["properties"]["cases"]["additionalProperties"] = case
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **schema,
        "title": "hpcclear scene",
    }
