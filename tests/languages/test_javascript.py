"""The JavaScript module as its user calls it, through Node.js."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from kinegen.backends.javascript.syntax import steps
from kinegen.backends.javascript.wasm import batched, compile_command, emit_wasm
from kinegen.backends.languages import LANGUAGES, emit_language
from kinegen.derive.dispatch import derive
from kinegen.ir.lower import lower
from kinegen.ir.program import Temporary
from kinegen.model.outputs import NUMERIC_INVERSE, parse_quantity
from tests.emit.emitted import kernels, robot, run, vectors
from tests.emit.handwritten import KERNELS

NODE = shutil.which("node") or ""
JAVASCRIPT = LANGUAGES["javascript"]
needs_clang = pytest.mark.skipif(not all(map(shutil.which, ("clang", "wasm-ld"))), reason="needs clang and lld")
needs_node = pytest.mark.skipif(not NODE, reason="needs Node.js (Debian: apt-get install nodejs)")

OUTPUTS = tuple(map(parse_quantity, ("pose", "fk_jacobian", "twist", "inverse")))


@cache
def files(name: str) -> dict[str, str]:
    """The files of a robot, without their folder."""
    wanted = OUTPUTS if name == "puma560" else OUTPUTS[:1]
    emitted = emit_language(kernels(name, wanted), JAVASCRIPT, vectors(name, wanted))
    return {path.partition("/")[2]: text for path, text in emitted.items()}


def evaluate(name: str, folder: Path, code: str) -> Any:
    """What a script prints, in which `robot` is the module of a robot."""
    for file, text in files(name).items():
        (folder / file).parent.mkdir(exist_ok=True)
        (folder / file).write_text(text, encoding="utf-8")
    script = folder / "script.mjs"
    script.write_text(f'import * as robot from "./{name}.js";\n{code}\n', encoding="utf-8")
    return json.loads(run([NODE, script]))


@needs_node
def test_results_are_returned_and_written_where_asked(tmp_path: Path) -> None:
    code = """
    const q = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6], T = new Float64Array(16);
    const returned = robot.fk(q, T);
    const [pose, J] = robot.fk_jacobian(Float64Array.from(q));
    const [solutions, valid] = robot.inverse(T);
    console.log(JSON.stringify([returned === T, pose.every((x, i) => Math.abs(x - T[i]) < 1e-15), J.length,
        [...valid].includes(1), valid instanceof Uint8Array, solutions.length, robot.BRANCHES.length]));
    """

    assert evaluate("puma560", tmp_path, code) == [True, True, 36, True, True, 48, 8]


@needs_node
def test_wrong_lengths_are_refused(tmp_path: Path) -> None:
    code = """
    const tell = (call) => {
      try { call(); return "nothing"; } catch (error) { return `${error.name}: ${error.message}`; }
    };
    const q = new Float64Array(6);
    console.log(JSON.stringify([
      tell(() => robot.fk([1, 2])), tell(() => robot.fk(undefined)), tell(() => robot.fk(7)),
      tell(() => robot.fk(q, new Float64Array(12))), tell(() => robot.fk_batch(new Float64Array(7))),
      tell(() => robot.fk_batch(q, new Float64Array(15))), tell(() => robot.twist_batch(q, new Float64Array(12))),
      tell(() => robot.fk_batch())]));
    """

    assert evaluate("puma560", tmp_path, code) == [
        "RangeError: fk: q has 2 numbers; it takes 6",
        "RangeError: fk: q has undefined numbers; it takes 6",
        "RangeError: fk: q has undefined numbers; it takes 6",
        "RangeError: fk: base_T_tool has 12 numbers; it takes 16",
        "RangeError: fk_batch: q has 7 numbers; it takes a multiple of 6",
        "RangeError: fk_batch: base_T_tool has 15 numbers; it takes 16",
        "RangeError: twist_batch: qd has 12 numbers; it takes 6",
        "RangeError: fk_batch: q has undefined numbers; it takes a multiple of 6",
    ]


@needs_node
def test_batches_may_be_empty_and_hold_nan(tmp_path: Path) -> None:
    code = """
    const q = new Float64Array(12); q[1] = NaN; q[6] = Infinity;
    const T = robot.fk_batch(q);
    console.log(JSON.stringify([robot.fk_batch([]).length, Number.isNaN(T[3]), Number.isNaN(T[16 + 3]), T[31]]));
    """

    assert evaluate("puma560", tmp_path, code) == [0, True, True, 1]


@needs_node
@pytest.mark.parametrize("name", ["calibrated_2r", "blocks", "hand"])
def test_other_robots_have_what_their_interface_takes(name: str, tmp_path: Path) -> None:
    code = """
    const q = new Float64Array(robot.DOF), usual = robot.fk(q);
    const moved = "DEFAULT_PARAMS" in robot
      ? robot.fk(q, Object.fromEntries(Object.keys(robot.DEFAULT_PARAMS).map((key) => [key, 7]))) : null;
    console.log(JSON.stringify([usual.length, robot.TIPS?.length ?? 1, moved === null || moved[3] !== usual[3],
        Object.isFrozen(robot.LIMITS), "fk_batch" in robot]));
    """
    length, tips, is_moved, is_frozen, is_batched = evaluate(name, tmp_path, code)

    assert (length, is_moved, is_frozen, is_batched) == (16 * tips, True, True, name != "blocks")


@pytest.mark.parametrize("name", ["puma560", "calibrated_2r", "blocks", "hand"])
def test_types_declare_what_the_module_exports(name: str) -> None:
    exports = [
        set(re.findall(r"^export (?:const|function) (\w+)", files(name)[f"{name}.{suffix}"], re.MULTILINE))
        for suffix in ("js", "d.ts")
    ]

    assert exports[0] == exports[1]
    assert "fk" in exports[0]


@pytest.mark.parametrize("name", ["puma560", "hand"])
def test_the_folder_is_a_package(name: str) -> None:
    document = json.loads(files(name)["package.json"])

    assert (document["name"], document["type"], document["license"]) == (name, "module", "0BSD")
    written = {file for file in files(name) if "/" not in file}
    assert set(document["files"]) | {"package.json", "test.mjs"} == written | {f"{name}.wasm"}


LOADED = """
    const { load } = await import("./puma560_wasm.js");
    const loaded = await load(), q = Float64Array.from({ length: 3000 * 6 }, (_, i) => Math.sin(i));
    q[7] = NaN;
    const same = (a, b) => a.length === b.length && a.every((x, i) => Object.is(x, b[i]) || x === b[i]);
    const out = new Float64Array(3000 * 16), plain = Array.from(q), T = robot.fk_batch(q);
    const both = [loaded.fk_jacobian_batch(q), robot.fk_jacobian_batch(q)], solved = loaded.inverse_batch(T);
    let refused = "";
    try { loaded.fk_batch([1, 2]); } catch (error) { refused = error.message; }
    console.log(JSON.stringify([loaded.isWasm, loaded.fk_batch(q, out) === out && same(out, T),
        same(loaded.fk_batch(plain), T), both[0].every((array, i) => same(array, both[1][i])),
        same(solved[1], robot.inverse_batch(T)[1]), loaded.fk_batch([]).length, refused, loaded.fk === robot.fk]));
