"""What a machine is called and who answers for it: texts that pages and files show, and that change no result."""

from dataclasses import dataclass
from typing import Annotated

from pydantic.json_schema import JsonSchemaValue

from hpcclear.scene.fields import Content, Converted, Entries, Table, invalid

LONGEST = 120
"""Letters of a text."""


@dataclass(frozen=True)
class ShortText(Converted):
    """A text of one line."""

    def convert(self, value: object) -> str:
        """The text without blanks around it; an error for validators where it is none."""
        if not isinstance(value, str):
            raise invalid("a text is expected here", 'Write it in quotation marks: "B"')
        text = value.strip()
        if not (0 < len(text) <= LONGEST and text.isprintable()):
            raise invalid(f"must be one line of 1 to {LONGEST} letters", "Shorten it, or remove it")
        return text

    def json_schema(self) -> JsonSchemaValue:
        """A text of so many letters."""
        return {"type": "string", "minLength": 1, "maxLength": LONGEST}


def inputs_of(content: Entries) -> Content:
    """Return what results follow from: the content of a scene but for [about]."""
    return {name: table for name, table in content.items() if name != "about"}


class About(Table):
    """What pages, the printed sheet, the terminal and files show of a machine. It changes no result and no hash."""

    title: Annotated[str, ShortText()] | None = None
    """What the study is about, such as "Compressor K12, connecting rod"."""
    author: Annotated[str, ShortText()] | None = None
    """Who answers for it."""
    revision: Annotated[str, ShortText()] | None = None
    """Of the study or drawing, such as "B"."""
    machine: Annotated[str, ShortText()] | None = None
    """The machine, such as its type and serial number."""
