"""Many jobs at once, on the processors of this machine or on a Ray cluster: trainings, evaluations, recordings.

A job is a frozen value that holds all that it needs, and what it returns is all that it leaves behind. So one whose
worker is lost (killed, out of memory, its machine gone) is run again as if nothing had happened.

Jobs travel as bytes of cloudpickle: classes and functions of the program that starts them go along. heptarm itself must
be installed where they run, in the same version.
"""

from __future__ import annotations

import contextlib
import logging
import os
import pickle
import select
import signal
import socket
import subprocess
import sys
import threading
import time
import traceback
from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from typing import Any, Generic, NoReturn, TypeVar

import cloudpickle

from heptarm import __version__
from heptarm.errors import CommandRejected, ConnectFailed, HeptarmError, require, system_errors
from heptarm.io.new_process import by_value, module_path
from heptarm.values.checks import instance, integer

_log = logging.getLogger("heptarm.rl")
Value = TypeVar("Value")

#: So often a job is run at most, if its workers are lost.
ATTEMPTS = 3
#: Most workers of one machine.
_MOST = 1024
#: Workers may take so long to end, as with an arm that has to come to rest [s].
_GRACE = 10.0
#: A worker computes in one thread: the others have the other processors.
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


@dataclass(frozen=True, slots=True)
class Job(ABC, Generic[Value]):
    """What a worker does, on one processor; derive a frozen dataclass.

    Whatever `run` needs is in the fields, and whatever remains of it is in what it returns.

    Attributes:
        name: in tables and errors.
    """

    name: str

    @property
    def gpus(self) -> int:
        """Graphics cards that it needs on a Ray cluster."""
        return 0

    @abstractmethod
    def run(self) -> Value:
        """Do it; called in another process, possibly on another machine, and again if that is lost."""


@dataclass(frozen=True, slots=True, eq=False)
class JobResult(Generic[Value]):
    """How a job ended.

    Attributes:
        job: the job.
        value: what its `run` returned; None: it failed.
        error: why it failed; empty: it did not.
        trace: where in its `run` it failed.
        seconds: duration of its last run [s].
        attempts: how often it was run; more than once if workers were lost.
        worker: machine and process of its last run.
    """

    job: Job[Value]
    value: Value | None
    error: str
    trace: str
    seconds: float
    attempts: int
    worker: str


def run_jobs(
    jobs: Iterable[Job[Value]],
    *,
    workers: int | None = None,
    ray: str = "",
    progress: Callable[[JobResult[Value]], object] | None = None,
) -> tuple[JobResult[Value], ...]:
    """Run jobs in other processes, many at once; when this ends, also by Ctrl-C, all have ended.

    A job that raises is not run again: its result has the error, and the others go on. One whose worker is lost is run
    again, `ATTEMPTS` times in all.

    Args:
        jobs: the jobs.
        workers: how many run at once on this machine; None: one for each processor.
        ray: address of a Ray cluster to run them on instead: "auto", "HOST:PORT" or "ray://HOST:PORT".
        progress: called with each result as it comes.

    Returns:
        The results in the order of the jobs.

    Raises:
        CommandRejected: a job that cannot be pickled; `workers` with `ray`; more graphics cards than Ray has.
        LimitError: no workers.
        ConnectFailed: no Ray cluster at that address, or no process can be started.
        MissingExtra: Ray is not installed.
    """
    given = [instance(job, Job, f"jobs[{number}]") for number, job in enumerate(jobs)]
    if ray and workers is not None:
        raise CommandRejected(
            "workers are of this machine, and ray has its own", parameter="workers", hint="leave one out"
        )
    count = _processors() if workers is None else integer(workers, "workers", 1, _MOST)
    sent = [_packed(job) for job in given]
    results: dict[int, JobResult[Value]] = {}
    attempts: Counter[int] = Counter()
    pool: _Pool = _Cluster(ray, max((job.gpus for job in given), default=0)) if ray else _Processes(count)
    try:
        for number, job in enumerate(given):
            pool.submit(number, sent[number], job.gpus)
        while len(results) < len(given):
            number, ended = pool.next()
            job = given[number]
            attempts[number] += 1
            if ended.is_lost and attempts[number] < ATTEMPTS:
                _log.warning("%s is run again: %s", job.name, ended.error)
                pool.submit(number, sent[number], job.gpus)
                continue
            error = f"its worker was lost {ATTEMPTS} times: {ended.error}" if ended.is_lost else ended.error
            results[number] = JobResult(
                job, ended.value, error, ended.trace, ended.seconds, attempts[number], ended.worker
            )
            if progress is not None:
                progress(results[number])
    finally:
        pool.close()
    return tuple(results[number] for number in range(len(given)))


