"""The JSON schema of a scene file, for editors."""

import ast
import inspect
import itertools
import sys
from collections.abc import Iterator

from pydantic.json_schema import JsonSchemaValue

from hpcclear.base.objectives import ENDS
from hpcclear.scene.contacts.guide import Guide
from hpcclear.scene.fields import NUMBER, OF_FILE, Table
from hpcclear.scene.file_curves import FileCurve
from hpcclear.scene.random_inputs import OURS
from hpcclear.scene.scene import Scene


def _tables(kind: type[Table] = Table) -> Iterator[type[Table]]:
    for table in kind.__subclasses__():
        yield table
        yield from _tables(table)


def _attribute_docs(table: type[Table]) -> dict[str, str]:
    """What stands below each entry of a table in its source."""
    tree = ast.parse(inspect.getsource(sys.modules[table.__module__]))
    classes = (node for node in ast.walk(tree) if isinstance(node, ast.ClassDef))
    (body,) = (node.body for node in classes if node.name == table.__name__)
    docs = {}
    for entry, below in itertools.pairwise(body):
        match entry, below:
            case ast.AnnAssign(target=ast.Name(id=key)), ast.Expr(ast.Constant(str(words))):
                docs[key] = inspect.cleandoc(words)
    return docs


def _describe(definitions: JsonSchemaValue) -> None:
    """Describe entries by the words below them in the source, and put them in the order in which they are read.

    Pydantic can do so itself, but as soon as a table is defined: a fifth of a second of every command, rank and test.
    """
    for table in _tables():
        docs = dict[str, str]()
        for kind in reversed([kind for kind in table.__mro__ if issubclass(kind, Table)]):
            docs |= _attribute_docs(kind)
        entries = definitions.get(table.__name__, {}).get("properties", {})
        for key, entry in entries.items():
            if key in docs:
                entry["description"] = docs[key]
        # the kind first, and what a table shares with others behind its own entries
        own = {key: entries.pop(key) for key in ("kind", *table.__annotations__) if key in entries}
        entries |= own | {key: entries.pop(key) for key in tuple(entries)}


def _as_written(definitions: JsonSchemaValue) -> None:
    """Rows, pairs and rows like others as a file has them."""
    for row in definitions.values():
        if "name" in row["properties"]:  # the key it stands under
            del row["properties"]["name"]
            row["required"] = [k for k in row.get("required", []) if k not in ("name", "paths")]
    for place in ("Position", "NamedPlace", "Components"):
        row = definitions[place]
        number = row["properties"]["x"]
        pair = {"type": "array", "prefixItems": [number, number], "minItems": 2, "maxItems": 2}
        definitions[place] = {"description": row.pop("description"), "anyOf": [row, pair]}
    rows = definitions["Planar"]["properties"]
    for name in ("bodies", "joints"):
        one = rows[name]["additionalProperties"]
        kinds = [choice["$ref"].rpartition("/")[2] for choice in one.get("oneOf", [one])]
        entries = {key: True for kind in kinds for key in definitions[kind]["properties"]}
        like = {"type": "string", "description": f"another of the {name}, whose entries it takes"}
        alike = {
            "type": "object", "properties": {**entries, "like": like}, "required": ["like"],
            "additionalProperties": False,
        }  # fmt: skip
        rows[name]["additionalProperties"] = {"anyOf": [one, alike]}


def _rows_of_catalogues(definitions: JsonSchemaValue) -> None:
    """Rows of catalogues with paths beside their names, costs as lists and by IT grades."""
    row = definitions["CatalogueRow"]
    row["properties"]["name"] = {"type": "string", "description": "name of the row"}
    row["required"], row["additionalProperties"] = ["name"], True  # entries by their paths
    entry = definitions["StudyVariable"]["properties"]["cost"]
    number = {"type": "number"}
    each = {"type": "array", "items": number}
    entry["anyOf"] = [
        {"$ref": "#/$defs/Cost"}, each, {"type": "object", "additionalProperties": number}
    ]  # fmt: skip


def _with_files(schema: JsonSchemaValue) -> JsonSchemaValue:
    """A schema with references to `FileCurve` wherever a curve may come from a file."""
    if schema == OF_FILE:
        return {"$ref": "#/$defs/FileCurve"}
    if isinstance(schema, dict):
        return {key: _with_files(entry) for key, entry in schema.items()}
    return [_with_files(entry) for entry in schema] if isinstance(schema, list) else schema


def scene_schema() -> JsonSchemaValue:
    """JSON schema (draft 2020-12) of scene files: keys and kinds of values. Only `load_scene` checks what makes a mechanism."""
    schema = _with_files(Scene.model_json_schema())
    definitions = schema["$defs"]
    definitions["FileCurve"] = FileCurve.model_json_schema()
    _describe({**definitions, "Scene": schema})
    _as_written(definitions)
    _inputs(definitions)
    _rows_of_catalogues(definitions)
    _cases(definitions)
    for name in ("ClearanceJoint", "PlanarClearance"):  # a fit stands in place of both
        row = definitions[name]
        row["required"] = [k for k in row["required"] if k not in ("clearance", "bearing_radius")]
    definitions["SliderGuide"]["required"] += Guide.needed  # it always has clearance
    effects = definitions["EffectTables"]["properties"]
    for key in ("friction", "guide_friction"):  # one word switches them off
        entry = effects[key]
        choices = entry.get("anyOf", [{"$ref": entry.get("$ref")}])
        kept = {word: entry[word] for word in ("description", "default") if word in entry}
        effects[key] = {"anyOf": [*choices, {"const": "none"}], **kept}
    draft = "https://json-schema.org/draft/2020-12/schema"
    return {"$schema": draft, **schema, "title": "hpcclear scene"}


def _inputs(definitions: JsonSchemaValue) -> None:
    """Variables and random inputs of a study."""
    for name in ("StudyVariable", "RandomInput"):
        entries = definitions[name]["properties"]
        entries["path"] = {"type": "string", "description": "a dotted path of the scene"}
        entries["paths"]["minItems"] = 1
    # parameters of a distribution from elsewhere
    definitions["RandomInput"]["additionalProperties"] = True
    entries = definitions["RandomInput"]["properties"]
    names = {"anyOf": [{"enum": list(OURS)}, {"type": "string"}]}
    entries["distribution"] = {**names, "description": entries["distribution"]["description"]}
    for key, words in (("file", "instead of values: a CSV table beside the scene file"),
                       ("column", "heading of the column in that file; required if there are several")):  # fmt: skip
        entries[key] = {"type": "string", "description": words}


def _cases(definitions: JsonSchemaValue) -> None:
    """Cases of a study with their objectives and constraints, and its accuracy."""
    one_word = {"enum": ["mean", "deviation", "quantile", "cost"]}  # an exceedance needs a limit
    goal = {"anyOf": [one_word, {"$ref": "#/$defs/Goal"}]}
    goals = {"type": "array", "items": goal, "minItems": 1, "maxItems": len(ENDS)}
    entries = definitions["Case"]["properties"]
    entries["objectives"] = {**goals, "description": entries["objectives"]["description"]}
    case = {"anyOf": [{"$ref": "#/$defs/Case"}, definitions["Case"]["properties"]["random"]]}
    study = definitions["Study"]["properties"]
    study["accuracy"]["anyOf"] = [*NUMBER["anyOf"], *study["accuracy"]["anyOf"]]
    study["cases"]["additionalProperties"] = case
