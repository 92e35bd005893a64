"""The plant file's description as a JSON Schema (draft 2020-12), for editors.

Made from ``schema.PLANT``, which the reader walks along, so that both know the same keys. What
relates values to each other (an accuracy above the resolution, names of states) stays with the
reader; what an editor can see is here.
"""

from __future__ import annotations

from typing import Any, Final

from bfppc_synth.expressions.names import (
    ALIASES,
    CONSTANTS,
    FUNCTIONS,
    KEYWORDS,
    LIBRARY_HEADERS,
    RESERVED,
)
from bfppc_synth.spec.availability import is_unavailable
from bfppc_synth.spec.kinds import (
    Choice,
    Either,
    Formula,
    Integer,
    Kind,
    ListOf,
    Number,
    Numbers,
    OneOrPerState,
    Parameters,
    Parity,
    PerState,
    Range,
    Rule,
    Scope,
    Section,
    StateNames,
    Text,
    TextForm,
    Units,
)
from bfppc_synth.spec.schema import MOST_STATES, PLANT
from bfppc_synth.spec.sections import CHANNEL, QUANTIZER, RHO
from bfppc_synth.spec.shapes import NEEDED, OPTIONAL

DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"
IDENTITY: Final = "urn:bfppc-synth:plant:1"
_LONGEST_LINE: Final = 200
_IDENTIFIER: Final = "^[A-Za-z][A-Za-z0-9_]{0,30}$"
_PLANT_NAME: Final = "^[a-z][a-z0-9_]{0,23}$"
_FUNCTIONS: Final = "|".join(sorted([*FUNCTIONS, *ALIASES, *CONSTANTS], key=lambda w: (-len(w), w)))
# A number in quotes is no number: only what has to be computed is a text.
_NO_NUMBER: Final = r"(?!\s*[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?\s*$)"
_SIGNS: Final = r"[0-9.+\-*/^(),\s]|[0-9][eE](?=[-+0-9])"
_CONSTANT: Final = rf"^{_NO_NUMBER}(?:{_SIGNS}|\b(?:{_FUNCTIONS})\b)+$"
_IN_TIME: Final = rf"^(?:{_SIGNS}|[<>=]|\b(?:{_FUNCTIONS}|Piecewise|True|t)\b)+$"
_EXPRESSION: Final = r"^(?!\s*(?:[Tt]rue|[Ff]alse|yes|no|on|off)\s*$)[A-Za-z0-9_.+\-*/^(),<>=\s]+$"
_LIMITS: Final[dict[Rule, dict[str, float]]] = {
    Rule.ANY: {},
    Rule.POSITIVE: {"exclusiveMinimum": 0},
    Rule.NONNEGATIVE: {"minimum": 0},
    Rule.OPEN_SHARE: {"exclusiveMinimum": 0, "exclusiveMaximum": 1},
    Rule.SHARE: {"minimum": 0, "exclusiveMaximum": 1},
}


def json_schema() -> dict[str, Any]:
    """Build the JSON Schema of a plant file.

    Returns
    -------
    dict[str, Any]
        Draft 2020-12. Every key has its description and, where it has one, its default; what
        this version refuses is left out.
    """
    plant = _kind("", PLANT)
    # Objective accuracy looks for the number that every other file has to give.
    performance = plant["properties"]["performance"]
    performance["required"].remove("accuracy")
    asked = {"description": performance["description"], "required": ["accuracy"]}
    words = {"anyOf": [{"const": "accuracy"}, {"type": "object", "required": ["accuracy"]}]}
    seeks = {"properties": {"objective": words}, "required": ["objective"]}
    return {
        "$schema": DIALECT,
        "$id": IDENTITY,
        "title": "bfppc-synth plant file",
        "description": "A strict-feedback plant, what its controller must achieve, and how.",
        **plant,
        "if": {"properties": {"synthesis": seeks}, "required": ["synthesis"]},
        "else": {"properties": {"performance": asked}},
    }


def _kind(path: str, kind: Kind) -> dict[str, Any]:
    match kind:
        case Number(rule=rule):
            return _number(rule)
        case Range():
            pair = {"type": "array", "items": _number(Rule.ANY), "minItems": 2, "maxItems": 2}
            return {"anyOf": [*_number(Rule.ANY)["anyOf"], pair]}
        case Integer():
            return _integer(kind)
        case Text(form=form):
            return _text(form)
        case Formula(scope=scope):
            pattern = _IN_TIME if scope is Scope.TIME else _EXPRESSION
            return {"type": ["number", "string"], "pattern": pattern}
        case Choice(words=words):
            return {"enum": [str(word) for word in words if not is_unavailable(path, str(word))]}
        case StateNames():
            return _state_names()
        case Numbers(rule=rule, fewest=fewest):
            return {"type": "array", "items": _number(rule), "minItems": fewest}
        case Section():
            return _section(path, kind)
        case ListOf(item=item):
            return {"type": "array", "items": _section(path, item)}
        case PerState():
            return _per_state(path, kind)
        case OneOrPerState(item=item):
            return _one_or_per_state(path, item)
        case Parameters():
            return _by_name(_kind(path, Range()), reserved=True)
        case Units():
            return _by_name(_text(TextForm.LINE), reserved=False)
        case Either():
            return _either(path, kind)


