"""A data set with the place of the body as the state of the environment, for policies without pictures.

`lerobot-record` writes all numbers of a robot to `observation.state`. ACT without pictures also asks for
`observation.environment_state`. This copies a data set and adds it, from the end of the state:
`python -m lerobot_env_heptarm.state_set me/pick me/pick-state`.
"""

from __future__ import annotations

import argparse
import logging

import numpy as np
from lerobot.datasets import LeRobotDataset
from lerobot.datasets.dataset_tools import modify_features, recompute_stats
from lerobot.utils.constants import OBS_ENV_STATE, OBS_STATE

from lerobot_env_heptarm.environment import PLACE


def state_set(source: str, copy: str) -> LeRobotDataset:
    """Copy a data set with `observation.environment_state`; pictures are left out.

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
    places = np.array(data.hf_dataset[OBS_STATE], np.float32)[:, -PLACE:]
    names = list(data.features[OBS_STATE]["names"])[-PLACE:]
    about = {"dtype": "float32", "shape": (PLACE,), "names": names}
    return recompute_stats(
        modify_features(
            data,
            add_features={OBS_ENV_STATE: (places, about)},
            remove_features=list(data.meta.camera_keys),
            repo_id=copy,
        )
    )


def main() -> None:
    """Copy the data set of the command line."""
    logging.basicConfig(level=logging.INFO, format="%(message)s", force=True)
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("source", help="name of a data set, such as me/pick")
    parser.add_argument("copy", help="name of the new one, such as me/pick-state")
    given = parser.parse_args()
    made = state_set(given.source, given.copy)
    logging.info("%d episodes, %d steps in %s", made.num_episodes, made.num_frames, made.root)


if __name__ == "__main__":
    main()
