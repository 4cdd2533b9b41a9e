"""JSON schema of a case file, with which editors complete and check it."""

from __future__ import annotations

import json
import re
from typing import Any

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core.core_schema import NullableSchema, TupleSchema, WithDefaultSchema

from walkers.inputs.tables.case import CaseFile

_LINK = re.compile(r" See \[\]\(\S+\)\.")  # to a page, from the page of keys


class _Generator(GenerateJsonSchema):
    """Without null, which TOML lacks, without defaults, which are in SI units, and without titles."""

    def normalize_name(self, name: str) -> str:
        """Definitions are named after tables: ``Liquid``, not ``LiquidTable``."""
        return super().normalize_name(name).removesuffix("Table")

    def field_title_should_be_set(self, schema: Any) -> bool:  # noqa: ARG002
        return False

    def tuple_schema(self, schema: TupleSchema) -> JsonSchemaValue:
        """Lists of a fixed length whose entries are alike: older drafts, which editors read, know ``items`` alone."""
        schema_of_tuple = super().tuple_schema(schema)
        if entries := schema_of_tuple.pop("prefixItems", None):
            schema_of_tuple["items"] = entries[0]
        return schema_of_tuple

    def nullable_schema(self, schema: NullableSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: WithDefaultSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])


def case_schema() -> dict[str, Any]:
    """The schema of a case file (JSON Schema 2020-12), without exclusions of keys and values of the library."""
    schema = CaseFile.model_json_schema(schema_generator=_Generator)
    schema = json.loads(_LINK.sub("", json.dumps(schema)))
    schema["properties"]["library"] = {
        "type": "object",
        "description": "Materials and liquids of the case itself.",
    }
    for table in ("Beads", "Liquid", "Contact", "Friction"):  # the library may give what they lack
        schema["$defs"][table].pop("required", None)
    return {
        **schema,
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Case file of granular-walkers",
        "required": ["beads", "boundary", "drive", "liquid"],
    }
