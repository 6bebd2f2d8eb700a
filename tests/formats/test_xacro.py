"""xacro files in: arguments, packages, includes, and a process that cannot reach anything else."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from kinegen.errors import RobotFileError
from kinegen.io.format import ReadOptions
from kinegen.io.load import load
from kinegen.io.xacro import expand, sandbox
from kinegen.io.xacro.expand import expanded
from kinegen.model.robot import Robot

MAIN = """\
<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="prefix" default="left_"/>
  <xacro:include filename="$(find arm_parts)/urdf/joint.xacro"/>
  <link name="world"/>
  <xacro:moving name="$(arg prefix)hip" length="${2*0.1}"/>
</robot>
"""
PART = """\
<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="moving" params="name length">
    <link name="${name}_link"/>
    <joint name="${name}" type="continuous">
      <parent link="world"/><child link="${name}_link"/>
      <origin xyz="${length} 0 0" rpy="${pi/2} 0 0"/><axis xyz="0 0 1"/>
    </joint>
  </xacro:macro>
</robot>
"""


@pytest.fixture
def main(tmp_path: Path) -> Path:
    """A xacro file that includes another package."""
    (tmp_path / "elsewhere" / "urdf").mkdir(parents=True)
    (tmp_path / "elsewhere" / "urdf" / "joint.xacro").write_text(PART)
    (tmp_path / "arm").mkdir()
    path = tmp_path / "arm" / "arm.urdf.xacro"
    path.write_text(MAIN)
    return path


def test_arguments_and_packages(main: Path) -> None:
    packages = (("arm_parts", str(main.parent.parent / "elsewhere")),)
    robot = load(main, ReadOptions(packages=packages))
    assert [row.name for row in robot.rows] == ["left_hip"]
    assert [str(step.kind) for step in robot.rows[0].steps] == ["Tx", "Rx", "Rz"]
    other = load(main, ReadOptions(packages=packages, arguments=(("prefix", "right_"),)))
    assert [row.name for row in other.rows] == ["right_hip"]


def test_a_namespace_for_the_expanded_file_changes_nothing(main: Path) -> None:
    packages = (("arm_parts", str(main.parent.parent / "elsewhere")),)
    rows = load(main, ReadOptions(packages=packages)).rows
    main.write_text(MAIN.replace("<robot ", '<robot xacro:targetNamespace="http://example.org/urdf" '))
    assert [row.steps for row in load(main, ReadOptions(packages=packages)).rows] == [row.steps for row in rows]


def test_a_package_around_the_file_needs_no_path(main: Path) -> None:
    (main.parent.parent / "elsewhere").rename(main.parent.parent / "arm_parts")
    assert load(main).dof == 1


def test_a_missing_package_is_named(main: Path) -> None:
    with pytest.raises(RobotFileError, match=r"package 'arm_parts' is not found.*--package-path NAME=DIR"):
        load(main)


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("${2*0.1}", "${2*long}", r"arm/arm\.urdf\.xacro:5: xacro: name 'long' is not defined"),
        ("${pi/2}", "${half}", r"arm/arm\.urdf\.xacro:5: xacro: name 'half' is not defined"),
        (
            "  </xacro:macro>\n",
            "  </xacro:macro>\n  <link name='${who}'/>\n",
            r"urdf/joint\.xacro:9: xacro: name 'who' is",
        ),
        (
            "  </xacro:macro>\n",
            "  </xacro:macro>\n  <xacro:turn/>\n",
            r"urdf/joint\.xacro:9: xacro: unknown macro name: ",
        ),
        (
            "<link name=",
            "<xacro:moving name='a' length='1'/><link name=",
            r"arm\.urdf\.xacro:5: xacro: macros or includes",
        ),
    ],
)
def test_errors_name_file_and_line(old: str, new: str, place: str, main: Path) -> None:
    """Of an error inside of a macro the place is the call."""
    part = main.parent.parent / "elsewhere" / "urdf" / "joint.xacro"
    path = main if old in MAIN and "${" in old else part
    path.write_text(path.read_text().replace(old, new, 1))

    with pytest.raises(RobotFileError, match=place) as caught:
        load(main, ReadOptions(packages=(("arm_parts", str(main.parent.parent / "elsewhere")),)))

    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(main.parent.parent))
    assert "/../" not in str(caught.value)


@pytest.mark.parametrize(
    "expression",
    [
        "xacro.load_yaml(secret)",
        "''.join(python.vars(pi))",
        "[x for x in ().__class__.__mro__]",
        "python.type(1).mro()",
    ],
)
def test_expressions_cannot_reach_out(expression: str, tmp_path: Path) -> None:
    secret = tmp_path / "secret.yaml"
    secret.write_text("password: hunter2")
    path = tmp_path / "inside" / "arm.xacro"
    path.parent.mkdir()
    text = MAIN.partition("  <xacro:arg")[0] + f'<link name="${{{expression}}}"/></robot>'
    path.write_text(text.replace("secret", f"'{secret}'"))
    with pytest.raises(RobotFileError) as caught:
        load(path)
    assert "hunter2" not in str(caught.value)
    assert any(word in str(caught.value) for word in ("not allowed", "outside", "not defined"))


HEAD = '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">'
JOINT = """\
<link name="a"/><link name="b"/>
<joint name="{name}" type="{type}"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<origin xyz="{x} 0 0"/><limit lower="-1" upper="1"/></joint>
"""


def read(path: Path, text: str, name: str = "hip", kind: str = "revolute", x: str = "1", **options: object) -> Robot:
    """The robot of a file with this text and one joint."""
    path.parent.mkdir(exist_ok=True, parents=True)
    path.write_text(f"{HEAD}\n{text}\n{JOINT.format(name=name, type=kind, x=x)}</robot>")
    return load(path, ReadOptions(**options))  # type: ignore[arg-type]


def length(robot: Robot) -> float:
    """How far the joint is from the base."""
    return float(robot.rows[0].steps[0].value.value) if len(robot.rows[0].steps) > 1 else 0.0  # type: ignore[union-attr]


@pytest.mark.parametrize("name", ["type", "open", "format", "vars"])
def test_a_property_may_have_any_name(name: str, tmp_path: Path) -> None:
    text = f"""\
