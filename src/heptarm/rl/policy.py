"""A trained policy: a small network in numpy, in one `.npz` file. Nothing here needs torch."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, ShapeError
from heptarm.rl.contact.task import ContactTask
from heptarm.rl.task import ReachTask
from heptarm.rl.tasks import TASKS, OfTask, task_from_dict
from heptarm.values.checks import flag
from heptarm.values.files import read_arrays, refuse_existing, unreadable

Weights = npt.NDArray[np.float32]
OfContact = TypeVar("OfContact", bound=ContactTask)

#: Scaled observations are clipped to this.
CLIP = 5.0
_FORMAT = 1
#: Folder of the policies that are part of heptarm.
SHIPPED = Path(__file__).parent / "policies"


class Policy(Generic[OfTask]):
    """Computes the actions of a task.

    Args:
        task: the task it was trained for.
        layers: weights (inputs, outputs) and biases (outputs,) of each layer; ELU between them.
        mean: of the observations, shape (n,).
        std: of the observations, shape (n,).
        facts: how it came about: seed, environment steps, randomisation, versions.

    Raises:
        ShapeError: the layers do not fit each other or the task.
    """

    def __init__(
        self,
        task: OfTask,
        *,
        layers: list[tuple[npt.ArrayLike, npt.ArrayLike]],
        mean: npt.ArrayLike,
        std: npt.ArrayLike,
        facts: dict[str, Any] | None = None,
    ) -> None:
        self.task = task
        self.facts = dict(facts or {})
        self.layers = [(_weights(w), _weights(b)) for w, b in layers]
        self.mean, self.std = _weights(mean), _weights(std)
        width = task.observation_size
        if self.mean.shape != (width,) or self.std.shape != (width,) or not (self.std > 0).all():
            raise ShapeError(
                f"mean and std must have shape ({width},), std above 0; got {self.mean.shape} and {self.std.shape}"
            )
        for index, (w, b) in enumerate(self.layers):
            if w.ndim != 2 or w.shape[0] != width or b.shape != (w.shape[1],):
                raise ShapeError(
                    f"layer {index} must have {width} inputs, got weights {w.shape} and biases {b.shape}"
                )
            width = w.shape[1]
        if width != task.action_size:
            raise ShapeError(f"the network must have {task.action_size} outputs, got {width}")
        # clipped in units of the observations, scaled by the first layer: two passes fewer over the numbers
        mean64, std64 = self.mean.astype(np.float64), self.std.astype(np.float64)
        self._low, self._high = _weights(mean64 - CLIP * std64), _weights(mean64 + CLIP * std64)
        scaled = self.layers[0][0] / std64[:, None]
        self._first = (_weights(scaled), _weights(self.layers[0][1] - mean64 @ scaled))

    def __call__(self, observation: npt.ArrayLike) -> Weights:
        """The action, without noise.

        Args:
            observation: shape (..., n), of the task.

        Returns:
            Shape (..., actions), within +-1.
        """
        x = np.maximum(np.asarray(observation, dtype=np.float32), self._low)
        np.minimum(x, self._high, out=x)
        w, b = self._first
        for following, offset in self.layers[1:]:
            x = x @ w
            x += b
            curved = np.minimum(x, 0.0)
            np.expm1(curved, out=curved)
            np.maximum(x, curved, out=x)  # ELU: exp(x) - 1 is above x, and 0 where x is not negative
            w, b = following, offset
        x = x @ w
        x += b
        np.maximum(x, -1.0, out=x)
        np.minimum(x, 1.0, out=x)
        return x

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
        """Write to a `.npz` file atomically, one that exists only with `overwrite`; return its path.

        Raises:
            CommandRejected: the name does not end in `.npz`, or the file exists.
        """
        target = Path(path)
        if target.suffix != ".npz":
            raise CommandRejected(
                f"path must end in .npz, got {target.name!r}", parameter="path", value=str(path)
            )
        refuse_existing(target, overwrite=flag(overwrite, "overwrite"))
        about = {"format": _FORMAT, "task": self.task.as_dict(), "facts": self.facts}
        arrays: dict[str, Any] = {"about": np.array(json.dumps(about)), "mean": self.mean, "std": self.std}
        for index, (w, b) in enumerate(self.layers):
            arrays[f"w{index}"], arrays[f"b{index}"] = w, b
        half = target.with_name(f".{target.name}.{os.getpid()}.part")
        with half.open("wb") as file:
            np.savez(file, **arrays)
        half.replace(target)
        return target

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Policy[Any]:
        """Read a file written by `save`.

        Raises:
            CommandRejected: the file does not exist, or is not a policy of this version.
        """
        where, what, hint = Path(path), "a policy", "train one with `heptarm rl train`"
        entries = read_arrays(where, what, hint=hint)
        try:
            about = json.loads(str(entries["about"]))
            if about["format"] != _FORMAT:
                raise ValueError(
                    f"it must have format {_FORMAT} for this heptarm, got format {about['format']}"
                )
            count = sum(name.startswith("w") for name in entries)
            layers: list[tuple[npt.ArrayLike, npt.ArrayLike]] = [
                (entries[f"w{index}"], entries[f"b{index}"]) for index in range(count)
            ]
            task: Any = task_from_dict(about["task"])
            return cls(
                task,
                layers=layers,
                mean=entries["mean"],
                std=entries["std"],
                facts=about["facts"],
            )
        except Exception as error:  # of any numbers and texts in place of a policy's
            why = str(error) if isinstance(error, ValueError) else f"{type(error).__name__}: {error}"
            raise unreadable(where, why, what=what, hint=hint) from None


def shipped(*, feature: bool = False) -> Policy[ReachTask]:
    """The policy that is part of heptarm, for an iiwa 14, trained by `heptarm rl train --seed 0` of an earlier version.

    Args:
        feature: the one that also sees the way to the target (`--feature`).
    """
    return Policy.load(SHIPPED / f"reach-iiwa14{'-feature' if flag(feature, 'feature') else ''}.npz")


def shipped_contact(kind: type[OfContact]) -> Policy[OfContact]:
    """Likewise of a task with contacts, such as `PegInHole`, trained by `heptarm rl train`.

    Raises:
        CommandRejected: none of this task is part of heptarm.
    """
    file = _included(kind.name)
    if not file.exists():
        raise CommandRejected(
            f"kind must be a task whose policy is part of heptarm, {_known()}, got {kind.name}",
            parameter="kind",
            value=kind.name,
            hint=f"heptarm rl train {kind.name} trains one",
        )
    return Policy.load(file)


def policy_named(name: str | os.PathLike[str], *, feature: bool = False) -> Policy[Any]:
    """The policy of a file, or the included one of a task by its name, such as "reach" or "peg-in-hole".

    Args:
        name: the file or the task; "": "reach".
        feature: of the included ones of reach, the one that also sees the way to the target.

    Raises:
        CommandRejected: the file does not exist, or is not a policy of this version.
    """
    if os.fspath(name) in ("", ReachTask.name):
        return shipped(feature=feature)
    kind, file = TASKS.get(os.fspath(name)), Path(name)
    if kind is not None and issubclass(kind, ContactTask):
        return shipped_contact(kind)
    if not file.suffix and not file.exists():
        raise CommandRejected(
            f"policy must be a file, or a task whose policy is part of heptarm, {ReachTask.name}, {_known()}, got "
            f"{os.fspath(name)!r}",
            parameter="policy",
            value=os.fspath(name),
            hint=f"heptarm rl train NAME trains one of a task, {', '.join(TASKS)}; a file ends in .npz",
        )
    return Policy.load(file)


def _known() -> str:
    """The tasks with contacts whose policies are part of heptarm."""
    return ", ".join(name for name in TASKS if name != ReachTask.name and _included(name).exists())


def _included(name: str) -> Path:
    return SHIPPED / f"{name}-iiwa14.npz"


def _weights(values: npt.ArrayLike) -> Weights:
    result = np.array(values, dtype=np.float32)
    result.flags.writeable = False
    return result
