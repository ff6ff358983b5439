"""Compiled control laws: functions that the native loop calls without Python.

`law` compiles a Python function with Numba, `law_from` takes a function from a shared library in C or C++. The process
of the loop compiles and loads them when the client starts, before any cabinet is asked for a session.
"""

from __future__ import annotations

import ctypes
import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, overload

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected
from heptarm.fri.loop import law_interface as interface
from heptarm.fri.loop import parameters
from heptarm.fri.loop.user_api import Params
from heptarm.fri.loop.wrench import external_wrench
from heptarm.values.checks import callback, instance, within
from heptarm.values.robot import RobotModel, robot
from heptarm.values.sealed import Sealed

#: Number of arguments of a law with memory: state, output, parameters, memory.
WITH_MEMORY = 4
_Numbers = Mapping[str, interface.Given]
_Initial = Mapping[str, interface.Initial]


def include_dir() -> Path:
    """Folder of heptarm_law.h, for the compiler of a law in C or C++: `-I` and this folder."""
    return Path(__file__).resolve().with_name("include")


class CompiledLaw(Sealed):
    """A law that the native loop calls.

    Args:
        params: parameters and their initial values; those of the session replace them.
        memory: members of its memory and their initial values; those of the session replace them.

    Attributes:
        success: what its function returns unless it has failed.
        kind: of the sessions that it is written for: "torque", "position" or "wrench"; empty: not known.
    """

    success = 0
    kind: str = ""
    params: Final[dict[str, Any]]
    memory: Final[dict[str, Any]]

    def __init__(self, params: _Initial | None = None, memory: _Numbers | None = None) -> None:
        _check(params, memory)
        self.params = dict(params or {})
        self.memory = dict(memory or {})

    def parameters(self, arm: RobotModel) -> Mapping[str, Any]:
        """Parameters and their initial values for a robot."""
        return self.params

    def load(self, params: interface.Schema, memory: interface.Schema) -> tuple[int, object]:
        """Compile or load the law in this process.

        Args:
            params: schema of its parameters.
            memory: schema of its memory.

        Returns:
            Address of its function, and what has to live as long as the function.

        Raises:
            CommandRejected: it cannot be compiled or loaded; the text has the place and the hint a remedy.
        """
        raise NotImplementedError


def _check(params: _Initial | None, memory: _Numbers | None) -> None:
    """Check that both are numbers and arrays by name, or None."""
    for values, what in ((params, "params"), (memory, "memory")):
        if values is not None:
            interface.flat(values, what)


def arity(function: Callable[..., object]) -> int:
    """Number of positional arguments that a law takes; 3 if its signature is unknown."""
    try:
        found = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return WITH_MEMORY - 1
    return sum(
        argument.kind in (argument.POSITIONAL_ONLY, argument.POSITIONAL_OR_KEYWORD) for argument in found
    )


class NumbaLaw(CompiledLaw):
    """A Python function that Numba compiles; made by `law`. Called directly, it runs in Python.

    Args:
        function: `function(state, out, params)` or `function(state, out, params, memory)`.
        params: see `CompiledLaw`.
        memory: see `CompiledLaw`.
    """

    success = 1  # Numba's function returns 0 after an exception

    def __init__(
        self,
        function: Callable[..., object],
        params: _Initial | None = None,
        memory: _Numbers | None = None,
    ) -> None:
        super().__init__(params, memory)
        functools.update_wrapper(self, callback(function, "function"))
        self._function = function

    def __call__(self, *arguments: object) -> object:
        """Run it in Python, for a test."""
        return self._function(*arguments)

    def load(self, params: interface.Schema, memory: interface.Schema) -> tuple[int, object]:
        """Compile it with Numba; see `CompiledLaw.load`."""
        try:
            from heptarm.fri.loop import numba_law
        except ImportError as error:
            raise CommandRejected(
                f"a law with @ha.law needs Numba: {error}",
                parameter="law",
                hint='install it with `pip install "heptarm[laws]"`, or leave out @ha.law: the law then runs in Python',
            ) from None
        return numba_law.compiled(
            self._function, params, memory, takes_memory=arity(self._function) >= WITH_MEMORY
        )


@overload
def law(function: Callable[..., object]) -> NumbaLaw: ...


@overload
def law(
    *, params: _Initial | None = None, memory: _Numbers | None = None
) -> Callable[[Callable[..., object]], NumbaLaw]: ...