def _processors() -> int:
    """Those that this program may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


def _packed(job: Job[Any]) -> bytes:
    try:
        with by_value(type(job)):
            return bytes(cloudpickle.dumps((__version__, cloudpickle.dumps(job))))
    except Exception as error:  # of any object that is in a job
        raise CommandRejected(
            f"the job {job.name!r} cannot be sent to another process ({error})",
            parameter="jobs",
            hint="give it values, and open files, arms and locks in its run",
        ) from error


# ---------------------------------------------------------------------------------------- on the side of the worker


@dataclass(frozen=True, slots=True, eq=False)
class _Ended:
    """How one run of a job ended."""

    value: Any = None
    error: str = ""
    trace: str = ""
    seconds: float = 0.0
    worker: str = ""
    is_lost: bool = False


def perform(sent: bytes) -> bytes:
    """Run a job that came as bytes; return how it ended, as bytes."""
    begun = time.perf_counter()

    def ended(**more: Any) -> bytes:
        seconds, worker = time.perf_counter() - begun, f"{socket.gethostname()}:{os.getpid()}"
        return bytes(cloudpickle.dumps(_Ended(seconds=seconds, worker=worker, **more)))

    try:
        version, packed = pickle.loads(sent)
        if version != __version__:
            raise HeptarmError(
                f"heptarm {__version__} is installed at the worker {socket.gethostname()}, here {version}",
                hint="install the same version on all machines",
            )
        return ended(value=pickle.loads(packed).run())
    except (Exception, SystemExit) as error:  # a job is anybody's code
        text = str(error) if isinstance(error, HeptarmError) else f"{type(error).__name__}: {error}"
        return ended(error=" ".join(text.split()), trace=traceback.format_exc())


class _Ending(BaseException):
    """The program that started this worker ends it, or has ended."""


def serve(descriptor: int) -> None:
    """Run jobs that come over a pipe, until its other end is closed; the main function of a worker.

    Then a job that runs is ended as by SIGTERM, so that its blocks are left in order: an arm comes to rest.
    """

    def end(*_: object) -> NoReturn:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)  # once: nothing interrupts how the blocks are left
        raise _Ending

    os.set_inheritable(descriptor, False)
    pipe = Connection(descriptor)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the program, which closes the pipe
    with contextlib.suppress(_Ending):
        signal.signal(signal.SIGTERM, end)
        threading.Thread(target=_end_with, args=(descriptor,), name="heptarm-pool", daemon=True).start()
        while True:
            try:
                pipe.send_bytes(perform(pipe.recv_bytes()))
            except (EOFError, OSError):
                signal.pause()  # until the thread has seen it, too


def _end_with(descriptor: int) -> None:
    """Wait until the other end of a pipe is closed, then end this process."""
    closed = select.poll()
    closed.register(descriptor, select.POLLHUP)
    closed.poll()
    os.kill(os.getpid(), signal.SIGTERM)


# ---------------------------------------------------------------------------------------- where workers are


class _Pool(ABC):
    """Runs what it gets as soon as it can."""

    @abstractmethod
    def submit(self, number: int, sent: bytes, gpus: int) -> None:
        """Take a job, packed for `perform`."""

    @abstractmethod
    def next(self) -> tuple[int, _Ended]:
        """Wait until one of the jobs has ended, or its worker is lost; return its number and how."""

    @abstractmethod
    def close(self) -> None:
        """End all that runs."""


class _Processes(_Pool):
    """Processes of this machine: new ones, never forks, each with a pipe of its own.

    The standard library's pool gives up all that runs when one process dies.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._waiting: deque[tuple[int, bytes]] = deque()
        self._processes: dict[Connection, subprocess.Popen[bytes]] = {}
        self._running: dict[Connection, int] = {}

    def submit(self, number: int, sent: bytes, gpus: int) -> None:
        self._waiting.append((number, sent))

    def next(self) -> tuple[int, _Ended]:
        while self._waiting and len(self._running) < self._count:
            free = [pipe for pipe in self._processes if pipe not in self._running]
            pipe = free[0] if free else self._start()
            self._running[pipe], sent = self._waiting.popleft()
            with contextlib.suppress(OSError):  # of a process that has died, as its pipe will show
                pipe.send_bytes(sent)
        pipe = wait(list(self._running))[0]  # type: ignore[assignment]
        number = self._running.pop(pipe)
        try:
            return number, pickle.loads(pipe.recv_bytes())
        except (EOFError, OSError):
            return number, self._buried(pipe)

    def _start(self) -> Connection:
        ours, theirs = Pipe()
        with theirs, system_errors("a worker cannot be started", kind=ConnectFailed):
            process = subprocess.Popen(
                [sys.executable, "-c", f"from heptarm.rl.pool import serve; serve({theirs.fileno()})"],
                env={**os.environ, **_ONE_THREAD, "PYTHONPATH": module_path()},
                stdin=subprocess.DEVNULL,
                stdout=2,  # what a job prints is not mixed with what this program prints
                pass_fds=(theirs.fileno(),),
            )
        self._processes[ours] = process
        return ours

    def _buried(self, pipe: Connection) -> _Ended:
        """Forget a process that is lost; return why."""
        process = self._processes.pop(pipe)
        pipe.close()
        code = _ended(process, time.monotonic() + _GRACE)
        if code >= 0:
            why = f"it ended with exit code {code}"
        else:
            hint = ", perhaps for lack of memory" if code == -signal.SIGKILL else ""
            why = f"it was killed by {signal.Signals(-code).name}{hint}"
        return _Ended(error=why, worker=f"{socket.gethostname()}:{process.pid}", is_lost=True)

    def close(self) -> None:
        for pipe in self._processes:
            pipe.close()
        until = time.monotonic() + _GRACE
        for process in self._processes.values():
            _ended(process, until)


