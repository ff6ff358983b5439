"""Episodes as a LeRobot data set, version 3.0: Parquet files with JSON about them, read by LeRobot's own code.

The layout follows LeRobot's documentation: `meta/info.json`, `meta/stats.json`, `meta/tasks.parquet`,
`meta/episodes/chunk-000/file-000.parquet` and `data/chunk-000/file-000.parquet`, in which the pictures are embedded.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, require
from heptarm.record.demonstration import Demonstration, Demonstrations, of_one_kind
from heptarm.record.pictures import decoded
from heptarm.values.checks import Array, flag, instance
from heptarm.values.files import path_of, unwritable

#: Version of the format, LeRobot's sizes of files, and the size from which on the next one begins here [bytes].
VERSION, _CHUNKS, _DATA_MB, _VIDEO_MB = "v3.0", 1000, 100, 200
_FILE_SIZE = 80_000_000
_PATH = "chunk-{:03d}/file-{:03d}.parquet"
#: Names of the numbers of a signal.
_JOINTS = [f"joint_{number}.pos" for number in range(1, 8)]
_NAMES = {
    "dq": [f"joint_{number}.vel" for number in range(1, 8)],
    "tau_ext": [f"joint_{number}.tau_ext" for number in range(1, 8)],
    "pose": ["x", "y", "z", "qx", "qy", "qz", "qw"],
    "wrench": ["fx", "fy", "fz", "tx", "ty", "tz"],
}
#: Columns that every data set has, behind its own.
_COLUMNS = ("timestamp", "frame_index", "episode_index", "index", "task_index")
#: Quantiles of the statistics, and pictures of an episode of which they are computed at most.
_QUANTILES, _LOOKS = (0.01, 0.10, 0.50, 0.90, 0.99), 50


def save_lerobot(episodes: Demonstrations, folder: str | Path, *, overwrite: bool = False) -> Path:
    """Write episodes as a LeRobot data set of version 3.0; returns its folder.

    Features: `observation.state` (joint positions), `observation.` with "velocity", "tau_ext", "pose", "wrench" and the
    name of each stream, `observation.images.` with the name of each camera, `action`, `next.success` at the last step,
    and `correction`, 1 where a person corrected a policy. Pictures are embedded in the Parquet files.

    Args:
        episodes: all with the same rate, streams and cameras.
        folder: of the data set.
        overwrite: replace a data set that is there.

    Raises:
        CommandRejected: no episodes with steps; they differ; or the folder exists or cannot be written.
        MissingExtra: pyarrow or Pillow is not installed.
    """
    arrow, parquet = require("pyarrow", extra="record"), require("pyarrow.parquet", extra="record")
    instance(episodes, Demonstrations, "episodes")
    where = path_of(folder, "folder")
    replaces = flag(overwrite, "overwrite")
    used = of_one_kind(episodes)
    features = _features(used)
    if (
        where.exists()
        and any(where.iterdir())
        and not (replaces and (where / "meta" / "info.json").is_file())
    ):
        raise CommandRejected(
            f"folder must be empty or new, {where} has files",
            parameter="folder",
            value=str(where),
            hint="choose another folder, or replace a data set with overwrite=True",
        )
    new = where.with_name(f".{where.name}.new")  # what is there stays until the new one is complete
    try:
        shutil.rmtree(new, ignore_errors=True)
        _write(arrow, parquet, used, new, features)
        shutil.rmtree(where, ignore_errors=True)
        new.rename(where)
    except OSError as error:
        shutil.rmtree(new, ignore_errors=True)
        raise unwritable(where, error) from error
    return where


def _write(
    arrow: Any,
    parquet: Any,
    episodes: Sequence[Demonstration],
    where: Path,
    features: Mapping[str, Mapping[str, Any]],
) -> None:
    tasks = list(dict.fromkeys(map(_task, episodes)))
    schema = _schema(arrow, features)
    rows: list[dict[str, Any]] = []
    statistics: list[dict[str, dict[str, Any]]] = []
    begin, size, file = 0, 0, 0
    writer = None
    for index, episode in enumerate(episodes):
        places = {"index": index, "begin": begin, "task": tasks.index(_task(episode))}
        table = arrow.table(_columns(arrow, episode, schema, features, **places), schema=schema)
        if writer is not None and size > _FILE_SIZE:
            writer.close()
            writer, size, file = None, 0, file + 1
        if writer is None:
            path = where / "data" / _PATH.format(file // _CHUNKS, file % _CHUNKS)
            path.parent.mkdir(parents=True, exist_ok=True)
            writer = parquet.ParquetWriter(path, schema, compression="snappy")
        writer.write_table(table)
        size += table.nbytes
        statistics.append(_statistics(episode, features, **places))
        rows.append(
            {
                "episode_index": index,
                "tasks": [_task(episode)],
                "length": len(episode),
                "data/chunk_index": file // _CHUNKS,
                "data/file_index": file % _CHUNKS,
                "dataset_from_index": begin,
                "dataset_to_index": begin + len(episode),
                "meta/episodes/chunk_index": 0,
                "meta/episodes/file_index": 0,
                **{
                    f"stats/{name}/{key}": value
                    for name, found in statistics[-1].items()
                    for key, value in found.items()
                },
            }
        )
        begin += len(episode)
    assert writer is not None
    writer.close()
    meta = where / "meta"
    path = meta / "episodes" / _PATH.format(0, 0)
    path.parent.mkdir(parents=True, exist_ok=True)
    parquet.write_table(arrow.Table.from_pylist(rows), path)
    parquet.write_table(_task_table(arrow, tasks), meta / "tasks.parquet")
    info = {
        "codebase_version": VERSION,
        "robot_type": f"kuka_lbr_{episodes[0].robot}",
        "total_episodes": len(episodes),
        "total_frames": begin,
        "total_tasks": len(tasks),
        "chunks_size": _CHUNKS,
        "data_files_size_in_mb": _DATA_MB,
        "video_files_size_in_mb": _VIDEO_MB,
        "fps": round(episodes[0].rate),
        "splits": {"train": f"0:{len(episodes)}"},
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "video_path": None,
        "features": features,
    }
    (meta / "info.json").write_text(json.dumps(info, indent=4), encoding="utf-8")
    whole = _merged(statistics)
    (meta / "stats.json").write_text(json.dumps(whole, indent=4), encoding="utf-8")


def _task(episode: Demonstration) -> str:
    return episode.task or "demonstration"


def _features(episodes: Sequence[Demonstration]) -> dict[str, dict[str, Any]]:
    """The features of a data set, as info.json has them.

    Raises:
        CommandRejected: a rate that LeRobot has not.
    """
    first, shapes = episodes[0], _shapes(episodes[0])
    if abs(first.rate - round(first.rate)) > 1e-6 or first.rate < 1.0:
        raise CommandRejected(
            f"rate must be a whole number of steps per second for LeRobot, got {first.rate:g} Hz",
            parameter="rate",
            value=first.rate,
            hint="load_episodes(folder, rate=...) chooses another one",
        )
    found: dict[str, dict[str, Any]] = {}
    for name, shape in shapes.items():
        if name.startswith("observation.images."):
            found[name] = {"dtype": "image", "shape": list(shape), "names": ["height", "width", "channels"]}
        else:
            found[name] = {"dtype": "float32", "shape": list(shape), "names": _names_of(name, shape[0])}
    for name in ("correction", "next.success"):
        found[name] = {"dtype": "bool", "shape": [1], "names": None}
    for name in _COLUMNS:
        found[name] = {"dtype": "float32" if name == "timestamp" else "int64", "shape": [1], "names": None}
    return found


def _names_of(name: str, size: int) -> list[str]:
    if name in ("observation.state", "action") and size == 7:
        return _JOINTS
    if name == "action" and size == 8:
        return [*_JOINTS, "gripper.pos"]
    short = "dq" if name == "observation.velocity" else name.removeprefix("observation.")
    known = _NAMES.get(short, [])
    return known if len(known) == size else [f"{short}_{number}" for number in range(size)]


def _signal(name: str) -> str:
    """The feature of a signal of a demonstration."""
    return {"q": "observation.state", "dq": "observation.velocity"}.get(name, f"observation.{name}")


def _shapes(episode: Demonstration) -> dict[str, tuple[int, ...]]:
    shapes: dict[str, tuple[int, ...]] = {
        _signal(name): (values.shape[1],) for name, values in episode.signals.items()
    }
    shapes["action"] = (episode.action.shape[1],)
    for name, files in episode.views.items():
        shapes[f"observation.images.{name}"] = decoded(files[0]).shape
    return shapes


def _schema(arrow: Any, features: Mapping[str, Mapping[str, Any]]) -> Any:
    kinds = {"float32": arrow.float32(), "int64": arrow.int64(), "bool": arrow.bool_()}
    fields: list[tuple[str, Any]] = []
    hugging: dict[str, dict[str, Any]] = {}
    for name, feature in features.items():
        if feature["dtype"] == "image":
            kind = arrow.struct([("bytes", arrow.binary()), ("path", arrow.string())])
            hugging[name] = {"_type": "Image"}
        elif feature["shape"] == [1]:
            kind = kinds[feature["dtype"]]
            hugging[name] = {"dtype": feature["dtype"], "_type": "Value"}
        else:
            kind = arrow.list_(kinds[feature["dtype"]], feature["shape"][0])
            hugging[name] = {
                "feature": {"dtype": feature["dtype"], "_type": "Value"},
                "length": feature["shape"][0],
                "_type": "List",
            }
        fields.append((name, kind))
    # the library datasets finds in these what a struct of bytes and path stands for
    return arrow.schema(fields, metadata={"huggingface": json.dumps({"info": {"features": hugging}})})


def _columns(
    arrow: Any,
    episode: Demonstration,
    schema: Any,
    features: Mapping[str, Mapping[str, Any]],
    **places: int,
) -> list[Any]:
    found = []
    values = _values(episode, **places)
    for name in features:
        if name.startswith("observation.images."):
            files = episode.views[name.removeprefix("observation.images.")]
            found.append(
                arrow.array([{"bytes": file, "path": None} for file in files], schema.field(name).type)
            )
        elif features[name]["shape"] == [1]:
            found.append(arrow.array(values[name].ravel()).cast(schema.field(name).type))
        else:
            kind = schema.field(name).type
            flat = arrow.array(values[name].ravel().astype(np.float32))
            found.append(arrow.FixedSizeListArray.from_arrays(flat, kind.list_size).cast(kind))
    return found


def _values(episode: Demonstration, *, index: int, begin: int, task: int) -> dict[str, npt.NDArray[Any]]:
    """Columns of an episode that are numbers."""
    count = len(episode)
    found: dict[str, npt.NDArray[Any]] = {_signal(name): values for name, values in episode.signals.items()}
    found["action"] = episode.action
    found["correction"] = episode.corrected
    success = np.zeros(count, bool)
    success[-1] = episode.label == "success"
    found["next.success"] = success
    steps = np.arange(count)
    found["timestamp"] = (steps / episode.rate).astype(np.float32)
    found["frame_index"], found["index"] = steps, begin + steps
    found["episode_index"], found["task_index"] = np.full(count, index), np.full(count, task)
    return found


def _task_table(arrow: Any, tasks: Sequence[str]) -> Any:
    """A table that pandas reads with the tasks as its index."""
    about = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [
            {"name": "task_index", "field_name": "task_index", "pandas_type": "int64", "numpy_type": "int64"},
            {"name": "task", "field_name": "task", "pandas_type": "unicode", "numpy_type": "object"},
        ],
        "pandas_version": "2.0.0",
    }
    columns = {"task_index": arrow.array(range(len(tasks)), arrow.int64()), "task": arrow.array(list(tasks))}
    return arrow.table(columns).replace_schema_metadata({"pandas": json.dumps(about)})


# ------------------------------------------------------------------------------------------------ statistics


def _statistics(
    episode: Demonstration, features: Mapping[str, Mapping[str, Any]], **places: int
) -> dict[str, dict[str, Any]]:
    """Least, largest, mean, standard deviation, quantiles and number of each feature, as LeRobot names them."""
    found = {}
    values = _values(episode, **places)
    for name, feature in features.items():
        if feature["dtype"] == "image":
            files = episode.views[name.removeprefix("observation.images.")]
            chosen = np.unique(np.linspace(0, len(files) - 1, min(_LOOKS, len(files))).round().astype(int))
            pixels = (
                np.concatenate([decoded(files[index])[::4, ::4].reshape(-1, 3) for index in chosen]) / 255.0
            )
            found[name] = {
                key: [[[value]] for value in row] if key != "count" else row
                for key, row in _of(pixels, count=len(chosen)).items()
            }
        else:
            rows = values[name].reshape(len(episode), -1).astype(np.float64)
            found[name] = _of(rows, count=len(rows))
    return found


def _of(rows: Array, *, count: int) -> dict[str, Any]:
    quantiles = np.quantile(rows, _QUANTILES, axis=0)
    return {
        "min": rows.min(axis=0).tolist(),
        "max": rows.max(axis=0).tolist(),
        "mean": rows.mean(axis=0).tolist(),
        "std": rows.std(axis=0).tolist(),
        "count": [count],
        **{
            f"q{round(100 * place):02d}": row.tolist()
            for place, row in zip(_QUANTILES, quantiles, strict=True)
        },
    }


def _merged(episodes: Sequence[Mapping[str, Mapping[str, Any]]]) -> dict[str, dict[str, Any]]:
    """Statistics of all episodes together (Chan, Golub and LeVeque 1983); quantiles are means, as LeRobot's are."""
    whole: dict[str, dict[str, Any]] = {}
    for name in episodes[0]:
        parts = [episode[name] for episode in episodes]
        counts = np.array([part["count"][0] for part in parts], dtype=np.float64)
        weights = counts / counts.sum()

        def mean(key: str, parts: Any = parts, weights: Any = weights) -> Any:
            return np.tensordot(weights, np.array([part[key] for part in parts]), axes=1)

        middle = mean("mean")
        spread = np.tensordot(
            weights, np.array([np.square(part["std"]) + np.square(part["mean"]) for part in parts]), axes=1
        )
        whole[name] = {
            "min": np.min([part["min"] for part in parts], axis=0).tolist(),
            "max": np.max([part["max"] for part in parts], axis=0).tolist(),
            "mean": middle.tolist(),
            "std": np.sqrt(np.maximum(spread - np.square(middle), 0.0)).tolist(),
            "count": [int(counts.sum())],
            **{key: mean(key).tolist() for key in parts[0] if key.startswith("q")},
        }
    return whole
