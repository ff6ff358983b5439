"""The Dockerfile, the dev container and the pixi environment agree with the project; no builder is needed."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[2]
INSTRUCTIONS = {"FROM", "RUN", "WORKDIR", "COPY", "ENV", "ENTRYPOINT", "CMD"}
DOCKERFILE = (ROOT / "Dockerfile").read_text(encoding="utf-8")


def test_the_dockerfile_has_known_instructions_and_existing_targets() -> None:
    joined = re.sub(r"\\\n\s*", "", re.sub(r"^#.*\n", "", DOCKERFILE, flags=re.M))
    assert {line.split()[0] for line in joined.splitlines() if line} <= INSTRUCTIONS
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for targets in re.findall(r"^RUN make (.*)$", DOCKERFILE, re.M):
        for target in targets.split():
            assert re.search(rf"^{target}:", makefile, re.M), target
    for name in ("ENTRYPOINT", "CMD"):
        for value in re.findall(rf"^{name} (.*)$", DOCKERFILE, re.M):
            assert isinstance(json.loads(value), list)
    for installation in re.findall(r"apt-get install.*", joined):
        assert "--no-install-recommends" in installation and "rm -rf /var/lib/apt/lists" in installation


def test_what_the_system_installs_is_what_the_set_up_would_install() -> None:
    for script in ("scripts/setup_compiler.sh", "cabinet/toolchain.py"):
        (asked,) = set(
            re.findall(
                r"--no-install-recommends ([a-z][\w. -]*)", (ROOT / script).read_text(encoding="utf-8")
            )
        )
        assert set(asked.split()) <= set(DOCKERFILE.split())


def test_the_dev_container_is_a_stage_of_the_dockerfile() -> None:
    container = json.loads((ROOT / ".devcontainer/devcontainer.json").read_text(encoding="utf-8"))
    assert f" AS {container['build']['target']}\n" in DOCKERFILE
    assert (ROOT / ".devcontainer" / container["build"]["dockerfile"]).resolve() == ROOT / "Dockerfile"


def test_the_pixi_environment_takes_the_python_of_the_project() -> None:
    pixi = tomllib.loads((ROOT / "pixi.toml").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert pixi["dependencies"]["python"].split(",")[0] == project["requires-python"]
    assert set(re.findall(r"[(\[](\w+(?:,\w+)*)\]", pixi["tasks"]["install"])[0].split(",")) <= set(
        project["optional-dependencies"]
    )
