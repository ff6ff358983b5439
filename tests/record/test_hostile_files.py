"""Files of anybody: one byte changed, cut off, or nothing of a heptarm file at all; only heptarm's errors come out."""

from __future__ import annotations

import io
import json
import os
import random
import re
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from heptarm import devices
from heptarm.arm.link.target import parse_target
from heptarm.errors import CommandRejected, HeptarmError
from heptarm.io.keys import read_key_file
from heptarm.io.targets import saved_targets
from heptarm.panel.points import PointList
from heptarm.rl.policy import SHIPPED, Policy
from heptarm.sim.plant.scene import FOLDER, Scene
from heptarm.sim.runtime.project import read_process_data, read_project
from heptarm.sim.runtime.station import read_station
from heptarm.values.fitted_arm import load_fitted
from heptarm.values.mesh import mesh
from heptarm.values.motion.trajectory import Trajectory
from heptarm.values.robot import robot
from tests.long import longer
from tests.record.test_file import written
from tests.sim.station_setup import setup

#: Files of one kind that are tried.
TRIES = longer(120, 5000)
PROJECT = Path(__file__).parents[2] / "cabinet" / "project" / "RoboticsAPI.data.xml"
FRAMES = (
    '<persistence><processData id="a" dataType="java.lang.Integer" value="3"/><world><frame name="P1">'
    '<transformation x="1" y="2" z="3" a="0" b="0" c="0"/></frame></world>'
    '<toolTemplate name="T"><loadData mass="1.5" cogX="3"/></toolTemplate></persistence>'
)
TRAJECTORY = Trajectory.of(np.linspace(0, 1, 20), np.linspace(0, 0.5, 140).reshape(20, 7), robot="iiwa14")
#: Begin of a compressed chunk.
ZSTD = b"\x28\xb5\x2f\xfd"
TARGETS = '[lab1]\naddress = "172.31.1.147"\nspeed = 0.3\nflange = "touch"\n\n[lab2]\naddress = "10.0.0.1"\n'


def _recording(path: Path) -> bytes:
    return written(path.with_suffix(".mcap"), 200, chunk=20_000, motion=5).read_bytes()


def _trajectory(path: Path) -> bytes:
    return TRAJECTORY.save(path.with_suffix(".npz"), overwrite=True).read_bytes()


def _inputs(path: Path) -> bytes:
    recorder = devices.recording(devices.synthetic(lambda t: [t, 0, 0, 0, 0, 0]), path, overwrite=True)
    for _ in range(20):
        recorder.read()
    recorder.close()
    return path.read_bytes()


def _points(_: Path) -> bytes:
    point = {
        "name": "P1",
        "move": "ptp",
        "q": [0.1] * 7,
        "pose": {"xyz": [0.5, 0, 0.5], "quat": [0, 1, 0, 0]},
        "tool": "",
    }
    content = {"kind": "heptarm points", "version": 1, "robot": "iiwa14", "points": [point]}
    return json.dumps(content, indent=2).encode()


def _table(_: Path) -> bytes:
    rows = ["t,q.A1,q.A2,q.A3,q.A4,q.A5,q.A6,q.A7"]
    rows += [",".join(f"{x:.4f}" for x in (0.1 * i, *[0.01 * i] * 7)) for i in range(20)]
    return ("\n".join(rows) + "\n").encode()


OBJ = b"v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
FITTED = b'robot = "iiwa14"\n[coulomb]\nvalue = [0.4, 0.4, 0.3, 0.3, 0.2, 0.1, 0.1]\nsource = "a run"\n'


def _load(path: Path) -> object:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # numpy's, of numbers in a damaged file
        return str(ha.load(path)), ha.load(path).to_pandas()


