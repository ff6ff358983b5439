"""Control laws that run without Python: one compiled by Numba, one in C++ if there is a compiler, and a ready one."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import heptarm as ha
from heptarm import laws
from heptarm.fri import CompiledLaw, Output, State, include_dir
from heptarm.modes import JointImpedance


@ha.law(memory={"x": np.zeros(7), "started": 0.0})
def spring(s: State, out: Output, p: Any, m: Any) -> None:
    if m.started == 0.0:
        m.x = s.q
        m.started = 1.0
    m.x = m.x + s.dt * (p.goal - m.x) / p.tau
    for i in range(7):
        tau = p.stiffness * (m.x[i] - s.q[i]) - p.damping * s.dq[i]
        out.tau[i] = min(max(tau, -p.most), p.most)


HERE = Path(__file__).parent if "__file__" in globals() else Path("examples")
COMPLIANT = JointImpedance(stiffness=0.0)  # the cabinet compensates gravity, the law does the rest

with (
    ha.connect(os.environ.get("HEPTARM_TARGET", "sim://iiwa14")) as arm,
    tempfile.TemporaryDirectory() as folder,
):
    home = ha.deg(0, 30, 0, -90, 0, 60, 0)
    arm.move(ha.ptp(home), speed=0.6)
    settings: dict[str, npt.ArrayLike] = {
        "goal": home,
        "stiffness": 100.0,
        "damping": 10.0,
        "tau": 0.2,
        "most": 20.0,
    }
    forms: dict[str, CompiledLaw] = {"Numba": spring}
    if compiler := shutil.which("c++"):
        made = Path(folder) / "spring.so"
        source = HERE / "laws" / "spring.cpp"
        subprocess.run(
            [compiler, "-std=c++17", "-O2", "-shared", "-fPIC", f"-I{include_dir()}", "-o", made, source],
            check=True,
        )
        forms["C++"] = ha.law_from(made, "spring", memory={"x": np.zeros(7), "started": 0.0})
    for name, law in forms.items():
        with arm.fri("torque", period_ms=5, mode=COMPLIANT, law=law, params=settings) as rt:
            rt.params.goal = home + ha.deg(0, 0, 0, 0, 0, 0, 15)
            rt.wait(1.5)
            turned = np.degrees(rt.state.q[6] - home[6])
            print(
                f"{name}: A7 turned by {turned:.1f} deg, the law's memory has {np.degrees(rt.memory.x[6]):.1f} deg"
            )
        arm.move(ha.ptp(home), speed=0.6)
    law = laws.cartesian_impedance(stiffness=(800, 800, 800, 50, 50, 50), speed=0.1)
    flange = arm.pose("flange")
    with arm.fri("torque", period_ms=5, law=law) as rt:
        start = rt.state.q.copy()
        rt.wait(0.3)
        rt.params.goal = flange.shifted(y=0.05)
        rt.wait(1.5)
        left = 1e3 * np.linalg.norm(rt.memory.error[:3])
        print(f"{left:.1f} mm to the goal; limited in {rt.memory.saturated:.0f} cycles")
