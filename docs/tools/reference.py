"""The pages on settings and commands, made of signatures and of the commands' own help."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from contextlib import redirect_stdout, suppress
from pathlib import Path

from ffd_lightning.app.config import LISTS, TrainConfig
from ffd_lightning.app.help import Group, groups_of
from ffd_lightning.app.main import COMMANDS, run
from ffd_lightning.app.settings import default_text
from ffd_lightning.components import Setting

ELSEWHERE = {
    "architecture.md": "ARCHITECTURE.md",
    "changelog.md": "CHANGELOG.md",
    "contributing.md": "CONTRIBUTING.md",
    "benchmarks.md": "benchmarks/README.md",
    "model-card.md": "ffd_lightning/pretrained/README.md",
}
"""Pages of the site that lie elsewhere in the project."""

CONF = Path(__file__).parents[2] / "conf"


def settings_page() -> str:
    """Return the page on everything that `train` can be told, made of what signatures say."""
    lines = [
        "# Settings",
        "",
        "Everything that `ffd train` (`python train.py`) can be told. `group=option` chooses, "
        "`group.setting=value` sets; where there are several values the default is the first, and "
        "`...` means that it must be given. `ffd train --cfg job` prints all with their values. "
        "`prepare` takes the groups `category`, `data`, `preparation` and `paths`; the "
        "settings of all other commands are under [Commands](commands.md).",
        "",
        "This page is made of the code's signatures when the documentation is built.",
        "",
    ]
    for group in groups_of(TrainConfig, [CONF]):
        lines += _group(group)
    return "\n".join(lines)


def _group(group: Group) -> Iterator[str]:
    level = "##" if "." not in group.place else "###"
    yield from (f"{level} {f'`{group.place}`' if group.place else 'Of the whole run'}", "")
    yield from (_text(f"{group.meaning}"), "")
    prefix = f"{group.place}." if group.place else ""
    chosen = f"{group.place.replace('.', '/')}="
    if group.place in LISTS:
        prefix, chosen = f"{prefix}LABEL.", f"{chosen[:-1].removesuffix('s')}="
    plain = [option for option in group.options if not (option.summary or option.settings)]
    told = [option for option in group.options if option not in plain]
    if plain:
        yield from (f"`{chosen}` one of {', '.join(f'`{o.name}`' for o in plain)}.", "")
    for option in told:
        yield from (f"**`{chosen}{option.name}`**", "", _text(option.summary), "")
        yield from _table(option.settings, prefix)
    if group.options and group.settings:
        yield from ("All options:", "")
    yield from _table(group.settings, prefix)


def _table(settings: Mapping[str, Setting], prefix: str) -> Iterator[str]:
    if not settings:
        return
    yield from ("| setting | default | |", "|---|---|---|")
    for name, setting in settings.items():
        values = " ".join(f"`{value}`" for value in default_text(setting).split("|") if value)
        yield f"| `{prefix}{name}` | {values} | {_text(setting.help)} |"
    yield ""


def _text(told: str) -> str:
    """Return what a docstring says as a sentence for a page."""
    told = told[:1].upper() + told[1:]
    return told.replace("<", "&lt;").replace("|", "&#124;")


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