def _ended(process: subprocess.Popen[bytes], until: float) -> int:
    """Wait for the end of a process until a time of the clock, then kill it; return its exit code."""
    try:
        return process.wait(max(0.0, until - time.monotonic()))
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


class _Cluster(_Pool):
    """A Ray cluster, which queues the jobs and finds a place for each."""

    def __init__(self, address: str, gpus: int) -> None:
        self._ray = ray = require("ray", extra="ray")
        self._running: dict[Any, int] = {}
        self._is_ours = not ray.is_initialized()
        if self._is_ours:
            try:
                ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR)
            except (ConnectionError, ValueError, RuntimeError, OSError) as error:
                raise ConnectFailed(
                    f"no Ray cluster at {address!r} ({' '.join(str(error).split())})",
                    parameter="ray",
                    value=address,
                    hint="start one with `ray start --head`, or leave --ray out for the processors of this machine",
                ) from error
        found = int(ray.cluster_resources().get("GPU", 0))
        if gpus > found:
            self.close()
            raise CommandRejected(
                f"the jobs need {gpus} graphics cards each, the Ray cluster has {found}", parameter="ray"
            )
        self._perform = ray.remote(max_retries=0)(perform)  # `run_jobs` counts the attempts

    def submit(self, number: int, sent: bytes, gpus: int) -> None:
        self._running[self._perform.options(num_cpus=1, num_gpus=gpus).remote(sent)] = number

    def next(self) -> tuple[int, _Ended]:
        ray = self._ray
        (ready, *_), _ = ray.wait(list(self._running))
        number = self._running.pop(ready)
        try:
            return number, pickle.loads(ray.get(ready))
        except ray.exceptions.RayTaskError as error:  # not of the job, whose errors come as a value
            return number, _Ended(error=f"Ray cannot run it: {' '.join(str(error.cause).split())}")
        except ray.exceptions.RayError as error:
            return number, _Ended(error=str(error).partition(". ")[0], is_lost=True)

    def close(self) -> None:
        for reference in self._running:
            self._ray.cancel(reference, force=True)
        if self._is_ours:
            self._ray.shutdown()
