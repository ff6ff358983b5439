"""Options that several commands of policies have."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

#: Largest seed.
LARGEST_SEED = 2**63 - 1
Seed = Annotated[int, Parameter(help="Seed of all random numbers.")]
POLICY = "File of the policy, .npz, or a task whose policy comes with heptarm, such as reach or peg-in-hole."
