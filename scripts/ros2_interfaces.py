"""Generates, compiles and installs ROS 2 interface packages into the running environment without CMake and ament.

    build/ros2/bin/python scripts/ros2_interfaces.py PACKAGE_FOLDER...

For machines without ROS: the environment has rclpy from PyPI's wheels, and the machine has gcc and g++. On a machine
with ROS, colcon does this. The command `rosidl generate` refuses to run in such an environment (every wheel carries its
entry points twice), so the generators behind it are called directly.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import importlib
import inspect
import io
import logging
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

#: Packages that ours may refer to.
DEPENDENCIES = (
    "builtin_interfaces",
    "std_msgs",
    "geometry_msgs",
    "sensor_msgs",
    "shape_msgs",
    "trajectory_msgs",
    "object_recognition_msgs",
    "octomap_msgs",
    "action_msgs",
    "service_msgs",
    "unique_identifier_msgs",
)
#: rmw_fastrtps takes the first; without the second it complains, once per process.
SUPPORTS = ("rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c")
#: Generators: module, class, folder of their output.
GENERATORS = (
    ("rosidl_generator_c.cli", "GenerateC", "c"),
    ("rosidl_typesupport_fastrtps_c.cli", "GenerateFastRTPSCTypesupport", "fast"),
    ("rosidl_typesupport_introspection_c.cli", "GenerateIntrospectionCTypesupport", "introspection"),
    ("rosidl_typesupport_c.cli", "GenerateCTypesupport", "support"),
    ("rosidl_generator_py.cli", "GeneratePython", "py"),
)
RUNTIME = ("rosidl_runtime_c", "rcutils")
#: What each generated file in C++ includes first; compiled once, a file takes a quarter of the time.
COMMON = (
    *("<cassert>", "<cstddef>", "<limits>", "<string>", '"fastcdr/Cdr.h"'),
    '"rosidl_typesupport_fastrtps_c/serialization_helpers.hpp"',
    '"rosidl_typesupport_fastrtps_c/wstring_conversion.hpp"',
    '"rosidl_typesupport_fastrtps_cpp/message_type_support.h"',
)
#: Generated files that are compiled at once.
TOGETHER = 20
# to optimise doubles the time of a set-up for tests
FLAGS = ("-O0", "-fPIC", "-w")
STANDARDS = {".c": ("gcc", "-std=gnu11"), ".cpp": ("g++", "-std=c++17")}


#: What upstream's generators match definitions and descriptions with: by the name alone, which a message and an action
#: may have in common, as in control_msgs/GripperCommand.
_MATCHING = "build_type_description_tuples"


def _described(definitions: Sequence[str], descriptions: Sequence[str]) -> list[str]:
    """Match definitions "folder:msg/Name.idl" with descriptions of the same kind and name."""
    found = {(path.parent.name, path.stem): path for path in map(Path, descriptions)}
    relative = [Path(definition.rpartition(":")[2]) for definition in definitions]
    return [f"{path}:{found[path.parent.name, path.stem]}" for path in relative]


class Package:
    """An interface package to install into the environment.

    Args:
        source: folder with msg/, srv/, action/.
        prefix: where to install.
        work: a folder to work in.
        common: the header of `compiled_headers`.
    """

    def __init__(self, source: Path, prefix: Path, work: Path, common: Path) -> None:
        self.name = source.name
        self.source, self.prefix, self.work, self.common = source, prefix, work, common
        self.generated = work / "generated"
        self.libraries = work / "lib"
        self.libraries.mkdir(parents=True)
        self.files = [
            path.relative_to(source)
            for kind in ("msg", "srv", "action")
            for path in sorted(source.glob(f"{kind}/*.{kind}"))
        ]
        self.dependencies = [name for name in DEPENDENCIES if (prefix / "share" / name).is_dir()]
        self._pool = ThreadPoolExecutor(os.cpu_count())

    def install(self) -> None:
        """Generate, compile, copy."""
        self._generate()
        self._compile()
        self._copy()
        self._pool.shutdown()

    # ---------------------------------------------------------------------------------- generate

    def _generate(self) -> None:
        from rosidl_cli.command.translate.api import translate
        from rosidl_generator_type_description.cli import HashTypeDescription

        folders = [str(self.prefix / "share" / name) for name in self.dependencies]
        folder = self.work / self.name
        translate(
            package_name=self.name,
            interface_files=[f"{self.source}:{path}" for path in self.files],
            include_paths=folders,
            output_format="idl",
            output_path=folder,
        )
        idl = [f"{folder}:{path.relative_to(folder)}" for path in sorted(folder.rglob("*.idl"))]
        HashTypeDescription("hash").generate_type_hashes(self.name, idl, folders, output_path=folder)
        described = [str(path) for path in sorted(folder.rglob("*.json"))]
        for module_name, name, place in GENERATORS:
            module = importlib.import_module(module_name)
            if hasattr(module, _MATCHING):
                setattr(module, _MATCHING, _described)
            self._run(getattr(module, name), place, idl, folders, described)

    def _run(
        self, kind: Any, place: str, idl: Sequence[str], folders: Sequence[str], described: Sequence[str]
    ) -> None:
        settings: dict[str, Any] = {}
        if place in ("support", "py"):
            settings["typesupport_implementations"] = (
                list(SUPPORTS) if place == "support" else ["rosidl_typesupport_c"]
            )
        generator = kind(place, **settings)
        out = self.generated / place / self.name
        out.mkdir(parents=True)
        words: dict[str, Any] = {"output_path": out}
        if "type_description_files" in inspect.signature(generator.generate).parameters:
            words["type_description_files"] = described
        generator.generate(self.name, idl, folders, **words)

    # ----------------------------------------------------------------------------------- compile

    def _compile(self) -> None:
        import numpy

        name, here = self.name, self.generated
        python = [f"-I{sysconfig.get_paths()['include']}", f"-I{numpy.get_include()}"]
        own = f"{name}__rosidl_generator_c"
        self._link(
            self._library(own),
            self._objects((here / "c").rglob("*.c"), [f"-DROSIDL_GENERATOR_C_BUILDING_DLL_{name}"]),
            [*RUNTIME, *self._of_dependencies("rosidl_generator_c")],
        )
        self._link(
            self._library(f"{name}__{SUPPORTS[0]}"),
            self._objects((here / "fast").rglob("*.c*")),
            [
                own,
                SUPPORTS[0],
                "rosidl_typesupport_fastrtps_cpp",
                "fastcdr",
                "rmw",
                *RUNTIME,
                *self._of_dependencies(SUPPORTS[0]),
                *self._of_dependencies("rosidl_generator_c"),
            ],
        )
        self._link(
            self._library(f"{name}__{SUPPORTS[1]}"),
            self._objects((here / "introspection").rglob("*.c")),
            [
                own,
                SUPPORTS[1],
                *RUNTIME,
                *self._of_dependencies(SUPPORTS[1]),
                *self._of_dependencies("rosidl_generator_c"),
            ],
        )
        support = f"{name}__rosidl_typesupport_c"
        self._link(
            self._library(support),
            self._objects((here / "support").rglob("*.c*")),
            [own, "rosidl_typesupport_c", *RUNTIME, *self._of_dependencies("rosidl_typesupport_c")],
        )
        sources = sorted((here / "py" / name).rglob("*.c"))
        doors = [path for path in sources if ".ep." in path.name]
        helper = f"{name}__rosidl_generator_py"
        self._link(
            self._library(helper),
            self._objects([path for path in sources if path not in doors], python),
            [own, support, *RUNTIME, *self._of_dependencies("rosidl_generator_py")],
        )
        suffix = sysconfig.get_config_var("EXT_SUFFIX")
        for door in doors:
            kind = door.name.split(".ep.")[1].removesuffix(".c")
            target = here / "py" / name / f"{name}_s__{kind}{suffix}"
            self._link(target, self._objects([door], python), [helper, support, own, *RUNTIME])

    def _objects(self, sources: Iterable[Path], flags: Sequence[str] = ()) -> list[str]:
        found = sorted(path for path in sources if path.suffix in (".c", ".cpp"))
        return list(self._pool.map(lambda path: self._object(path, flags), self._together(found)))

    def _together(self, sources: Sequence[Path]) -> list[Path]:
        """Files that include many: what all of them include themselves takes most of a compiler's time.

        Descriptions stay alone, since they have static variables of the same names.
        """
        alone = [path for path in sources if path.name.endswith("__description.c")]
        groups: dict[tuple[Path, str], list[Path]] = {}
        for path in sources:
            if path not in alone:
                groups.setdefault((path.parent, path.suffix), []).append(path)
        for (folder, suffix), several in groups.items():
            for number in range(0, len(several), TOGETHER):
                file = folder / f"together_{several[number].name.removesuffix(suffix)}{suffix}"
                lines = (f'#include "{path}"\n' for path in several[number : number + TOGETHER])
                file.write_text("".join(lines))
                alone.append(file)
        return alone

    def _object(self, source: Path, flags: Sequence[str]) -> str:
        target = self.work / "o" / (str(source.relative_to(self.generated)).replace("/", "__") + ".o")
        target.parent.mkdir(exist_ok=True)
        command = [*STANDARDS[source.suffix], *FLAGS, *flags]
        if source.suffix == ".cpp":
            command += ["-include", str(self.common)]
        command += [f"-I{self.generated / place}" for _, _, place in GENERATORS[:4]]
        command += [*_includes(self.prefix), "-c", str(source), "-o", str(target)]
        subprocess.run(command, check=True)
        return str(target)

    def _link(self, target: Path, objects: Sequence[str], libraries: Sequence[str]) -> None:
        lib = self.prefix / "lib"
        command = ["g++", "-shared", "-o", str(target), *objects, f"-L{self.libraries}", f"-L{lib}"]
        command += [f"-Wl,-rpath-link,{lib}", *(f"-l{library}" for library in libraries)]
        subprocess.run(command, check=True)

    def _library(self, name: str) -> Path:
        return self.libraries / f"lib{name}.so"

    def _of_dependencies(self, kind: str) -> list[str]:
        names = [f"{name}__{kind}" for name in self.dependencies]
        return [name for name in names if (self.prefix / "lib" / f"lib{name}.so").exists()]

    # -------------------------------------------------------------------------------------- copy

    def _copy(self) -> None:
        version = f"python{sys.version_info[0]}.{sys.version_info[1]}"
        site = self.prefix / "lib" / version / "site-packages" / self.name
        resources = self.prefix / "share" / self.name
        for folder in (site, resources):
            shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(self.generated / "py" / self.name, site, ignore=shutil.ignore_patterns("*.c", "tmp"))
        for library in self.libraries.iterdir():
            shutil.copy2(library, self.prefix / "lib" / library.name)
        shutil.copytree(self.work / self.name, resources)
        for path in self.files:
            shutil.copy2(self.source / path, resources / path)
        if (self.source / "package.xml").exists():
            shutil.copy2(self.source / "package.xml", resources)
        headers = shutil.ignore_patterns("*.c", "*.cpp", "tmp")
        for _, _, place in GENERATORS[:4]:
            target = self.prefix / "include" / self.name / self.name
            shutil.copytree(self.generated / place / self.name, target, dirs_exist_ok=True, ignore=headers)
        index = self.prefix / "share" / "ament_index" / "resource_index" / "packages"
        index.mkdir(parents=True, exist_ok=True)
        (index / self.name).touch()


def _includes(prefix: Path) -> list[str]:
    folders = sorted(path for path in (prefix / "include").iterdir() if path.is_dir())
    return [f"-I{path}" for path in (*folders, prefix / "include")]


def compiled_headers(prefix: Path, folder: Path) -> Path:
    """Write a header with what is common to all files in C++, and compile it; g++ takes what is beside it."""
    header = folder / "common.hpp"
    header.write_text("".join(f"#include {name}\n" for name in COMMON))
    command = [*STANDARDS[".cpp"], *FLAGS, *_includes(prefix), "-x", "c++-header", str(header)]
    subprocess.run([*command, "-o", f"{header}.gch"], check=True)
    return header


def _parse_once() -> None:
    """Keep what the parser of upstream's generators makes of a file; each of the five would parse it again."""
    parser: Any = importlib.import_module("rosidl_parser.parser")
    parser.get_ast_from_idl_string = functools.cache(parser.get_ast_from_idl_string)


def _in_order(sources: Iterable[Path]) -> list[Path]:
    """Put packages that others refer to before these."""
    names = {name: place for place, name in enumerate(DEPENDENCIES)}
    return sorted(sources, key=lambda source: names.get(source.resolve().name, len(names)))


def main() -> int:
    """Installs the packages named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("packages", nargs="+", type=Path)
    prefix = Path(sys.prefix)
    os.environ["AMENT_PREFIX_PATH"] = str(prefix)
    logging.disable(logging.WARNING)
    sources = _in_order(parser.parse_args().packages)
    _parse_once()
    shown = sys.stdout
    with (
        tempfile.TemporaryDirectory(prefix="rosidl_") as shared,
        # one for all: empy puts itself before the first standard output, and fails where it finds another one later
        contextlib.redirect_stdout(io.StringIO()),
    ):
        common = compiled_headers(prefix, Path(shared))
        for source in sources:
            with tempfile.TemporaryDirectory(prefix="rosidl_") as work:
                package = Package(source.resolve(), prefix, Path(work), common)
                package.install()
                print(f"{package.name}: {len(package.files)} interfaces", file=shown, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