<xacro:property name="{name}" value="revolute"/>
<xacro:property name="files" value="${{dict(hip=dict(revolute=2))}}"/>
<xacro:macro name="moving" params="{name} name">
  <xacro:property name="x" value="${{files[name][{name}]}}" scope="global"/>
</xacro:macro>
<xacro:moving name="hip" {name}="${{{name}}}"/>
"""
    assert length(read(tmp_path / "arm.xacro", text, kind=f"${{{name}}}", x="${x}")) == 2


def test_a_file_cannot_start_a_program(tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    ways = [
        f"[g.gi_frame.f_back.f_back.f_globals['os'].system('touch {mark}') for g in [(i for i in [1])]]",
        f"[c for c in ().__class__.__base__.__subclasses__()][0]('touch {mark}')",
        f"math.__loader__.load_module('os').system('touch {mark}')",
        f"python.open('{mark}', 'w')",
    ]
    for way in ways:
        with pytest.raises(RobotFileError, match=r"not allowed|not defined"):
            read(tmp_path / "arm.xacro", f'<xacro:property name="v" value="${{{way}}}"/>', x="${v}")
        assert not mark.exists()


@pytest.mark.parametrize(
    "deed",
    [
        "os.system('touch MARK')",
        "subprocess.run(['touch', 'MARK'])",
        "open('MARK', 'w')",
        "open('SECRET')",
        "os.remove('SECRET')",
        "os.rename('SECRET', 'MARK')",
        "os.symlink('SECRET', 'MARK')",
        "os.kill(os.getpid(), 9)",
        "os.fork()",
        "socket.socket()",
        "socket.getaddrinfo('localhost', 80)",
        "ctypes.CDLL(None)",
    ],
)
def test_the_process_itself_may_not_do_what_no_file_needs(deed: str, tmp_path: Path) -> None:
    """What is left if an expression got out all the same."""
    (tmp_path / "secret").write_text("hunter2")
    text = f"""
