"""Generates the Python code of ROS 1 interface packages without catkin.

    build/ros1/bin/python scripts/ros1_interfaces.py OUTPUT PACKAGE_FOLDER... --site SITE_PACKAGES

For machines that have rospy from their distribution. In a catkin workspace, catkin does this. The packages of OUTPUT
count only where Python finds no others of their names: some are a part of packages that a distribution has whole, and
which others need, as tf does tf2_msgs.
"""

from __future__ import annotations

import argparse
import importlib
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

#: Where Debian's packages keep the definitions of ROS' own messages.
DEFINITIONS = Path("/usr/share")
_STATUS = "std_msgs/Header header\nactionlib_msgs/GoalStatus status\n"
_GOAL = "std_msgs/Header header\nactionlib_msgs/GoalID goal_id\n"


def messages_of_action(name: str, text: str) -> dict[str, str]:
    """The seven messages that an action stands for, by name.

    Raises:
        ValueError: the definition has not three parts.
    """
    parts: list[str] = [""]
    for line in text.splitlines():
        if line.strip() == "---":
            parts.append("")
        else:
            parts[-1] += line + "\n"
    if len(parts) != 3:
        raise ValueError(f"{name} has {len(parts)} parts; goal, result and feedback are wanted")
    found = dict(zip((f"{name}Goal", f"{name}Result", f"{name}Feedback"), parts))
    found[f"{name}ActionGoal"] = f"{_GOAL}{name}Goal goal\n"
    found[f"{name}ActionResult"] = f"{_STATUS}{name}Result result\n"
    found[f"{name}ActionFeedback"] = f"{_STATUS}{name}Feedback feedback\n"
    found[f"{name}Action"] = (
        f"{name}ActionGoal action_goal\n{name}ActionResult action_result\n{name}ActionFeedback action_feedback\n"
    )
    return found


def generate(source: Path, out: Path, others: Sequence[Path] = ()) -> int:
    """Generate one package.

    Args:
        source: folder with msg/, srv/, action/, named as the package.
        out: folder for the Python package.
        others: folders of packages that it may refer to, besides those of Debian.

    Returns:
        How many messages and services it has.

    Raises:
        ValueError: a definition is none.
    """
    generator = importlib.import_module("genpy.generator")
    init = importlib.import_module("genpy.generate_initpy")
    package = source.name
    shutil.rmtree(out / package, ignore_errors=True)
    (out / package).mkdir(parents=True)
    (out / package / "__init__.py").touch()
    count = 0
    with tempfile.TemporaryDirectory(prefix="genpy_") as work:
        places = {"msg": Path(work) / "msg", "srv": source / "srv"}
        places["msg"].mkdir()
        for path in source.glob("msg/*.msg"):
            shutil.copy(path, places["msg"])
        for path in source.glob("action/*.action"):
            for name, text in messages_of_action(path.stem, path.read_text(encoding="utf-8")).items():
                (places["msg"] / f"{name}.msg").write_text(text, encoding="utf-8")
        search = {path.parent.name: [str(path)] for path in DEFINITIONS.glob("*/msg")}
        search.update({path.name: [str(path / "msg")] for path in others if (path / "msg").is_dir()})
        search[package] = [str(places["msg"])]
        for kind, maker in (("msg", generator.MsgGenerator()), ("srv", generator.SrvGenerator())):
            files = sorted(str(path) for path in places[kind].glob(f"*.{kind}"))
            if not files:
                continue
            target = out / package / kind
            target.mkdir()
            if maker.generate_messages(package, files, str(target), search):
                raise ValueError(f"{package}: a definition was not understood; see above")
            init.write_modules(str(target))
            count += len(files)
    return count


def fallback(folder: Path) -> str:
    """Text of a path file by which Python finds the packages of a folder after all others, whenever installed."""
    # one line, whose names are gone when the lambda is called
    return (
        "import sys; sys.meta_path.append(type('Interfaces', (), {'find_spec': staticmethod(lambda name, path=None, "
        "target=None: None if path else __import__('importlib.machinery').machinery.PathFinder.find_spec("
        f"name, [{str(folder)!r}]))}}))\n"
    )


def main() -> int:
    """Generates the packages named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("packages", nargs="+", type=Path)
    parser.add_argument("--site", type=Path, required=True)
    given = parser.parse_args()
    (given.site / "heptarm_interfaces.pth").write_text(fallback(given.out.resolve()), encoding="utf-8")
    for source in given.packages:
        shutil.rmtree(given.site / source.name, ignore_errors=True)  # where earlier versions put it
        print(f"{source.name}: {generate(source, given.out, given.packages)} messages and services")
    return 0


if __name__ == "__main__":
    sys.exit(main())
