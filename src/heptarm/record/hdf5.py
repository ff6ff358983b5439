"""Episodes as one HDF5 file in the layout of robomimic (Mandlekar et al. 2021), which many imitation learners read.

`data/demo_N` holds an episode: `actions`, `rewards`, `dones`, in `obs` the observations, shape (steps, ...) each, in
`next_obs` those of the step after, which learners from rewards ask for; they are views of `obs` and take no space.
`mask/success` and its like name the episodes of a label.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from heptarm.errors import require
from heptarm.record.demonstration import Demonstration, Demonstrations, of_one_kind
from heptarm.record.pictures import decoded
from heptarm.values.checks import flag, instance
from heptarm.values.files import path_of, refuse_existing, unwritable

#: robomimic's number of environments of Gym; it makes one only for trials of its own, which this has none for.
_GYM = 2
#: Names of joint signals as robomimic's data sets of real arms have them; others keep theirs.
_OBSERVATIONS = {"q": "joint_positions", "dq": "joint_velocities"}


def save_hdf5(episodes: Demonstrations, file: str | Path, *, overwrite: bool = False) -> Path:
    """Write episodes as one HDF5 file in robomimic's layout; returns the file.

    Observations are `joint_positions` [rad], `joint_velocities` [rad/s], `tau_ext` [Nm], `pose` (x y z [m], quaternion
    x y z w), `wrench` [N, Nm], each stream by its name, and each camera as `NAME_image`, bytes of shape (steps, height,
    width, 3). The last step of an episode is done; its reward is 1 after a success, every other one is 0.

    Args:
        episodes: with as many steps as they have; those without any are left out.
        file: to write, such as "insert.hdf5".
        overwrite: replace a file that is there.

    Raises:
        CommandRejected: no episodes with steps, or such that differ in streams, cameras or rate; or the file exists or
            cannot be written.
        MissingExtra: h5py or Pillow is not installed.
    """
    instance(episodes, Demonstrations, "episodes")
    path = refuse_existing(path_of(file, "file"), overwrite=flag(overwrite, "overwrite"), name="file")
    used = of_one_kind(episodes)
    h5py = require("h5py", extra="hdf5")
    new = path.with_name(f".{path.name}.new")  # what is there stays until the new one is complete
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with h5py.File(new, "w") as out:
            _write(h5py, out, used)
        new.replace(path)
    except OSError as error:
        new.unlink(missing_ok=True)
        raise unwritable(path, error) from error
    return path


def _write(h5py: Any, out: Any, episodes: list[Demonstration]) -> None:
    data = out.create_group("data")
    masks: dict[str, list[str]] = {}
    for number, episode in enumerate(episodes):
        name = f"demo_{number}"
        group = data.create_group(name)
        group.attrs.update(
            num_samples=len(episode), label=episode.label, task=episode.task, file=episode.path.name
        )
        group["actions"] = episode.action
        done = np.zeros(len(episode))
        done[-1] = 1.0
        group["dones"] = done.astype(np.int64)
        group["rewards"] = done * (episode.label == "success")
        observations = group.create_group("obs")
        for signal, values in episode.signals.items():
            observations[_OBSERVATIONS.get(signal, signal)] = values
        for camera, files in episode.views.items():
            pictures = np.stack([decoded(picture) for picture in files])
            chunk = (1, *pictures.shape[1:])
            observations.create_dataset(f"{camera}_image", data=pictures, chunks=chunk, compression="gzip")
        following = group.create_group("next_obs")
        for signal, values in observations.items():
            following.create_virtual_dataset(signal, _shifted(h5py, values))
        masks.setdefault(episode.label, []).append(name)
    first = episodes[0]
    about = {"control_freq": first.rate, "robot": first.robot}
    data.attrs["total"] = sum(map(len, episodes))
    data.attrs["env_args"] = json.dumps(
        {"env_name": first.task or "demonstration", "type": _GYM, "env_kwargs": about}
    )
    for label, names in masks.items():
        out.create_dataset(f"mask/{label}", data=names, dtype=h5py.string_dtype("ascii"))


def _shifted(h5py: Any, values: Any) -> Any:
    """The layout of a view of a dataset from its second row on; the last row is there twice."""
    count, source = len(values), h5py.VirtualSource(values)
    layout = h5py.VirtualLayout(values.shape, values.dtype)
    if count > 1:
        layout[: count - 1] = source[1:count]
    layout[count - 1 :] = source[count - 1 :]
    return layout
