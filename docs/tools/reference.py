"""The pages on settings and commands, made of signatures and of the commands' own help."""

import io
from collections.abc import Iterator
from contextlib import redirect_stdout, suppress
from pathlib import Path

from ffd_lightning.app.config import TrainConfig
from ffd_lightning.app.help import Section, sections
from ffd_lightning.app.main import COMMANDS, run
from ffd_lightning.app.settings import default_text

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
    for section in sections(TrainConfig, [CONF]):
        lines += _section(section)
    return "\n".join(lines)


def _section(section: Section) -> Iterator[str]:
    group, _, option = section.title.partition("=")
    if option:
        yield from (f"**`{section.title}`**", "")
    else:
        level = "##" if group.isidentifier() or not group else "###"
        yield from (f"{level} {f'`{group}`' if group else 'Of the whole run'}", "")
    yield from (_text(section.text), "")
    plain = [f"`{name}`" for name, text in section.options.items() if not text]
    if plain:
        yield from (f"`{section.title}` one of {', '.join(plain)}.", "")
    for name, text in section.options.items():
        if text:
            yield from (f"**`{section.title}{name}`**", "", _text(text), "")
    if section.settings:
        yield from ("| setting | default | |", "|---|---|---|")
    for name, setting in section.settings.items():
        values = " ".join(f"`{value}`" for value in default_text(setting).split("|") if value)
        yield f"| `{name}` | {values} | {_text(setting.help)} |"
    yield ""


def _text(text: str) -> str:
    """Return what a docstring says as a sentence for a page."""
    text = text[:1].upper() + text[1:]
    return text.replace("<", "&lt;").replace("|", "&#124;")


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
        *(f"| [`ffd {name}`](#ffd-{name}) | {text} |" for name, text in COMMANDS.items()),
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
