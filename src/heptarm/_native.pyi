from collections.abc import Callable
from typing import Any

def exchange_functions(line: tuple[Any, ...], /) -> tuple[Callable[..., Any], Callable[..., Any]]: ...