#: For each kind: suffix, what writes the bytes of a good file, and what reads a file.
KINDS: dict[str, tuple[str, Callable[[Path], bytes], Callable[[Path], object]]] = {
    "recording": (".mcap", _recording, _load),
    "trajectory": (".npz", _trajectory, Trajectory.load),
    "table": (".csv", _table, Trajectory.load),
    "policy": (".npz", lambda _: (SHIPPED / "reach-iiwa14.npz").read_bytes(), Policy.load),
    "inputs": (".jsonl", _inputs, devices.recorded),
    "points": (".json", _points, lambda path: PointList(robot("iiwa14")).load(path.read_bytes())),
    "targets": ("", lambda _: TARGETS.encode(), lambda _: saved_targets()),
    "key": (".key", lambda _: b"gate-rtyu-2345-mnbv-xcvb-7654-qwer\n", read_key_file),
    "scene": (".xml", lambda _: (FOLDER / "table.xml").read_bytes(), lambda path: Scene(path).read()),
    "process data": (".xml", lambda _: PROJECT.read_bytes(), read_process_data),
    "project": (".xml", lambda _: FRAMES.encode(), read_project),
    "mesh": (".obj", lambda _: OBJ, mesh),
    "fitted arm": (".toml", lambda _: FITTED, load_fitted),
    "station": (".cat", lambda _: setup().encode(), read_station),
}


def _mutations(good: bytes, source: random.Random) -> bytes:
    """A file of which one byte is changed, or that is cut off, or that has a piece more or less."""
    at = source.randrange(len(good))
    return source.choice(
        (
            good[:at] + bytes((good[at] ^ (1 << source.randrange(8)),)) + good[at + 1 :],
            good[:at] + bytes((source.choice((0, 255, ord('"'), ord("<"), ord("9"))),)) + good[at + 1 :],
            good[:at],
            good[:at] + source.randbytes(8) + good[at:],
            good[:at] + good[at + source.randrange(1, 9) :],
        )
    )


