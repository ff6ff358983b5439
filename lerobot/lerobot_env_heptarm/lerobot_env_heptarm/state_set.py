"""A data set whose numbers are the state of the environment, for policies without pictures.

`lerobot-record` writes all numbers of a robot to `observation.state`. ACT without pictures asks for
`observation.environment_state`. This copies a data set with the one in the place of the other:
`python -m lerobot_env_heptarm.state_set me/pick me/pick-state`.
"""

from __future__ import annotations

import argparse
import logging

import numpy as np
from lerobot.datasets import LeRobotDataset
from lerobot.datasets.dataset_tools import modify_features, recompute_stats
from lerobot.utils.constants import OBS_ENV_STATE, OBS_STATE


def state_set(source: str, copy: str) -> LeRobotDataset:
    """Copy a data set; `observation.state` becomes `observation.environment_state`, and pictures are left out.

    Args:
        source: name of the data set, "me/pick".
        copy: name of the new one.

    Raises:
        ValueError: the source has no `observation.state`.
        FileExistsError: the new one exists.
    """
    data = LeRobotDataset(source)
    if OBS_STATE not in data.features:
        raise ValueError(f"{source} must have {OBS_STATE}, it has {', '.join(data.features)}")
    numbers = np.array(data.hf_dataset[OBS_STATE], np.float32)
    about = {key: data.features[OBS_STATE][key] for key in ("dtype", "shape", "names")}
    return recompute_stats(
        modify_features(
            data,
            add_features={OBS_ENV_STATE: (numbers, about)},
            remove_features=[OBS_STATE, *data.meta.camera_keys],
            repo_id=copy,
        )
    )


def main() -> None:
    """Copy the data set of the command line."""
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("source", help="name of a data set, such as me/pick")
    parser.add_argument("copy", help="name of the new one, such as me/pick-state")
    given = parser.parse_args()
    made = state_set(given.source, given.copy)
    logging.info("%d episodes, %d steps in %s", made.num_episodes, made.num_frames, made.root)


if __name__ == "__main__":
    main()
