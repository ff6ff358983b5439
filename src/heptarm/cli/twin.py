"""`heptarm twin`: a recording once more in the simulator, and where both part."""

from __future__ import annotations

from dataclasses import asdict
from math import isnan
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from heptarm.cli.options import Json, Overwrite
from heptarm.cli.output import emit
from heptarm.errors import CommandRejected
from heptarm.twin.replay import replay_in_sim
from heptarm.values.files import writable_file
from heptarm.values.mode.impedance import CartesianImpedance


def twin(
    file: Annotated[Path, Parameter(help="Recording or black box, MCAP.")],
    /,
    *,
    sim: Annotated[
        str | None,
        Parameter(
            help="The simulator: sim://MODEL?OPTION=VALUE, with a scene or a payload for example, or sim://HOST:PORT. "
            "Default: a private one of the recorded robot."
        ),
    ] = None,
    arm: Annotated[str, Parameter(help="Which arm, in a recording of several.")] = "",
    speed: Annotated[float, Parameter(help="What if: a factor on the speed, (0, 1].")] = 1.0,
    stiffness: Annotated[
        float | None,
        Parameter(
            help="What if: Cartesian impedance of this stiffness in every direction [N/m], for every motion."
        ),
    ] = None,
    band: Annotated[
        tuple[str, ...],
        Parameter(
            help="SIGNAL=LARGEST: a deviation that is no difference, such as q=0.01 [rad]; may be repeated."
        ),
    ] = (),
    signals: Annotated[
        str, Parameter(help="What is drawn: names with commas between. Default: the usual ones.")
    ] = "",
    out: Annotated[
        Path | None, Parameter(name=["--out", "-o"], help="Draw both: .png, .svg, .pdf or .html.")
    ] = None,
    save: Annotated[Path | None, Parameter(help="Write both to one recording, MCAP.")] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> int:
    """Carry out in the simulator what a recording commands, and show where both part.

    For example:

        heptarm twin run.mcap -o twin.html

        heptarm twin run.mcap --sim "sim://iiwa14?payload=2" --band tau=3 --save both.mcap
    """
    for path, name in ((out, "out"), (save, "save")):
        if path is not None:
            writable_file(path, overwrite=overwrite, name=name)
    names = tuple(name.strip() for name in signals.split(",") if name.strip())
    mode = None if stiffness is None else CartesianImpedance(stiffness={"xyz": stiffness})
    bands = dict(_band(text) for text in band)
    found = replay_in_sim(file, target=sim, arm=arm, speed=speed, mode=mode, bands=bands)
    drawn = None if out is None else found.chart(*names).save(out, overwrite=overwrite)
    saved = None if save is None else found.save(save, overwrite=overwrite)
    if as_json:
        files = {"plot": drawn, "recording": saved}
        emit(
            {
                "alike": found.is_alike,
                "parts_s": None if isnan(found.parts) else found.parts,
                "deviations": [
                    asdict(deviation) | {"parts": None if deviation.is_inside else deviation.parts}
                    for deviation in found.deviations
                ],
                "motions": [
                    {
                        "id": motion.recorded.id,
                        "recorded": motion.recorded.cause,
                        "simulated": "" if motion.simulated is None else motion.simulated.cause,
                        "refusal": motion.refusal,
                    }
                    for motion in found.motions
                ],
                "notes": list(found.notes),
                "files": {name: str(path) for name, path in files.items() if path is not None},
            }
        )
        return 0
    print(found)
    for path in (drawn, saved):
        if path is not None:
            print(path)
    return 0


def _band(text: str) -> tuple[str, float]:
    """Signal and largest deviation of "SIGNAL=LARGEST".

    Raises:
        CommandRejected: it has another form.
    """
    name, _, number = text.partition("=")
    try:
        return name.strip(), float(number)
    except ValueError:
        raise CommandRejected(
            f"band must be SIGNAL=LARGEST, such as q=0.01, got {text!r}", parameter="band", value=text
        ) from None
