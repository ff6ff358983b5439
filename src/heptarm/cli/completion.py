"""`heptarm completion`: the script with which a shell completes the commands and options."""

from __future__ import annotations

from typing import Annotated, Literal

from cyclopts import Parameter

from heptarm.errors import CommandRejected


def completion(
    shell: Annotated[
        Literal["bash", "zsh", "fish"] | None,
        Parameter(
            help="The shell: bash, zsh or fish; with --install the one that runs now, if none is given."
        ),
    ] = None,
    /,
    *,
    install: Annotated[
        bool, Parameter(negative="", help="Put it where the shell finds it, and load it at its start.")
    ] = False,
) -> int:
    """Complete heptarm's commands and options in a shell: print the script for it, or install it.

    For example:

        heptarm completion --install

        heptarm completion bash > ~/.local/share/bash-completion/completions/heptarm
    """
    from heptarm.cli.main import app

    if install:
        from cyclopts.completion.detect import ShellDetectionError

        try:
            path = app.install_completion(shell=shell)
        except ShellDetectionError:
            raise CommandRejected(
                "the shell that runs is not known",
                parameter="shell",
                hint="name it: heptarm completion bash --install (or zsh, fish)",
            ) from None
        print(f"{path}: open a new terminal to use it")
        return 0
    if shell is None:
        raise CommandRejected(
            "the shell must be one of bash, zsh, fish",
            parameter="shell",
            hint="heptarm completion bash prints its script; heptarm completion --install installs it",
        )
    print(app.generate_completion(shell=shell))
    return 0
