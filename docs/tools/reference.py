"""The pages on settings and commands, made of the schemas and of the commands' own help."""

from __future__ import annotations

import dataclasses
import io
from collections.abc import Iterator
from contextlib import redirect_stdout, suppress
from pathlib import Path
from typing import Any

from ffd_lightning import registry
from ffd_lightning.app.config import COMMON, GROUPS, TrainConfig
from ffd_lightning.app.help import default_text, first_comment, option_files
from ffd_lightning.app.main import COMMANDS, run
from ffd_lightning.app.settings import setting_meanings

ELSEWHERE = {
    "architecture.md": "ARCHITECTURE.md",
    "changelog.md": "CHANGELOG.md",
    "contributing.md": "CONTRIBUTING.md",
    "benchmarks.md": "benchmarks/README.md",
    "model-card.md": "ffd_lightning/pretrained/README.md",
}
"""Pages of the site that lie elsewhere in the project."""

CONF = Path(__file__).parents[2] / "conf"
_NESTED = {**GROUPS, "regime.terms": "term"}


def settings_page() -> str:
    """Return the page on everything that `train` can be told, made of its schema."""
    lines = [
        "# Settings",
        "",
        "Everything that `ffd train` (`python train.py`) can be told. `group=option` chooses, "
        "`group.setting=value` sets; where there are several values the default is the first, and "
        "`...` means that it must be given. `ffd train --cfg job` prints all with their values. "
        "`prepare` and `doctor` take the groups `category`, `data`, `preparation` and `paths`; the "
        "settings of all other commands are under [Commands](commands.md).",
        "",
        "This page is made of the code's schemas when the documentation is built.",
        "",
    ]
    fields = dataclasses.fields(TrainConfig)
    plain = [f for f in fields if not _is_group(f)]
    told = setting_meanings(TrainConfig)
    lines += ["## Of the whole run", "", *_table(plain, told, "", {"provided", "base"})]
    for f in fields:
        if _is_group(f):
            lines += _group(f)
    return "\n".join(lines)


def _is_group(f: dataclasses.Field[Any]) -> bool:
    return f.name in GROUPS or _schema(f) is not None


def _schema(f: dataclasses.Field[Any]) -> type[Any] | None:
    made: Any = f.default_factory
    return made if isinstance(made, type) and dataclasses.is_dataclass(made) else None


def _group(f: dataclasses.Field[Any]) -> Iterator[str]:
    yield from (f"## `{f.name}`", "")
    schema = _schema(f)
    if schema is not None:
        yield from (_first_paragraph(schema), "")
        files = option_files(f.name, [CONF])
        told = [p for p in files if first_comment(p)]
        if plain := [f"`{p.stem}`" for p in files if p not in told]:
            yield from (f"`{f.name}=` one of {', '.join(plain)}{', or:' if told else '.'}", "")
        if told:
            yield from ("| option | |", "|---|---|")
            yield from (f"| `{f.name}={p.stem}` | {_text(first_comment(p))} |" for p in told)
            yield ""
        yield from _schema_table(schema, f.name)
    for name, kind in _NESTED.items():
        if name == f.name or name.startswith(f"{f.name}."):
            yield from _parts(name, kind)


def _parts(group: str, kind: str) -> Iterator[str]:
    if "." in group:
        yield from (f"### `{group}`", "")
    yield from (f"{registry.KINDS[kind].capitalize()}.", "")
    prefix = f"{group}.LABEL" if kind == "term" else group
    if kind in COMMON:
        yield from ("All options:", "", *_schema_table(COMMON[kind], prefix))
    for entry in registry.entries(kind):
        chosen = f"{prefix}.term={entry.name}" if kind == "term" else f"{group}={entry.name}"
        yield from (f"**`{chosen.replace('regime.selection=', 'regime/selection=')}`**", "")
        yield from (_text(entry.summary), "")
        yield from _schema_table(entry.settings, prefix)


def _schema_table(schema: type[Any], prefix: str) -> Iterator[str]:
    fields = dataclasses.fields(schema)
    inner = {f.name: _schema(f) for f in fields}
    own = [f for f in fields if inner[f.name] is None and f.default_factory is not dict]
    own = [f for f in own if f"{prefix}.{f.name}" not in _NESTED]
    yield from _table(own, setting_meanings(schema), f"{prefix}.", set())
    for name, nested in inner.items():
        if nested is not None:
            yield from _schema_table(nested, f"{prefix}.{name}")


def _table(
    fields: list[dataclasses.Field[Any]], told: dict[str, str], prefix: str, hidden: set[str]
) -> Iterator[str]:
    shown = [f for f in fields if f.name not in hidden]
    if not shown:
        return
    yield from ("| setting | default | |", "|---|---|---|")
    for f in shown:
        values = " ".join(f"`{value}`" for value in default_text(f).split("|") if value)
        yield f"| `{prefix}{f.name}` | {values} | {_text(told.get(f.name, ''))} |"
    yield ""


def _text(told: str) -> str:
    """Return what a docstring says as a sentence for a page."""
    told = told[:1].upper() + told[1:]
    return told.replace("<", "&lt;").replace("|", "&#124;")


def _first_paragraph(schema: type[Any]) -> str:
    return (schema.__doc__ or "").split("\n\n")[0].strip()


def commands_page() -> str:
    """Return the page on the commands: what `ffd COMMAND --help` prints."""
    lines = [
        "# Commands",
        "",
        "`ffd COMMAND` where the package is installed. In a checkout `python train.py` is "
        "`ffd train`; so are `evaluate.py`, `predict.py`, `prepare.py` and `sweep.py`.",
        "",
        "| command | |",
        "|---|---|",
        *(f"| [`ffd {name}`](#ffd-{name}) | {c.summary} |" for name, c in COMMANDS.items()),
        "",
    ]
    for name in COMMANDS:
        printed = io.StringIO()
        with redirect_stdout(printed), suppress(SystemExit):  # Hydra's commands end themselves
            run(name, ["--help"])
        lines += [f"## `ffd {name}`", "", "```text", printed.getvalue().strip(), "```", ""]
    return "\n".join(lines)


MADE = {"configuration.md": settings_page, "commands.md": commands_page}
"""Pages of the site that are made of the code."""
