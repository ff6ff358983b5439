"""`heptarm completion`: the script with which a shell completes the commands and options."""

from __future__ import annotations

from typing import Annotated, Literal

from cyclopts import Parameter


def completion(
    shell: Annotated[Literal["bash", "zsh", "fish"], Parameter(help="The shell: bash, zsh or fish.")], /
) -> int:
    """Print the script with which a shell completes heptarm's commands and options.

    For example:

        heptarm completion bash > ~/.local/share/bash-completion/completions/heptarm

        heptarm completion zsh > ~/.zfunc/_heptarm

        heptarm completion fish > ~/.config/fish/completions/heptarm.fish
    """
    from heptarm.cli.main import app

    print(app.generate_completion(shell=shell))
    return 0