import ctypes, os, runpy, socket, subprocess, sys
guard = runpy.run_path({str(sandbox.__file__)!r})["_guard"]
sys.addaudithook(guard(lambda name: name.startswith("/nowhere")))
try:
    {deed.replace("MARK", str(tmp_path / "mark")).replace("SECRET", str(tmp_path / "secret"))}
except PermissionError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("xacro may ")
    assert not (tmp_path / "mark").exists()
    assert (tmp_path / "secret").read_text() == "hunter2"


def test_a_folder_is_no_package_because_of_its_name(tmp_path: Path) -> None:
    (tmp_path / "private").mkdir()
    (tmp_path / "private" / "keys.yaml").write_text("key: 7")
    use = '<xacro:property name="v" value="${{xacro.load_yaml(\'{}/keys.yaml\').key}}"/>'
    place = tmp_path / "arm" / "urdf" / "arm.xacro"
    for name in ("private", "..", "arm/../private"):
        with pytest.raises(RobotFileError, match=r"package") as caught:
            read(place, use.format(f"$(find {name})"), x="${v}")
        assert "\n" not in str(caught.value)
    # A manifest or robot files make it one.
    (tmp_path / "private" / "package.xml").write_text("<package><name>private</name></package>")
    assert length(read(place, use.format("$(find private)"), x="${v}")) == 7


def test_a_link_does_not_lead_out_of_a_package(tmp_path: Path) -> None:
    (tmp_path / "keys.yaml").write_text("key: 7")
    (tmp_path / "arm").mkdir()
    (tmp_path / "arm" / "inside.yaml").symlink_to(tmp_path / "keys.yaml")
    with pytest.raises(RobotFileError, match="outside the package"):
        read(
            tmp_path / "arm" / "arm.xacro",
            '<xacro:property name="v" value="${xacro.load_yaml(\'inside.yaml\')}"/>',
            x="${v}",
        )


def test_a_link_to_a_file_is_that_file(tmp_path: Path) -> None:
    """As a workspace installs it: every file is a link to the one in the folder of sources."""
    source = tmp_path / "source" / "urdf"
    (tmp_path / "install").mkdir()
    text = '<xacro:property name="v" value="${xacro.load_yaml(\'x.yaml\').x}"/>'
    read(source / "arm.xacro", "")
    (source / "x.yaml").write_text("x: 2")
    for name in ("arm.xacro", "x.yaml"):
        (tmp_path / "install" / name).symlink_to(source / name)
    assert length(read(tmp_path / "install" / "arm.xacro", text, x="${v}")) == 2


def test_a_link_to_a_folder_is_a_package_by_its_manifest_alone(tmp_path: Path) -> None:
    private = tmp_path / "elsewhere" / "private"
    (private / "models").mkdir(parents=True)
    (private / "keys.yaml").write_text("key: 7")
    text = '<xacro:property name="v" value="${xacro.load_yaml(\'$(find private)/keys.yaml\').key}"/>'
    place = tmp_path / "arm" / "arm.xacro"
    place.parent.mkdir()
    (place.parent / "private").symlink_to(private)
    with pytest.raises(RobotFileError, match="package 'private' is not found"):
        read(place, text, x="${v}")
    (private / "package.xml").write_text("<package><name>private</name></package>")
    assert length(read(place, text, x="${v}")) == 7


