"""JSON schema of a case file, with which editors complete and check it."""

from __future__ import annotations

import json
import re
from typing import Any

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core.core_schema import NullableSchema, TupleSchema, WithDefaultSchema

from walkers.inputs.tables.case import CaseFile

_LINK = re.compile(r" See \[\]\(\S+\)\.")
"""Links in the meanings of keys, which the page of keys has to other pages."""


class _Generator(GenerateJsonSchema):
    """A schema without null, which TOML lacks, defaults, which are in SI units, and titles."""

    def normalize_name(self, name: str) -> str:
        """The name of a definition is that of a table: ``Liquid``, not ``LiquidTable``."""
        return super().normalize_name(name).removesuffix("Table")

    def field_title_should_be_set(self, schema: Any) -> bool:  # noqa: ARG002
        return False

    def tuple_schema(self, schema: TupleSchema) -> JsonSchemaValue:
        """A list of fixed length, whose entries are all of one kind.

        Editors read older drafts of JSON Schema, which know ``items`` but not ``prefixItems``.
        """
        schema_of_tuple = super().tuple_schema(schema)
        entries = schema_of_tuple.pop("prefixItems", None)
        if entries:
            schema_of_tuple["items"] = entries[0]
        return schema_of_tuple

    def nullable_schema(self, schema: NullableSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: WithDefaultSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])


def case_schema() -> dict[str, Any]:
    """The schema of a case file, JSON Schema 2020-12.

    It does not say which keys exclude each other. Keys that the library may give are not required.
    """
    with_links = CaseFile.model_json_schema(schema_generator=_Generator)
    schema = json.loads(_LINK.sub("", json.dumps(with_links)))
    schema["properties"]["library"] = {
        "type": "object",
        "description": "Materials and liquids of the case itself.",
    }
    for table in ("Beads", "Liquid", "Contact", "Friction"):  # the library may give their keys
        schema["$defs"][table].pop("required", None)
    return {
        **schema,
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Case file of granular-walkers",
        "required": ["beads", "boundary", "drive", "liquid"],
    }