def _number(rule: Rule) -> dict[str, Any]:
    return {
        "anyOf": [{"type": "number", **_LIMITS[rule]}, {"type": "string", "pattern": _CONSTANT}]
    }


def _integer(kind: Integer) -> dict[str, Any]:
    if kind.parity is Parity.ODD:
        return {"enum": list(range(kind.lowest, kind.highest + 1, 2))}
    return {"type": "integer", "minimum": kind.lowest, "maximum": kind.highest}


def _text(form: TextForm) -> dict[str, Any]:
    if form is TextForm.PLANT_NAME:
        taken = sorted(KEYWORDS | LIBRARY_HEADERS)
        return {"type": "string", "pattern": _PLANT_NAME, "not": {"enum": taken}}
    return {"type": ["string", "number", "boolean"], "maxLength": _LONGEST_LINE}


def _state_names() -> dict[str, Any]:
    name = {"type": "string", "pattern": _IDENTIFIER, "not": {"enum": sorted(RESERVED)}}
    return {
        "type": "array",
        "items": name,
        "minItems": 1,
        "maxItems": MOST_STATES,
        "uniqueItems": True,
    }


def _by_name(item: dict[str, Any], *, reserved: bool) -> dict[str, Any]:
    names: dict[str, Any] = {"pattern": _IDENTIFIER}
    if reserved:
        names["not"] = {"enum": sorted(RESERVED)}
    return {"type": "object", "propertyNames": names, "additionalProperties": item}


def _section(path: str, section: Section) -> dict[str, Any]:
    properties = {}
    for field in section.fields:
        below = f"{path}.{field.key}" if path else field.key
        if is_unavailable(below, ""):
            continue
        said = field.description
        if field.default and not isinstance(field.kind, Section):
            said += f" (default {field.default})"
        properties[field.key] = {"description": said, **_kind(below, field.kind)}
    schema: dict[str, Any] = {
        "type": "object",
        "properties": properties,
        "additionalProperties": False,
    }
    required = [field.key for field in section.fields if field.required]
    if required:
        schema["required"] = required
    return schema | _relations(section)


def _relations(section: Section) -> dict[str, Any]:
    """Which keys of a section need or exclude each other."""
    if section is CHANNEL:
        unknown = [
            {"if": _given(one, without="g"), "then": {"required": [other]}}
            for one, other in (("g_bound", "g_min"), ("g_min", "g_bound"))
        ]
        return {"anyOf": [{"required": ["f"]}, {"required": ["f_bound"]}], "allOf": unknown}
    if section is not RHO and section is not QUANTIZER:
        return {}
    field = section.field("kind")
    words = field.kind.words if field is not None and isinstance(field.kind, Choice) else ()
    rules: list[dict[str, Any]] = []
    for word in words:
        allowed = ["kind", *NEEDED[word], *OPTIONAL.get(word, ())]
        then: dict[str, Any] = {"propertyNames": {"enum": allowed}}
        if NEEDED[word]:
            then["required"] = list(NEEDED[word])
        chosen = {"properties": {"kind": {"const": str(word)}}, "required": ["kind"]}
        rules.append({"if": chosen, "then": then})
    return {"allOf": rules}


def _given(key: str, *, without: str) -> dict[str, Any]:
    return {"required": [key], "not": {"required": [without]}}


def _per_state(path: str, kind: PerState) -> dict[str, Any]:
    schema = _by_name(_kind(path, kind.item), reserved=False)
    if kind.besides:
        schema["properties"] = {
            field.key: {"description": field.description, **_kind(path, field.kind)}
            for field in kind.besides
        }
    return schema


def _one_or_per_state(path: str, item: Kind) -> dict[str, Any]:
    one, most = _kind(path, item), {"maxItems": MOST_STATES}
    each = {"type": "array", "items": one, **most}
    by_state = _by_name(one, reserved=False)
    if not isinstance(item, Section):
        return {"anyOf": [*one.get("anyOf", [one]), each, by_state]}
    # A section has a word or a number among its values, a mapping by state has sections only.
    is_section = {
        "type": "object",
        "minProperties": 1,
        "not": {"additionalProperties": {"type": "object"}},
    }
    return {
        "type": ["object", "array"],
        "if": is_section,
        "then": one,
        "else": {"if": {"type": "array"}, "then": each, "else": by_state},
    }


def _either(path: str, kind: Either) -> dict[str, Any]:
    *others, last = kind.sections
    chosen = _section(path, last)
    for section in reversed(others):
        owns = [{"required": [field.key]} for field in section.fields]
        chosen = {"if": {"anyOf": owns}, "then": _section(path, section), "else": chosen}
    return {"if": {"type": "object"}, "then": chosen, "else": _kind(path, kind.scalar)}