@pytest.mark.parametrize("module", ["xacro", "yaml"])
def test_a_module_beside_the_file_is_not_run(module: str, tmp_path: Path) -> None:
    """Python puts the working directory before the installed modules."""
    (tmp_path / "sizes.yaml").write_text("x: 3")
    read(tmp_path / "arm.xacro", '<xacro:property name="v" value="${xacro.load_yaml(\'sizes.yaml\').x}"/>', x="${v}")
    (tmp_path / f"{module}.py").write_text("open('mark', 'w')")
    call = """from pathlib import Path
from kinegen.io.xacro.expand import expanded
from kinegen.io.format import ReadOptions
print(expanded(Path('arm.xacro'), ReadOptions()))
"""
    done = subprocess.run([sys.executable, "-c", call], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert 'xyz="3 0 0"' in done.stdout
    assert not (tmp_path / "mark").exists()


def test_a_set_is_written_in_the_same_order_each_time(tmp_path: Path) -> None:
    path = tmp_path / "arm.xacro"
    path.write_text(f"{HEAD}<link name=\"${{python.set('a b c d e f g h i j'.split())}}\"/></robot>")
    assert expanded(path, ReadOptions()) == expanded(path, ReadOptions())


def test_a_home_and_those_beside_it_are_no_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A user may be called as a folder of robot files is."""
    from kinegen.io.xacro import files

    home = tmp_path / "users" / "robot"
    monkeypatch.setenv("HOME", str(home))
    (home / "urdf").mkdir(parents=True)
    (home / "package.xml").write_text("<package><name>robot</name></package>")
    for place in (home / "arm.xacro", home / "urdf" / "arm.xacro"):
        found = files.Files(place, {}, 100)
        assert found.allow(str(place.parent / "part.xacro"))
        assert not found.allow(str(home.parent / "other" / "part.xacro"))
        assert not found.allow(str(home / ".ssh" / "config"))
        with pytest.raises(files.MissingPackageError):
            found.find("users")


def test_a_user_without_a_home_reads_robots(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from kinegen.io.xacro import files

    monkeypatch.setattr("os.path.expanduser", lambda name: name)
    assert files.Files(tmp_path / "urdf" / "arm.xacro", {}, 100).allow(str(tmp_path / "meshes" / "part.xacro"))


def test_a_home_is_no_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from kinegen.io.xacro import files

    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "urdf").mkdir()
    allow = files.Files(tmp_path / "urdf" / "arm.xacro", {}, 100).allow
    assert allow(str(tmp_path / "urdf" / "part.xacro"))
    assert not allow(str(tmp_path / ".ssh" / "config"))


def test_a_package_path_is_relative_to_the_working_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "sizes.yaml").write_text("x: 3")
    monkeypatch.chdir(tmp_path)
    text = '<xacro:property name="v" value="${xacro.load_yaml(\'$(find my_parts)/sizes.yaml\').x}"/>'
    path = Path("robot/urdf/arm.xacro")
    assert length(read(path, text, x="${v}", packages=(("my_parts", "parts"),))) == 3


def test_a_pattern_takes_the_files_of_the_package_alone(tmp_path: Path) -> None:
    for number in (1, 2):
        path = tmp_path / "arm" / f"part{number}.xacro"
        path.parent.mkdir(exist_ok=True)
        path.write_text(f'{HEAD}<xacro:property name="p{number}" value="{number}"/></robot>')
    text = '<xacro:include filename="part*.xacro"/>'
    assert length(read(tmp_path / "arm" / "arm.xacro", text, x="${p1 + p2}")) == 3
    with pytest.raises(RobotFileError, match="outside the package"):
        read(tmp_path / "arm" / "arm.xacro", '<xacro:include filename="../*"/>')


def test_every_argument_without_a_value_is_named(tmp_path: Path) -> None:
    path = tmp_path / "arm.xacro"
    text = '<xacro:arg name="late" default="1"/><link name="$(arg side)_${xacro.arg(\'tool\')}"/>'
    with pytest.raises(
        RobotFileError,
        match=r"the arguments 'side', 'tool'; write side:=VALUE tool:=VALUE after the file \(with a default: late\)",
    ):
        read(path, text, x="$(arg late)")
    with pytest.raises(
        RobotFileError, match=r"arm\.xacro:2: xacro: no value for the argument 'tool'; write tool:=VALUE"
    ):
        read(path, text, arguments=(("side", "left"),))


def test_eval_computes_with_arguments(tmp_path: Path) -> None:
    path = tmp_path / "arm.xacro"
    text = '<xacro:arg name="n" default="3"/><xacro:arg name="side" default="left"/>'
    assert length(read(path, text, x="$(eval n * 2 if side == 'left' else 0)")) == 6
    with pytest.raises(RobotFileError, match=r"name 'who' is not defined when evaluating expression 'who'"):
        read(path, text, x="$(eval who)")


def test_units_of_yaml_are_taken(tmp_path: Path) -> None:
    path = tmp_path / "arm.xacro"
    text = '<xacro:property name="s" value="${xacro.load_yaml(\'sizes.yaml\')}"/>'
    (tmp_path / "sizes.yaml").write_text(
        "x: !millimeters 1500\nturn: !degrees 180/2\nparts: [!radians pi/2, {a: 2001-01-01}]"
    )
    right = "s.turn == s['parts'][0] == pi/2 and s.parts[1].a == '2001-01-01'"
    assert length(read(path, text, x=f"${{s.x if {right} else 0}}")) == 1.5


def test_yaml_that_grows_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "arm.xacro"
    text = '<xacro:property name="s" value="${xacro.load_yaml(\'sizes.yaml\')}"/>'
    (tmp_path / "sizes.yaml").write_text(
        "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n"
        + "".join(f"{c}: &{c} [{', '.join(['*' + chr(ord(c) - 1)] * 10)}]\n" for c in "bcdefghi")
    )
    with pytest.raises(RobotFileError, match="the YAML file is too large"):
        read(path, text, x="${len(s)}")
    (tmp_path / "sizes.yaml").write_text("a: &a [*a]")
    with pytest.raises(RobotFileError, match="the YAML file is too large, or nested too deeply"):
        read(path, text, x="${len(s)}")


def test_files_that_include_twice_end_soon(tmp_path: Path) -> None:
    """Two includes in each of twenty files open a million."""
    from kinegen.io.xacro import files

    part = tmp_path / "part.xacro"
    part.write_text(f"{HEAD}</robot>")
    found = files.Files(tmp_path / "arm.xacro", {}, 100)
    for _ in range(2000):
        assert found.opened(str(part)).read() == f"{HEAD}</robot>"
    with pytest.raises(files.RefusedError, match=r"part\.xacro: more than 2000 files are included"):
        found.opened(str(part))


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    memory = Path("/proc/self/mem")
    if not memory.exists():
        memory = tmp_path / "none"
    with pytest.raises(RobotFileError, match=r"(mem: it cannot be read: |none: there is no such file)"):
        read(tmp_path / "arm.xacro", f'<xacro:include filename="{memory}"/>', packages=(("all", "/"),))


def test_properties_lead_to_each_other_as_far_as_in_xacro(tmp_path: Path) -> None:
    path = tmp_path / "arm.xacro"
    many = "".join(f'<xacro:property name="p{n}" value="${{p{n - 1} + 1}}"/>' for n in range(1, 140))
    assert length(read(path, f'<xacro:property name="p0" value="0"/>{many}', x="${p139}")) == 139
    plain = "import sys, xacro; xacro.process_file(sys.argv[1])"
    subprocess.run([sys.executable, "-c", plain, str(path)], check=True)


def test_macros_that_double_end_soon(tmp_path: Path) -> None:
    text = "".join(f'<xacro:macro name="m{n}"><xacro:m{n - 1}/><xacro:m{n - 1}/></xacro:macro>' for n in range(1, 30))
    with pytest.raises(RobotFileError, match="macros are called more than 5000 times"):
        read(tmp_path / "arm.xacro", f'<xacro:macro name="m0"/>{text}<xacro:m29/>')


SLOW = """
import json, sys, time
json.load(sys.stdin)
time.sleep(0.6)
print(json.dumps({"urdf": "<robot/>"}))
"""


def test_a_busy_machine_refuses_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that gets little of a processor takes long and uses no more of it."""
    (tmp_path / "slow.py").write_text(SLOW)
    monkeypatch.setattr(expand, "_SANDBOX", tmp_path / "slow.py")
    monkeypatch.setattr(expand, "SECONDS", 0.2)

    assert expanded(tmp_path / "arm.xacro", ReadOptions()) == b"<robot/>"
    monkeypatch.setattr(expand, "_PATIENCE", 0.2)
    with pytest.raises(RobotFileError, match=r"xacro did not end within 0\.2 s"):
        expanded(tmp_path / "arm.xacro", ReadOptions())
