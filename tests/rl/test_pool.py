"""Jobs in other processes: what becomes of one whose worker is killed, of one that fails, and of all by Ctrl-C."""

from __future__ import annotations

import os
import signal
from dataclasses import dataclass
from pathlib import Path

from heptarm.rl.pool import Job, run_jobs


@dataclass(frozen=True, slots=True)
class Square(Job[int]):
    """The square of a number; the workers of some are killed, as often as stated, and one is refused."""

    number: int
    folder: Path
    kills: int = 0

    def run(self) -> int:
        killed = len(list(self.folder.glob(f"{self.number}-*")))
        if killed < self.kills:
            (self.folder / f"{self.number}-{killed}").touch()
            os.kill(os.getpid(), signal.SIGKILL)
        if self.number == 3:
            raise ValueError("three is not squared")
        return self.number**2


def test_a_lost_job_is_run_again_and_one_that_fails_carries_its_error(tmp_path: Path) -> None:
    jobs = [Square(f"square {n}", n, tmp_path, kills=int(n == 2)) for n in range(2, 5)]
    seen = []
    outcomes = run_jobs(jobs, workers=1, progress=lambda outcome: seen.append(outcome.job.name))
    print(outcomes)
    assert [outcome.value for outcome in outcomes] == [4, None, 16]
    assert [outcome.attempts for outcome in outcomes] == [2, 1, 1]
    assert [outcome.error for outcome in outcomes] == ["", "ValueError: three is not squared", ""]
    assert "three is not squared" in outcomes[1].trace and [o.job for o in outcomes] == jobs
    assert sorted(seen) == ["square 2", "square 3", "square 4"]