"""
REFUSED = "fk_batch: q has 2 numbers; it takes a multiple of 6"


@needs_node
def test_without_webassembly_the_loader_falls_back(tmp_path: Path) -> None:
    assert evaluate("puma560", tmp_path, LOADED) == [False, True, True, True, True, 0, REFUSED, True]


@needs_node
@needs_clang
def test_webassembly_gives_the_bits_of_javascript(tmp_path: Path) -> None:
    evaluate("puma560", tmp_path, "console.log(0);")  # lays out the files
    subprocess.run(json.loads(files("puma560")["package.json"])["scripts"]["wasm"].split(), cwd=tmp_path, check=True)

    assert evaluate("puma560", tmp_path, LOADED) == [True, True, True, True, True, 0, REFUSED, True]


@needs_clang
@pytest.mark.parametrize(("name", "outputs"), [("hand", "fk_jacobian"), ("puma560", "inverse")])
def test_the_stack_of_webassembly_holds_what_clang_puts_there(name: str, outputs: str, tmp_path: Path) -> None:
    """A page, the linker's choice, was too small for a hand's Hessian."""
    given = kernels(name, (parse_quantity(outputs),))
    for path, text in emit_wasm(given).items():
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_text(text, encoding="utf-8")
    command = compile_command(given)
    subprocess.run([*command.split(), "-fstack-usage"], cwd=tmp_path, check=True)
    usage = "".join(path.read_text(encoding="utf-8") for path in tmp_path.glob("*.su"))
    frames = sorted(int(line.split("\t")[1]) for line in usage.splitlines())

    assert 0 < sum(frames[-2:]) < int(command.split("stack-size=")[1].split()[0])


def test_a_batch_with_thousands_of_results_stays_in_javascript() -> None:
    """clang would take minutes for its WebAssembly."""
    hessian, jacobian = (kernels("hand", (parse_quantity(name),)) for name in ("hessian", "jacobian"))

    assert [program.quantity.function for program in batched(jacobian)] == ["jacobian"]
    assert not batched(hessian)
    assert not emit_wasm(hessian)
    assert "hessian_batch" in emit_language(hessian, JAVASCRIPT)["javascript/hand.js"]


@needs_node
def test_the_package_tests_itself(tmp_path: Path) -> None:
    evaluate("calibrated_2r", tmp_path, "console.log(0);")  # lays out the files
    run([NODE, "--test", str(tmp_path / "test.mjs")])
    text = (tmp_path / "calibrated_2r.js").read_text(encoding="utf-8")
    (tmp_path / "calibrated_2r.js").write_text(text.replace(" + t", " - t"), encoding="utf-8")
    done = subprocess.run([NODE, "--test", str(tmp_path / "test.mjs")], capture_output=True, check=False)

    assert done.returncode


def test_every_operator_is_printed() -> None:
    text = emit_language(KERNELS, JAVASCRIPT)["javascript/made_up.js"]

    for line in (
        "sines[0] = q[q_at];",
        "sincos(2);",
        "const t1 = c1 * (-0.3333333333333333);",
        "const t2 = params.far / params.lambda;",
        "const t6 = sqrt(t2);",
        "const t7 = atan2(t3, t6);",
        "const t8 = q[q_at] < 0.5 ? t3 : t7;",
    ):
        assert f"  {line}\n" in text


@pytest.mark.parametrize("name", ["puma560", "hand"])
def test_one_call_takes_all_sines_of_joint_angles(name: str) -> None:
    text = files(name)[f"{name}.js"]
    body = text.split("function fk_at(")[1].split("\n}\n")[0]
    (count,) = map(int, re.findall(r"sincos\((\d+)\);", body))
    (size,) = map(int, re.findall(r"const sines = new Float64Array\((\d+)\);", text))

    assert len(re.findall(r"^  sines\[\d+\] = ", body, re.MULTILINE)) == count
    assert size >= count + count % 2


def test_a_call_for_computed_angles_follows_what_leads_to_them() -> None:
    arm = robot("puma560")
    program = lower(derive(arm, parse_quantity("inverse")))
    known: set[str] = set()
    for step in steps(program):
        for statement in (*step.pairs, *step.statements):
            assert {each.name for each in statement.operands if isinstance(each, Temporary)} <= known
            known.update(statement.results)

    assert known == {name for statement in program.statements for name in statement.results}


def test_the_search_is_refused_with_a_reason() -> None:
    assert "no loop" in JAVASCRIPT.refuses(NUMERIC_INVERSE)


@needs_node
def test_the_package_is_found_by_its_name(tmp_path: Path) -> None:
    """What `package.json` calls the module, its types and the files to be published is there."""
    code = 'console.log(JSON.stringify([(await import("puma560")).fk === robot.fk, "fk" in robot]));'
    assert evaluate("puma560", tmp_path, code) == [True, True]
    document = json.loads((tmp_path / "package.json").read_text(encoding="utf-8"))
    named = [path for entry in document["exports"].values() for path in entry.values()]

    assert {"main", "module", "browser", "bin"} & set(document) == set()
    assert all((tmp_path / path).is_file() for path in (*named, document["types"]))
    assert document["exports"]["."]["types"] == document["types"]


@needs_node
@pytest.mark.parametrize("entry", [3, 10])
def test_the_tests_of_the_package_refuse_what_is_off_by_a_few_roundings(entry: int, tmp_path: Path) -> None:
    """1e-14 is some ten times what is accepted of any number of the pose of a PUMA 560."""
    evaluate("puma560", tmp_path, "console.log(0);")
    module = tmp_path / "puma560.js"
    text = module.read_text(encoding="utf-8")
    found = re.subn(rf"(  base_T_tool\[base_T_tool_at \+ {entry}\] = \w+);", r"\1 + 1e-14;", text)
    command = [NODE, "--test", "--test-name-pattern=^fk$", "test.mjs"]
    before = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    module.write_text(found[0], encoding="utf-8")
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)

    assert found[1] > 0
    assert (before.returncode, done.returncode) == (0, 1)
    assert f"number {entry} is " in done.stdout


KINDS = {"number": "Float64Array", "truth": "Uint8Array"}


@pytest.mark.parametrize("name", ["puma560", "calibrated_2r", "hand"])
def test_declared_types_are_those_of_the_programs(name: str) -> None:
    """Inputs are numbers in a row, results typed arrays that may be passed, several results a tuple in their order."""
    wanted = OUTPUTS if name == "puma560" else OUTPUTS[:1]
    types = re.sub(r"\s+", " ", files(name)[f"{name}.d.ts"])
    for program in kernels(name, wanted).programs:
        arrays = [KINDS["truth" if each.is_truth else "number"] for each in program.signature.results]
        returned = arrays[0] if len(arrays) == 1 else f"[{', '.join(arrays)}]"
        for function in (program.quantity.function, f"{program.quantity.function}_batch"):
            declared = re.search(rf"export function {function}\(([^)]*)\): ([^;]*);", types)
            assert declared, function
            given = dict(part.strip().split(": ") for part in declared[1].split(",") if part.strip())
            inputs = {each.name: "Numbers" for each in program.signature.inputs}
            results = {f"{each.name}?": kind for each, kind in zip(program.signature.results, arrays, strict=True)}
            params = {"params?": "Readonly<Params>"} if robot(name).runtime_parameters else {}
            assert given == inputs | params | results, function
            assert re.sub(r"\w+: ", "", declared[2]) == returned, function
