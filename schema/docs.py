"""Writes docs/reference/protocol.md, protocol-messages.md, protocol-types.md and errors.md from the schema."""

from __future__ import annotations

import re

import key_vectors
from spec import SIZES, Field, Spec


def _table(fields: list[Field]) -> list[str]:
    if not fields:
        return ["No fields.", ""]
    lines = ["| field | type | unit | range | meaning |", "|---|---|---|---|---|"]
    for field in fields:
        note = field.doc + ("; NaN keeps the default" if field.nan and "NaN" not in field.doc else "")
        if field.has_default:
            note += f"; default {field.default}"
        lines.append(
            f"| `{field.name}` | `{field.type.text}` | {field.unit} | {field.range_text} | {note.lstrip('; ')} |"
        )
    return [*lines, ""]


def _linked(text: str, page: str, spec: Spec) -> str:
    """The text of one of the protocol's pages with each link to a heading (`#ping`) to the page where that is."""
    pages = {name.lower(): "protocol-messages.md" for name in spec.messages}
    for kinds in (spec.structs, spec.unions, spec.enums):
        pages |= {name.lower(): "protocol-types.md" for name in kinds}

    def target(found: re.Match[str]) -> str:
        place = pages.get(found[1], "protocol.md")
        return f"](#{found[1]})" if place == page else f"]({place}#{found[1]})"

    return re.sub(r"\]\(#([\w-]+)\)", target, text)


def protocol(spec: Spec) -> str:
    p = spec.protocol
    lines = [
        "# The wire protocol",
        "",
        "Any language can speak the protocol from these pages, which are generated from `schema/protocol.toml`: the rules and the"
        " list of messages here, the fields of each [message](protocol-messages.md), and the [types](protocol-types.md) of the"
        " fields.",
        "",
        f"TCP, port {p['port']}, the cabinet listens. Version {p['major']}.{p['minor']}: equal major versions understand each"
        " other. Everything is big endian, SI units, quaternions x y z w. Poses are of the motion frame in the robot's base frame.",
        "",
        f"A frame is a header of {sum(SIZES[one['type']] for one in spec.header)} bytes and a body of at most"
        f" {p['max_body']} bytes. Any split or merge of the byte stream is legal.",
        "",
        "## Header",
        "",
        "| field | type | meaning |",
        "|---|---|---|",
    ]
    lines += [f"| `{one['name']}` | `{one['type']}` | {one.get('doc', '')} |" for one in spec.header]
    lines += ["", *key_vectors.page(spec)]
    lines += [
        "## Types",
        "",
        "`str` is a u16 count of bytes and UTF-8; `bytes` a u32 count and bytes; `list<T>` a u16 count and the entries;"
        " `opt<T>` a byte 0 or 1 and, with 1, the value; `f64[7]` seven numbers. A union is a byte with the tag and the"
        " member. NaN and infinity are refused except in fields where NaN keeps the default.",
        "",
        "## Messages",
        "",
        "| id | message | from | kind | who | meaning |",
        "|---|---|---|---|---|---|",
    ]
    for message in spec.messages.values():
        lines.append(
            f"| {message.id} | [{message.name}](#{message.name.lower()}) | {message.source} | {message.kind} | {message.role} | {message.doc} |"
        )
    return _linked("\n".join([*lines, ""]), "protocol.md", spec)


def messages(spec: Spec) -> str:
    lines = [
        "# The messages of the protocol",
        "",
        "The fields of each message, in their order; generated from `schema/protocol.toml`. [The wire protocol](protocol.md) has the"
        " rules, [Types](protocol-types.md) what the fields are made of.",
        "",
    ]
    for message in spec.messages.values():
        lines += [f"## {message.name}", "", f"Id {message.id}, {message.kind}. {message.doc}", ""]
        if message.groups:
            lines += [
                "A u16 mask of the groups, then each group whose bit is set, in this order:",
                "",
                "| bit | group |",
                "|---|---|",
            ]
            lines += [
                f"| {number} | `{bit}`: [{kind}](#{kind.lower()}) |" for bit, number, kind in message.groups
            ] + [""]
        else:
            lines += _table(message.fields)
    return _linked("\n".join(lines), "protocol-messages.md", spec)


def types(spec: Spec) -> str:
    lines = [
        "# The types of the protocol",
        "",
        "What the fields of [messages](protocol-messages.md) are made of; generated from `schema/protocol.toml`.",
        "",
        "## Structs",
        "",
    ]
    for struct in spec.structs.values():
        lines += [f"### {struct.name}", "", struct.doc, "", *_table(struct.fields)]
    lines += ["## Unions", ""]
    for union in spec.unions.values():
        lines += [f"### {union.name}", "", union.doc, "", "| tag | member |", "|---|---|"]
        lines += [f"| {tag} | {member} |" for tag, member in union.members] + [""]
    lines += ["## Enumerations", ""]
    for enum in spec.enums.values():
        lines += [
            f"### {enum.name}",
            "",
            f"{enum.doc} `{enum.base}`.",
            "",
            f"| {'bit' if enum.flags else 'value'} | name | meaning |",
            "|---|---|---|",
        ]
        lines += [
            f"| {value['bit' if enum.flags else 'value']} | {value['name']} | {value.get('doc', '')} |"
            for value in enum.values
        ] + [""]
    return _linked("\n".join(lines), "protocol-types.md", spec)


def errors(spec: Spec) -> str:
    lines = [
        "# Errors and what to do",
        "",
        "Every refusal and every failed motion carries a code, the parameter, its value, what is allowed, and a text. `error.page` is"
        " the address of the code's row; on a terminal `heptarm` prints it. Errors that this side finds by itself may have none: their"
        " text has the remedy. This table is generated from `schema/errors.toml`.",
        "",
        "| code | name | Python error | what it means | what to do |",
        "|---|---|---|---|---|",
    ]
    lines += [
        f'| <a id="code-{e["code"]}"></a>{e["code"]} | `{e["name"]}` | `{e["class"]}` | {e["title"]} | {e["advice"]} |'
        for e in spec.errors
    ]
    return "\n".join([*lines, ""])
