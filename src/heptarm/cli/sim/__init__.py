"""`heptarm sim`: virtual cabinets, foreign applications on one (`sim app`), a bare FRI controller (`sim fri`).

Each of the three commands is one function with options of its own; what two of them have in common is a frozen value in
`options`. `child` runs a cabinet as a process and lets a person at the terminal be its operator; `page` opens the
view or the panel beside it.
"""

from __future__ import annotations

from cyclopts import App, Parameter

from heptarm.cli.sim.application import application
from heptarm.cli.sim.cabinet import sim
from heptarm.cli.sim.fri import fri

app = App(name="sim")
app.default(sim)
app.command(application, name="app")
app.command(fri, name="fri")

_NO_DOUBLES = Parameter(negative=())
#: The commands in the words that a user types, and the argument that makes one of the first.
_COMMANDS = {"app": "heptarm sim app FOLDER", "fri": "heptarm sim fri VERSION", "": "heptarm sim"}
#: Options that made a command of `heptarm sim` before the command had a word of its own; the first still does.
_OLDER = {"--app": "app", "--fri": "fri"}
_REASONS = {
    "--panel": "the panel commands the arm, which your application does; --view shows it",
    "--count": "one application runs on one cabinet",
}
_FRI_BESIDE_APP = "an FRI session is opened by the application itself"
_NO_CABINET = "there is no cabinet application"


def explain_refusal(command: str, option: str) -> str:
    """Say why a command does not take an option of another one; empty: no other one has it either.

    Args:
        command: "", "app" or "fri".
        option: as typed, without its value.
    """
    known = (name for name in _COMMANDS if name != command and option in _options(name))
    owner = _OLDER.get(option) or next(known, None)
    if owner is None or owner == command:
        return ""
    if not command:
        return f"{option} needs {_COMMANDS[owner]}"
    if command == "fri":
        reason = _NO_CABINET
    elif owner == "fri":
        reason = _FRI_BESIDE_APP
    else:
        reason = _REASONS[option]
    return f"{option} cannot be used with heptarm sim {command}: {reason}"


def _options(command: str) -> set[str]:
    found = app[command] if command else app
    return {
        name
        for argument in found.assemble_argument_collection(default_parameter=_NO_DOUBLES)
        for name in argument.names
    }
