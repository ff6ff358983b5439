"""Write the codecs, the C++ client, the golden vectors, the protocol pages and the headers of the parts in C from the schema.

python schema/generate.py           write
python schema/generate.py --check   fail if anything that is committed differs from the schema
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import cpp
import docs
import java
import key_vectors
import native
import plant
import process_data
import python
import sample_bodies
import spec as schema

ROOT = schema.HERE.parent
JAVA = ROOT / "cabinet" / "core" / "src" / "heptarm" / "wire"
APP = ROOT / "cabinet" / "app" / "src" / "heptarm" / "app"
SEAM = ROOT / "cabinet" / "doubles" / "src" / "heptarm" / "doubles" / "seam"


def outputs() -> dict[Path, str]:
    spec = schema.load()
    wire = ROOT / "src" / "heptarm" / "wire"
    pages = ROOT / "docs" / "reference"
    result = {
        wire / "messages.py": python.messages(spec),
        wire / "codes.py": python.codes(spec),
        wire / "states.py": python.states(spec),
        pages / "protocol.md": docs.protocol(spec),
        pages / "protocol-messages.md": docs.messages(spec),
        pages / "protocol-types.md": docs.types(spec),
        pages / "errors.md": docs.errors(spec),
        ROOT / "native" / "fri_layout.h": native.header(),
        ROOT / "native" / "tick_layout.h": native.tick_header(),
        ROOT / "src" / "heptarm" / "fri" / "loop" / "include" / "heptarm_law.h": native.law_header(),
        ROOT / "native" / "frame_layout.h": native.frame_header(spec),
        ROOT / "cpp" / "include" / "heptarm" / "heptarm.hpp": cpp.header(spec),
        ROOT / "cpp" / "include" / "heptarm" / "models.hpp": native.models_header(),
        schema.HERE / "golden" / "vectors.json": json.dumps(sample_bodies.golden(spec), indent=1) + "\n",
        schema.HERE / "golden" / "key.json": json.dumps(key_vectors.vectors(spec), indent=1) + "\n",
    }
    settings, project = process_data.load(schema.HERE), ROOT / "cabinet" / "project"
    guide = project / "INSTALL.md"
    result |= {
        project / "RoboticsAPI.data.xml": process_data.project(settings),
        guide: process_data.table(settings, guide.read_text(encoding="utf-8")),
        APP / "ProcessDefaults.java": process_data.java(settings),
    }
    seam = plant.load()
    result[ROOT / "src" / "heptarm" / "planning" / "seam.py"] = plant.python_module(seam)
    result |= {SEAM / name: text for name, text in plant.java_files(seam).items()}
    return result | {JAVA / name: text for name, text in java.files(spec).items()}


def stale(current: set[Path]) -> list[Path]:
    """Generated classes that the schema no longer has."""
    found = [path for folder in (JAVA, SEAM) for path in folder.glob("*.java") if path not in current]
    return [path for path in found if path.read_text(encoding="utf-8").startswith("// Generated")]


def main() -> int:
    differing = []
    texts = outputs()
    for path in stale(set(texts)):
        differing.append(path.relative_to(ROOT))
        if "--check" not in sys.argv:
            path.unlink()
    for path, text in texts.items():
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            differing.append(path.relative_to(ROOT))
            if "--check" not in sys.argv:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text, encoding="utf-8")
    if "--check" in sys.argv and differing:
        print("differs from the schema; run python schema/generate.py:", *differing, sep="\n  ")
        return 1
    print(f"{len(differing)} files written" if differing else "everything agrees with the schema")
    return 0


if __name__ == "__main__":
    sys.exit(main())
