"""Several workers that train one policy: each simulates its own arms, all average their gradients.

`torchrun` (or anything that sets RANK, WORLD_SIZE, MASTER_ADDR and MASTER_PORT) starts the workers, on one machine
or several; a single process needs none of it. Gloo transfers the tensors between CPUs, NCCL
between GPUs.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta

import torch
import torch.distributed as dist
from torch import Tensor, nn

from heptarm.errors import CommandRejected, LimitError

#: Longest wait of a worker for the others [s].
PATIENCE = 120.0


class Team:
    """The workers of a training, from the view of one of them.

    Attributes:
        rank: number of this one; 0 writes the files.
        size: how many there are.
        device: where this one computes.
    """

    def __init__(self, rank: int, size: int, device: torch.device) -> None:
        self.rank, self.size, self.device = rank, size, device

    @property
    def is_first(self) -> bool:
        """Whether this worker reports and writes files."""
        return self.rank == 0

    def mean(self, values: Tensor) -> Tensor:
        """Average of the workers' tensors."""
        return values if self.size == 1 else self.total(values) / self.size

    def total(self, values: Tensor) -> Tensor:
        """Sum of the workers' tensors."""
        if self.size == 1:
            return values
        result = values.detach().clone()
        dist.all_reduce(result)
        return result

    def any(self, flag: object) -> bool:
        """Whether one of the workers reports it."""
        return bool(self.total(torch.tensor(float(bool(flag)), device=self.device)) > 0)

    def align(self, module: nn.Module) -> None:
        """Give every worker the leader's parameters and buffers."""
        if self.size > 1:
            for values in module.state_dict().values():
                dist.broadcast(values, 0)


@contextmanager
def team(device: str) -> Iterator[Team]:
    """The team that the environment variables describe; all workers leave it together.

    Args:
        device: "cpu", "cuda" (each worker of a machine takes its own GPU) or "cuda:1".

    Raises:
        CommandRejected: the device is not available.
        LimitError: RANK and WORLD_SIZE contradict each other.
    """
    size, rank = _number("WORLD_SIZE", 1), _number("RANK", 0)
    if not 0 <= rank < size:
        raise LimitError(
            f"RANK must be 0 to WORLD_SIZE - 1, got RANK {rank} and WORLD_SIZE {size}",
            hint="start the workers with torchrun",
        )
    place = _device(device)
    if size == 1:
        yield Team(0, 1, place)
        return
    begun = not dist.is_initialized()
    if begun:
        dist.init_process_group(
            "nccl" if place.type == "cuda" else "gloo",
            rank=rank,
            world_size=size,
            timeout=timedelta(seconds=PATIENCE),
        )
    try:
        yield Team(rank, size, place)
    finally:
        if begun:
            dist.destroy_process_group()


def _number(name: str, otherwise: int) -> int:
    text = os.environ.get(name, "")
    try:
        return int(text) if text else otherwise
    except ValueError:
        raise LimitError(f"{name} must be a number, got {text!r}", parameter=name, value=text) from None


def _device(name: str) -> torch.device:
    kind, _, index = name.partition(":")
    if kind == "cpu" and not index:
        return torch.device("cpu")
    if kind != "cuda" or (index and not index.isdigit()):
        raise CommandRejected(f"device must be 'cpu', 'cuda' or 'cuda:N', got {name!r}", value=name)
    if not torch.cuda.is_available():
        raise CommandRejected(
            f"device {name!r} is not available: torch finds no GPU on this machine",
            parameter="device",
            value=name,
            hint="use device='cpu', or install a torch built for CUDA",
        )
    place = torch.device(
        "cuda", int(index) if index else _number("LOCAL_RANK", 0) % torch.cuda.device_count()
    )
    torch.cuda.set_device(place)
    return place