def law(
    function: Callable[..., object] | None = None,
    *,
    params: _Initial | None = None,
    memory: _Numbers | None = None,
) -> NumbaLaw | Callable[[Callable[..., object]], NumbaLaw]:
    """Compile a law with Numba when its session opens; the loop then calls it without Python.

    ::

        @ha.law(memory={"x": np.zeros(7)})
        def spring(s, out, p, m):
            m.x = m.x + s.dt * (p.goal - m.x) / p.tau
            out.tau[:] = p.k * (m.x - s.q) - p.d * s.dq

    Args:
        function: `function(state, out, params)` or `function(state, out, params, memory)`.
        params: parameters and their initial values; those of `arm.fri(..., params=...)` replace them.
        memory: members of the law's memory and their initial values; those of `arm.fri(..., memory=...)` replace them.

    Raises:
        ShapeError: params or memory are not numbers and arrays by name.
    """
    if function is not None:
        return NumbaLaw(function, params, memory)
    _check(params, memory)
    return lambda given: NumbaLaw(given, params, memory)


class LibraryLaw(CompiledLaw):
    """A function of a shared library; made by `law_from`.

    Args:
        path: of the library.
        name: of the function.
        params: see `CompiledLaw`.
        memory: see `CompiledLaw`.
    """

    path: Path
    name: Final[str]

    def __init__(
        self, path: Path, name: str, params: _Initial | None = None, memory: _Numbers | None = None
    ) -> None:
        super().__init__(params, memory)
        self.path, self.name = path, name

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name} of {self.path}>"

    def load(self, params: interface.Schema, memory: interface.Schema) -> tuple[int, object]:
        """Load the library and check its structures; see `CompiledLaw.load`."""
        try:
            library = ctypes.CDLL(str(self.path))
        except OSError as error:
            raise CommandRejected(
                f"the library of the law cannot be loaded: {error}",
                parameter="law",
                hint="build it for this machine with -shared -fPIC",
            ) from None
        try:
            function = getattr(library, self.name)
            checks = (ctypes.c_int64 * 3).in_dll(library, f"{self.name}_check")
        except (AttributeError, ValueError):
            raise CommandRejected(
                f"{self.path.name} exports no law {self.name!r}",
                parameter="law",
                hint=f"write HEPTARM_LAW({self.name}, ...) of heptarm_law.h at the end of its source",
            ) from None
        version, *sizes = checks
        if version != interface.VERSION:
            raise CommandRejected(
                f"{self.path.name} was built with version {version} of heptarm_law.h, this loop needs "
                f"{interface.VERSION}",
                parameter="law",
                hint="build it again with the header of this installation: heptarm.fri.include_dir()",
            )
        for what, size, schema in (("params", sizes[0], params), ("memory", sizes[1], memory)):
            given = 8 * interface.size(schema)
            if given != size and not (given == 0 and size == 8):
                members = ", ".join(f"{name}{list(shape) or ''}" for name, (shape, _) in schema.items())
                raise CommandRejected(
                    f"the {what} of {self.name} in {self.path.name} have {size} bytes, {what}= has {given}: "
                    f"{members or 'nothing'}",
                    parameter="law",
                    hint=f"{what}= and the structure in C have the same members in the same order, all of type double",
                )
        address = ctypes.cast(function, ctypes.c_void_p).value
        assert address is not None
        return address, library


def law_from(
    path: str | Path, name: str, *, params: _Initial | None = None, memory: _Numbers | None = None
) -> LibraryLaw:
    """Take a law from a shared library in C or C++, which was built with heptarm_law.h; see `include_dir`.

    Args:
        path: of the library.
        name: first argument of HEPTARM_LAW in its source.
        params: parameters and their initial values, in the order of the structure in C.
        memory: members of its memory and their initial values, in the order of the structure in C.

    Raises:
        CommandRejected: there is no such file.
        ShapeError: params or memory are not numbers and arrays by name.
    """
    file = Path(instance(path, (str, Path), "path")).expanduser().resolve()
    instance(name, str, "name")
    if not file.is_file():
        raise CommandRejected(
            f"there is no library {file}",
            parameter="path",
            value=str(path),
            hint=f"build it: cc -O2 -shared -fPIC -I{include_dir()} -o {file.name} ...",
        )
    return LibraryLaw(file, name, params, memory)


