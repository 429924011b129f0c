"""The command `ffd`: one name for everything, and `key=value` for every setting."""

import importlib
import inspect
import os
import re
import sys
from collections.abc import Sequence

# Threads of OpenMP that spin while they wait take the cores from the nearest neighbours' own
# threads, and from everything else on a busy machine. Read when torch is loaded.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

# Processes that Lightning starts for further devices get the command's arguments without its name.
_COMMAND = "FFD_LIGHTNING_COMMAND"


COMMANDS = {
    "train": "train and evaluate a run, or a sweep of runs with -m",
    "evaluate": "score a run under a protocol",
    "predict": "reconstruct what photographs show",
    "prepare": "prepare data, without training",
    "sweep": "run a study of sweeps/, from its runs to its report",
    "status": "say what the runs of a folder are doing",
    "report": "write one page about all runs of a folder",
    "figures": "draw the paper's figures of runs",
    "view": "look at reconstructions in a local page",
    "export": "write a trained network small, or as ONNX",
}
"""What each subcommand does; the module of `commands` of its name does it."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the subcommand that the command line names."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if "LOCAL_RANK" in os.environ and _COMMAND in os.environ:
        given.insert(0, os.environ[_COMMAND])
    if not given or given[0] in ("-h", "--help", "help"):
        print(
            "Learn to select a template mesh and deform it into the object that an image shows.\n"
        )
        print(*(f"  ffd {name:<10}{summary}" for name, summary in COMMANDS.items()), sep="\n")
        print("\nSettings are key=value everywhere; ffd COMMAND --help lists them.")
        return
    if given[0] == "--version":
        from ffd_lightning import __version__

        print(__version__)
        return
    if given[0] == "doctor":
        sys.exit("error: ffd doctor is ffd prepare trial=true now")
    if given[0] not in COMMANDS:
        from ffd_lightning.errors import did_you_mean

        hint = did_you_mean(given[0], COMMANDS)
        sys.exit(f"error: no command {given[0]!r}.{hint} Commands: {', '.join(COMMANDS)}")
    run(given[0], given[1:])


def run(name: str, arguments: Sequence[str] | None = None) -> None:
    """Run one of `COMMANDS`, with the arguments of the command line by default; exits."""
    from ffd_lightning.app.messages import shown

    words, home = sys.argv[1:] if arguments is None else arguments, os.path.expanduser("~")
    # A shell expands `~` at the start of a word alone, not that of data.root=~/meshes.
    given = [re.sub(r'(?<=[=\[,"])~(?=/)', lambda _: home, word) for word in words]
    os.environ[_COMMAND] = name
    module = importlib.import_module(f"ffd_lightning.app.commands.{name}")
    schema = getattr(module, "Settings", None)
    if schema is None:  # a Hydra application: it reads its own arguments
        shown(lambda: sys.exit(module.main(given)))
        return

    def command() -> None:
        from ffd_lightning import components
        from ffd_lightning.app.configuration import named_plugins
        from ffd_lightning.app.settings import read_settings, settings_help

        components.load_plugins(named_plugins(given))
        main_setting = getattr(module, "MAIN", "")
        alone = getattr(module, "ALONE", False)  # without a setting there is something to do
        if {"-h", "--help"} & set(given) or not (given or alone):
            listed = settings_help(components.settings_of(schema))
            print(f"{inspect.getdoc(module)}\n\nSettings:\n\n{listed}")
            print(f"  {'plugins=[]':<20}modules with components of your own.")
            return
        own = [argument for argument in given if not argument.startswith("plugins=")]
        sys.exit(module.main(read_settings(schema, own, main_setting)))

    shown(command)