@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_file_ends_in_an_error_of_heptarm(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    suffix, write, read = KINDS[kind]
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    path = tmp_path / f"good{suffix}"
    if kind == "targets":
        path = tmp_path / "heptarm" / "targets.toml"
        path.parent.mkdir()
    good = write(path)
    path.write_bytes(good)
    path.chmod(0o600)
    read(path)  # the good one
    source, refused = random.Random(14), 0
    for attempt in range(TRIES):
        path.write_bytes(_mutations(good, source))
        try:
            read(path)
        except HeptarmError as error:
            refused += 1
            assert str(error), attempt
        except Exception as error:
            raise AssertionError(f"attempt {attempt} of {kind}: {type(error).__name__}: {error}") from error
    assert refused > TRIES // 20


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_no_such_file_at_all_is_refused(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    suffix, _, read = KINDS[kind]
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    path = tmp_path / f"bad{suffix}"
    if kind == "targets":
        path = tmp_path / "heptarm" / "targets.toml"
        path.parent.mkdir()
    for content in (
        b"\0" * 100,
        b"\xff\xfe" * 50,
        b"PK\x03\x04" + b"\xff" * 60,
        b"[" * 100_000,
        b"<a>" * 50_000,
    ):
        path.write_bytes(content)
        path.chmod(0o600)
        with pytest.raises(HeptarmError):
            read(path)


def test_a_mesh_with_a_vertex_of_many_digits_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "far.obj"
    path.write_bytes(OBJ.replace(b"f 1 3 2", b"f 1 3 999999999999999999999999"))
    with pytest.raises(CommandRejected, match="the number of a vertex has more than 18 digits"):
        mesh(path)


# ------------------------------------------------------------------------- place, and what can still be read


def test_a_damaged_recording_names_the_place_and_is_read_up_to_it(tmp_path: Path) -> None:
    path = written(tmp_path / "run.mcap", 2000, chunk=100_000)
    data = bytearray(path.read_bytes())
    whole = ha.load(path)
    chunk = data.index(ZSTD, len(data) // 2)
    data[chunk + 200] ^= 0x40
    path.write_bytes(data)
    with pytest.raises(
        CommandRejected, match=r"run\.mcap is damaged at byte \d+ of \d+: .*; before that are (\d+) states"
    ):
        ha.load(path)
    part = ha.load(path, damaged=True)
    assert 100 < len(part) < len(whole) and not part.complete and "at byte" in part.damage
    np.testing.assert_array_equal(part["q"], whole["q"][: len(part)])
    assert "damaged" in str(part) and "damaged" not in str(whole)


def test_a_recording_claims_no_memory_that_it_has_no_bytes_for(tmp_path: Path) -> None:
    path = written(tmp_path / "run.mcap", 100)
    data = bytearray(path.read_bytes())
    data[9:17] = (2**62).to_bytes(8, "little")  # the length of the first record
    path.write_bytes(data)
    with pytest.raises(CommandRejected, match="damaged at byte"):
        ha.load(path)


def test_arrays_claim_no_memory_that_they_have_no_bytes_for(tmp_path: Path) -> None:
    path = TRAJECTORY.save(tmp_path / "path")
    good = path.read_bytes()
    with zipfile.ZipFile(io.BytesIO(good)) as source, zipfile.ZipFile(path, "w") as target:
        for one in source.infolist():
            data = source.read(one)
            target.writestr(one.filename, data.replace(b"(20, 7), }   ", b"(20, 7000), }"))
    with pytest.raises(CommandRejected, match=r"is not a trajectory: array 'q\.npy': shape"):
        Trajectory.load(path)
    np.savez(path, x=np.array([object()], dtype=object), allow_pickle=True)
    with pytest.raises(CommandRejected, match="objects, which could be code"):
        Trajectory.load(path)


# ------------------------------------------------------------------------------------- writers replace nothing


def test_writers_refuse_to_replace(tmp_path: Path) -> None:
    run = ha.load(written(tmp_path / "run.mcap", 200))
    from heptarm.record.convert import convert

    writers: dict[str, Callable[[Path, bool], object]] = {
        "a.npz": lambda path, over: TRAJECTORY.save(path, overwrite=over),
        "b.csv": lambda path, over: convert(run, path, overwrite=over),
        "c.png": lambda path, over: run.chart("q").save(path, overwrite=over),
        "d.jsonl": lambda path, over: devices.recording(
            devices.synthetic(lambda _: None), path, overwrite=over
        ).close(),
        "e.npz": lambda path, over: Policy.load(SHIPPED / "reach-iiwa14.npz").save(path, overwrite=over),
    }
    for name, write in writers.items():
        path = tmp_path / name
        path.write_text("mine")
        with pytest.raises(CommandRejected, match=f"{name} exists .*overwrite=True"):
            write(path, False)
        assert path.read_text() == "mine", name
        write(path, True)
        assert path.read_bytes() != b"mine", name
        path.unlink()
        os.symlink(tmp_path / "nowhere", path)  # a link without a target is in the way as well
        with pytest.raises(CommandRejected, match="exists"):
            write(path, False)


# -------------------------------------------------------------------------------------------- names and pipes


def test_a_pipe_is_no_file(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.npz"
    os.mkfifo(pipe, 0o600)
    readers = (read_key_file, Trajectory.load, ha.load, devices.recorded, read_process_data, read_station)
    for read in readers:
        with pytest.raises(CommandRejected, match="it is a pipe, a device or a socket"):
            read(pipe)
    for read in readers:
        with pytest.raises(CommandRejected):
            read(Path("/dev/zero"))


def test_names_that_no_file_can_have(tmp_path: Path) -> None:
    for name in ("a\0b", "x" * 300, "", "a\ud800"):
        for read in (Trajectory.load, ha.load, devices.recorded, lambda name: read_key_file(Path(name))):
            with pytest.raises(CommandRejected):
                read(name)
        with pytest.raises(CommandRejected):
            ha.CollisionModel("iiwa14", scene=name or "no such scene")
    with pytest.raises(CommandRejected, match="NUL"):
        TRAJECTORY.save(tmp_path / "a\0b")


@pytest.mark.parametrize(
    "target",
    [
        "a" * 300,
        "a\0b",
        "1.2.3.4\0",
        f"{'a' * 70}.example.com",
        "sim://" + "a" * 300,
        "sim://iiwa14?project=a\0b",
        "sim://iiwa14?scene=a%00b",
        "sim://iiwa14?project=\ud800",
    ],
)
def test_targets_that_no_host_has(target: str) -> None:
    with pytest.raises(HeptarmError) as error:
        ha.connect(target, timeout=1.0)
    assert len(str(error.value)) < 900


def test_a_target_in_a_file_of_another_editor(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    file = tmp_path / "heptarm" / "targets.toml"
    file.parent.mkdir()
    file.write_bytes(b"\xef\xbb\xbf" + TARGETS.replace("\n", "\r\n").encode())
    assert parse_target("lab1").host == "172.31.1.147"
    assert saved_targets()["lab1"].speed == 0.3
    file.write_bytes(b'[lab1]\naddress = "a\\u0000b"\n')
    with pytest.raises(CommandRejected, match="address must have no NUL"):
        saved_targets()
    file.write_bytes(b"[" + b"a" * 300 + b']\naddress = "1.2.3.4"\n')
    with pytest.raises(CommandRejected, match="up to 64 letters"):
        saved_targets()
    file.write_bytes(b"[lab1]\naddress = \xff\n")
    with pytest.raises(CommandRejected, match="line 2 has bytes that are not UTF-8"):
        saved_targets()


# ---------------------------------------------------------------------------------------- scenes and projects


def scene(tmp_path: Path, body: str, assets: str = "") -> Scene:
    path = tmp_path / "scene.xml"
    path.write_text(f"<mujoco><asset>{assets}</asset><worldbody>{body}</worldbody></mujoco>")
    return Scene(path)


def test_a_number_of_a_scene_that_is_none_is_named(tmp_path: Path) -> None:
    one = '<body name="peg" pos="0 nan 0"><geom size="0.1"/></body>'
    with pytest.raises(CommandRejected, match="pos of the body 'peg' must be finite numbers, got '0 nan 0'"):
        scene(tmp_path, one).read()
    with pytest.raises(CommandRejected, match="pos of the body 'peg'"):
        ha.CollisionModel("iiwa14", scene=str(tmp_path / "scene.xml"))


def test_a_mesh_in_millimetres_is_asked_about(tmp_path: Path) -> None:
    corners = [(x, y, z) for x in (0, 60) for y in (0, 40) for z in (0, 20)]
    (tmp_path / "part.obj").write_text(
        "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "f 1 2 3\nf 2 3 4\nf 5 6 7\nf 6 7 8\n"
    )
    body = '<body name="part" pos="2 0 1"><geom type="mesh" mesh="part"/></body>'
    scene(tmp_path, body, '<mesh name="part" file="part.obj"/>')
    with pytest.raises(CommandRejected, match=r"mesh 'part' is 60 m large.*millimetres\?.*scale=") as error:
        ha.CollisionModel("iiwa14", scene=str(tmp_path / "scene.xml"))
    assert error.value.parameter == "scene"
    scene(tmp_path, body, '<mesh name="part" file="part.obj" scale="0.001 0.001 0.001"/>')
    ha.CollisionModel("iiwa14", scene=str(tmp_path / "scene.xml"))


def test_process_data_as_java_reads_them(tmp_path: Path) -> None:
    file = tmp_path / "data.xml"
    one = "<a><processData id='x' dataType='java.lang.{}' value='{}'/></a>"
    for text, value in (("True", True), ("FALSE", False), ("true", True)):
        file.write_text(one.format("Boolean", text))
        assert read_process_data(file).values == {"x": value}
    for kind, text in (("Double", "nan"), ("Double", "1e999"), ("Integer", "9999999999"), ("Boolean", "yes")):
        file.write_text(one.format(kind, text))
        data = read_process_data(file)  # who asks for it is refused
        assert not data.values and data.unusable["x"].startswith("data.xml: ")
    file.write_bytes(b"\xef\xbb\xbf" + one.format("Boolean", "True").replace("><", ">\r\n<").encode())
    assert read_process_data(file).values == {"x": True}


# ---------------------------------------------------------------------------------- tables of other programs


def table(tmp_path: Path, *lines: str) -> Path:
    path = tmp_path / "moves.csv"
    path.write_text("\r\n".join(lines) + "\r\n", encoding="utf-8-sig")
    return path


def test_seven_columns_are_a_trajectory(tmp_path: Path) -> None:
    rows = [",".join(f"{0.1 * i:g}" for _ in range(7)) for i in range(3)]
    found = Trajectory.load(table(tmp_path, *rows), rate=50)
    assert found.times.tolist() == [0.0, 0.02, 0.04] and found.q[2].tolist() == pytest.approx([0.2] * 7)
    named = Trajectory.load(
        table(
            tmp_path,
            "joint_1;joint_2;joint_3;joint_4;joint_5;joint_6;joint_7",
            *(row.replace(",", ";") for row in rows),
        )
    )
    assert (named.q == found.q).all()


def test_eight_columns_begin_with_the_time_and_of_more_the_named_ones_count(tmp_path: Path) -> None:
    rows = [f"{0.5 * i:g} " + " ".join([f"{0.1 * i:g}"] * 7) for i in range(3)]
    assert Trajectory.load(table(tmp_path, "# mine", *rows)).times.tolist() == [0.0, 0.5, 1.0]
    names = ",".join(["t", *(f"tau.A{i}" for i in range(1, 8)), *(f"q.A{i}" for i in range(1, 8))])
    rows = [",".join([f"{0.5 * i:g}", *["9"] * 7, *[f"{0.1 * i:g}"] * 7]) for i in range(3)]
    found = Trajectory.load(table(tmp_path, names, *rows))
    assert found.duration == 1.0 and found.q[1].tolist() == [0.1] * 7


@pytest.mark.parametrize(
    "name", ["Time (s)", "time_s", "t [s]", "sec", "Seconds", "timestamp_sec", "time[seconds]", "t_s"]
)
@pytest.mark.parametrize("joints", [[f"q{i}" for i in range(1, 8)], list("abcdefg")], ids=["named", "others"])
def test_a_column_of_seconds_has_many_names(tmp_path: Path, name: str, joints: list[str]) -> None:
    rows = [",".join([f"{0.05 * i:g}", *[f"{0.1 * i:g}"] * 7]) for i in range(3)]
    for rate in (None, 10.0):
        found = Trajectory.load(table(tmp_path, ",".join([name, *joints]), *rows), rate=rate)
        assert found.times.tolist() == pytest.approx([0.0, 0.05, 0.1])


@pytest.mark.parametrize(
    "name", ["time [ms]", "time_ns", "timestamp_ns", "stamp", "t_ms", "msec", "milliseconds", "ms", "elapsed"]
)
@pytest.mark.parametrize("joints", [[f"q{i}" for i in range(1, 8)], list("abcdefg")], ids=["named", "others"])
def test_times_that_may_not_be_seconds_need_a_rate(tmp_path: Path, name: str, joints: list[str]) -> None:
    rows = [",".join([f"{50 * i}", *[f"{0.1 * i:g}"] * 7]) for i in range(3)]
    file = table(tmp_path, ",".join([name, *joints]), *rows)
    with pytest.raises(
        CommandRejected, match=rf"its column '{re.escape(name)}' seems to have times .*give rate"
    ):
        Trajectory.load(file)
    found = Trajectory.load(file, rate=20.0)
    assert found.times.tolist() == pytest.approx([0.0, 0.05, 0.1]) and found.q[1].tolist() == [0.1] * 7


def test_columns_that_begin_with_t_are_no_times(tmp_path: Path) -> None:
    rows = [",".join([f"{0.1 * i:g}"] * 10) for i in range(3)]
    names = ",".join(["tau.A1", "second_arm", "t1", *(f"q{i}" for i in range(1, 8))])
    assert Trajectory.load(table(tmp_path, names, *rows)).duration == pytest.approx(0.02)


def test_a_table_that_heptarm_has_converted_is_a_trajectory(tmp_path: Path) -> None:
    from heptarm.record.convert import convert

    run = ha.load(written(tmp_path / "run.mcap", 200))
    (file,) = convert(run, tmp_path / "run.csv")
    assert Trajectory.load(file).q == pytest.approx(run["q"])


@pytest.mark.parametrize(
    ("lines", "text"),
    [
        (["x,y,z", "1,2,3", "2,3,4"], "its columns are 'x, y, z' .*seven columns"),
        (["1,2,3", "2,3,4"], "its columns are 3"),
        (["0,0,0,0,0,0,0", "0,0,0,0,0,0,up"], "line 2, column 7: 'up' is no finite number"),
        (["q.A1,q.A2,q.A3,q.A4,q.A5,q.A6,q.A7", "0,0,0,0,0,0,0", "0,0,nan,0,0,0,0"], "line 3, q.A3: 'nan'"),
        (["0,0,0,0,0,0,0", "0,0,0,0"], "line 2, column 5: '' is no finite"),
        (["0,0,0,0,0,0,0", "0,0,0,-90,0,0,0"], "line 2, A4: -90 rad is more than a turn .*degrees"),
        (["0,0,0,0,0,0,0"], "it has 1 rows"),
        ([""], "it is empty"),
        (["0,1,1,1,1,1,1,1", "0,1,1,1,1,1,1,1"], "times must be strictly ascending"),
    ],
)
def test_what_is_no_table_of_joints_is_named(tmp_path: Path, lines: list[str], text: str) -> None:
    with pytest.raises(CommandRejected, match=text):
        Trajectory.load(table(tmp_path, *lines))