class LawTrial(Sealed):
    """A compiled law in this process, called with states of your own: for tests, simulations and plots.

    A law that crashes ends this process; in a session it does not.

    Args:
        compiled: the law.
        params: parameters, in place of the law's.
        memory: memory, in place of the law's.
        model: robot, for laws that need its model.
        dt: command period [s].

    Attributes:
        params: parameters; assign to them between calls, and the law sees them follow at their rates.
        memory: memory; read it or assign to it between calls.
        t: time of the next call [s].

    Raises:
        CommandRejected: the law cannot be compiled or loaded.
    """

    params: Final[Params]
    memory: Final[interface.Memory]
    t: float

    def __init__(
        self,
        compiled: CompiledLaw,
        *,
        params: _Initial | None = None,
        memory: _Numbers | None = None,
        model: str | RobotModel = "iiwa14",
        dt: float = 1e-3,
    ) -> None:
        self._law = instance(compiled, CompiledLaw, "compiled")
        _check(params, memory)
        arm = robot(model) if isinstance(model, str) else instance(model, RobotModel, "model")
        self._dt = within(dt, "dt", 1e-6, 1.0, unit="s")
        declared = parameters.merged(compiled.parameters(arm), params)
        values, schema = interface.flat(declared, "params")
        kept, remembered = interface.flat({**compiled.memory, **(memory or {})}, "memory")
        address, self._kept = compiled.load(schema, remembered)
        self._function = ctypes.CFUNCTYPE(ctypes.c_int, *[ctypes.c_void_p] * 4)(address)
        self._params, self._memory = np.append(values, 0.0), np.append(kept, 0.0)
        self._follower = parameters.RateLimiter(self._params[:-1], parameters.rates(declared))
        self.params = Params(self._follower.target, schema, changed=lambda: None, declared=declared)
        self.memory = interface.Memory(self._memory, remembered)
        self._state = np.full(_words(interface.STATE), np.nan)
        self._arm = arm
        self._command = np.zeros(_words(interface.COMMAND))
        self._shown = interface.Memory(self._state, _places(interface.STATE))
        self._made = interface.Memory(self._command, _places(interface.COMMAND))
        self.t = 0.0

    def __call__(
        self,
        q: npt.ArrayLike,
        dq: npt.ArrayLike | None = None,
        *,
        q_ipo: npt.ArrayLike | None = None,
        tau_ext: npt.ArrayLike | None = None,
    ) -> interface.Memory:
        """Call the law for the next cycle.

        Args:
            q: measured positions, shape (7,) [rad].
            dq: velocities, shape (7,) [rad/s]; None: zero.
            q_ipo: interpolator's positions, shape (7,) [rad]; None: those of the first call.
            tau_ext: external torques, shape (7,) [Nm]; None: zero. The law's `wrench` is estimated from them.

        Returns:
            Its command: `q`, `tau`, `wrench`; the arrays are overwritten by the next call.

        Raises:
            CommandRejected: the law has failed.
        """
        shown, out = self._shown, self._made
        shown.q, shown.dq = q, np.zeros(7) if dq is None else dq
        shown.tau_ext, shown.wrench = np.zeros(7), np.zeros(6)
        if tau_ext is not None:
            shown.tau_ext = tau_ext
            shown.wrench = external_wrench(self._arm, q, tau_ext)
        if q_ipo is not None or self.t == 0.0:
            shown.q_ipo = q if q_ipo is None else q_ipo
        shown.t, shown.dt = self.t, self._dt
        self._state.view(np.int64)[_words(interface.STATE[:_FLOATS]) :] = 0
        out.q, out.tau, out.wrench = shown.q_ipo, 0.0, 0.0
        out.pose, out.e1 = np.nan, np.nan
        if self.t > 0.0:
            self._follower.step(self._dt)
        else:
            self._follower.begin(self._follower.target)
        self.t += self._dt
        code = self._function(
            *(words.ctypes.data for words in (self._state, self._command, self._params, self._memory))
        )
        if code != self._law.success:
            raise CommandRejected(f"the law has failed: it returned {code}", parameter="law")
        return out


#: Members of `heptarm_state` that are floats; integers follow.
_FLOATS = sum(kind == "real" for kind, *_ in interface.STATE)


def _words(rows: Sequence[tuple[str, tuple[int, ...], str, str]]) -> int:
    return sum(shape[0] if shape else 1 for _, shape, _, _ in rows)


def _places(rows: Sequence[tuple[str, tuple[int, ...], str, str]]) -> dict[str, tuple[tuple[int, ...], int]]:
    return {name: (shape, _words(rows[:index])) for index, (_, shape, name, _) in enumerate(rows)}
