"""The MATLAB package as its user calls it, in GNU Octave."""

from __future__ import annotations

import re
import shutil
import subprocess
from functools import cache
from pathlib import Path

import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.languages import LANGUAGES, emit_language, kept
from kinegen.backends.matlab.gateway import batched, columnwise
from kinegen.backends.matlab.syntax import axes, extents, in_columns, last_rows, places
from kinegen.derive.dispatch import derive
from kinegen.errors import CompileError, KinegenError
from kinegen.io.load import load
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.model.outputs import NUMERIC_INVERSE, Array, Kind, Quantity, parse_quantity
from kinegen.verify.languages import prove_language
from tests.emit.emitted import ROBOTS, kernels, vectors
from tests.emit.handwritten import KERNELS

OCTAVE = shutil.which("octave-cli") or ""
MATLAB = LANGUAGES["matlab"]
needs_octave = pytest.mark.skipif(not OCTAVE, reason="needs GNU Octave (Debian: apt-get install octave)")
needs_mkoctfile = pytest.mark.skipif(
    not OCTAVE or shutil.which("mkoctfile") is None, reason="needs mkoctfile (Debian: apt-get install octave-dev)"
)

OUTPUTS = tuple(map(parse_quantity, ("pose", "fk_jacobian", "twist", "inverse")))


@cache
def files(name: str) -> dict[str, str]:
    """The files of a robot, without their folder."""
    wanted = OUTPUTS if name == "puma560" else OUTPUTS[:1]
    emitted = emit_language(kernels(name, wanted), MATLAB, vectors(name, wanted))
    return {path.removeprefix("matlab/"): text for path, text in emitted.items()}


def lay_out(name: str, folder: Path) -> None:
    """Write the files of a robot to a folder."""
    for path, text in files(name).items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")


def octave(folder: Path, code: str) -> subprocess.CompletedProcess[str]:
    """Run a script beside a package."""
    (folder / "script.m").write_text(f"warning('off', 'all');\n{code}\n", encoding="utf-8")
    command = [OCTAVE, "--norc", "--quiet", "script.m"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=120)


def evaluate(name: str, folder: Path, code: str) -> list[str]:
    """The lines that a script prints."""
    lay_out(name, folder)
    done = octave(folder, code)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@needs_octave
def test_columns_are_configurations_and_classes_are_kept(tmp_path: Path) -> None:
    code = """
    q = [0.1 0.2 0.3 0.4 0.5 0.6].';
    T = puma560.fk([q, -q, q]);
    [P, J] = puma560.fk_jacobian(q);
    [S, ok] = puma560.inverse(T);
    [near, exists] = puma560.inverse_nearest(T, [q, -q, q]);
    disp(isequal(size(T), [4 4 3]) && isequal(T(:, :, 1), T(:, :, 3)) && isequal(P(4, :), [0 0 0 1]) && ...
        max(max(abs(T(:, :, 1) - P))) < 1e-15);
    disp(isequal(size(J), [6 6]) && isequal(size(S), [6 8 3]) && isequal(size(ok), [8 3]) && islogical(ok));
    disp(max(max(abs(near - [q, -q, q]))) < 1e-12 && all(exists) && islogical(exists));
    disp(norm(puma560.fk(S(:, find(ok(:, 2), 1), 2)) - T(:, :, 2)) < 1e-12);
    disp([class(puma560.fk(single(q))), ' ', class(puma560.twist(single(q), q)), ' ', class(puma560.clamp(single(q)))]);
    disp(size(puma560.fk(zeros(6, 0))));
    [near, exists] = puma560.inverse_nearest(T(:, :, 1), nan(6, 1));
    disp(all(isnan(near)) && ~exists);
    T = puma560.fk(nan(6, 1));
    P = puma560.fk(single(inf(6, 1)));
    disp(isnan(T(1, 4)) && isnan(P(1, 4)) && T(4, 4) == 1);
    about = puma560.info();
    q = puma560.clamp([9; nan; 0; -9; 0; 1]);
    disp(isequaln(q(1:2), [about.LIMITS(1, 2); nan]));
    disp([puma560.within_limits([zeros(6, 1), nan(6, 1), 9 * ones(6, 1)]), columns(about.BRANCHES)]);
    """

    assert evaluate("puma560", tmp_path, code) == [
        *["1"] * 4,
        "single single single",
        "   4   4   0",
        *["1"] * 3,
        "   1   0   0   8",
    ]


@needs_octave
def test_wrong_shapes_are_refused(tmp_path: Path) -> None:
    code = """
    q = zeros(6, 2);
    calls = {@() puma560.fk(1:6), @() puma560.fk(q + i), @() puma560.fk(int32(q)), @() puma560.twist(q, q(:, 1)), ...
             @() puma560.inverse(zeros(3, 4)), @() puma560.inverse_nearest(eye(4), q), @() puma560.clamp(1)};
    for k = 1:numel(calls)
      try
        calls{k}();
        disp('nothing');
      catch problem
        disp(problem.message);
      end
    end
    """
    fk = "fk: q must be real, single or double, 6 x N"

    assert evaluate("puma560", tmp_path, code) == [
        *[fk] * 3,
        "twist: qd must be real, single or double, 6 x N, with the N of q",
        "inverse: base_T_tool must be real, single or double, 4 x 4 x N",
        "inverse_nearest: q0 must be real, single or double, 6 x N, with the N of base_T_tool",
        "clamp: q must be real, single or double, 6 x N",
    ]


@needs_octave
@pytest.mark.parametrize("name", ["calibrated_2r", "blocks", "hand"])
def test_other_robots_have_what_their_interface_takes(name: str, tmp_path: Path) -> None:
    code = f"""
    about = {name}.info();
    T = {name}.fk(zeros(about.DOF, 2));
    tips = 1;
    if isfield(about, 'TIPS')
      tips = numel(about.TIPS);
    end
    moved = true;
    if exist(fullfile('+{name}', 'default_params.m'), 'file')
      params = {name}.default_params();
      params.L1 = 7;
      other = {name}.fk(zeros(about.DOF, 2), params);
      moved = other(1, 4, 1) > T(1, 4, 1) + 6;
    end
    disp([isequal(size(T), [4 4 tips 2]) || (tips == 1 && isequal(size(T), [4 4 2])), moved, size(about.LIMITS, 2)]);
    """

    assert evaluate(name, tmp_path, code) == ["   1   1   2"]


@needs_octave
@pytest.mark.parametrize("name", ["calibrated_2r", "puma560", "hand"])
def test_the_package_tests_itself(name: str, tmp_path: Path) -> None:
    lines = evaluate(name, tmp_path, "run_tests")
    assert re.fullmatch(rf"{name}: \d functions are as expected", lines[0])
    path = tmp_path / f"+{name}" / "fk.m"
    head, mark, body = path.read_text(encoding="utf-8").partition("= in_single(q, n")
    own, end, others = body.partition("\nend\n")
    path.write_text(head + mark + own.replace(" + t", " - t") + end + others, encoding="utf-8")

    assert "fk (single): number" in octave(tmp_path, "run_tests").stderr


@needs_mkoctfile
def test_the_mex_file_has_the_same_bits_and_refuses_what_is_wrong(tmp_path: Path) -> None:
    code = """
    build_mex
    run_tests
    disp(strjoin(puma560_mex(), ' '));
    q = sin(reshape(1:6 * 9000, 6, []));
    q(2, 7) = nan; q(3, 9) = 1e9;
    disp(isequaln(puma560_mex('fk', q), puma560.fk(q)));
    [S, ok] = puma560_mex('inverse', puma560.fk(single(q)));
    [R, wanted] = puma560.inverse(puma560.fk(single(q)));
    disp(isequaln(S, R) && isequal(ok, wanted) && islogical(ok) && isa(S, 'single'));
    calls = {@() puma560_mex('pose', q), @() puma560_mex('fk'), @() puma560_mex('fk', q(1:5, :)), ...
             @() puma560_mex('fk', q + i), @() puma560_mex('twist', q, single(q)), ...
             @() puma560_mex('twist', q, q(:, 1))};
    for k = 1:numel(calls)
      try
        calls{k}();
        disp('nothing');
      catch problem
        disp(problem.message);
      end
    end
    """
    shape = "has another shape than help puma560.{0} says, or another class"

    assert evaluate("puma560", tmp_path, code) == [
        "puma560: 3 functions are as expected",
        "fk fk_jacobian twist inverse",
        "1",
        "1",
        "puma560_mex: the first argument must be the name of a function; puma560_mex() returns them",
        "puma560_mex: fk takes 1 inputs and has 1 results",
        f"puma560_mex: fk: q {shape.format('fk')}",
        f"puma560_mex: fk: q {shape.format('fk')}",
        f"puma560_mex: twist: qd {shape.format('twist')}",
        "puma560_mex: twist: qd has another number of configurations than q",
    ]


@needs_mkoctfile
def test_the_mex_file_takes_parameters(tmp_path: Path) -> None:
    code = """
    build_mex('-O1');
    params = calibrated_2r.default_params();
    params.L1 = 7;
    q = [0.1; 0.2];
    disp(isequal(calibrated_2r_mex('fk', q, params), calibrated_2r.fk(q, params)));
    disp(isequal(calibrated_2r_mex('fk', single(q)), calibrated_2r.fk(single(q))));
    try
      calibrated_2r_mex('fk', q, struct('L2', 1));
    catch problem
      disp(problem.message);
    end
    """

    assert evaluate("calibrated_2r", tmp_path, code) == [
        "1",
        "1",
        "calibrated_2r_mex: params has no field L1 that is a real double",
    ]


def test_files_of_octave_are_nothing_but_plain_matlab() -> None:
    """No word of Octave alone outside what the proof runs."""
    own = re.compile(r"\b(endfunction|endif|endfor|printf|unwind_protect|until)\b|\+\+|\+=|!=|^\s*#", re.MULTILINE)
    for name in ("puma560", "hand", "calibrated_2r"):
        for path, text in files(name).items():
            if path.endswith(".m"):
                found = own.search(text.replace("sprintf", "").replace("%#codegen", ""))
                assert found is None, (path, found)


def test_help_names_shapes_and_every_file_has_it() -> None:
    assert all(re.match(r"(function .*\n)?%", text) for path, text in files("puma560").items() if path.endswith(".m"))
    text = files("puma560")["+puma560/fk_jacobian.m"]

    assert "%     q            6 x N      joint vector\n" in text
    assert "%     J            6 x 6 x N\n" in text or re.search(r"%     \w+ +6 x 6 x N\n", text)
    assert "Angles are in rad, lengths in m; help puma560 describes frames and joints." in " ".join(
        text.replace("%", " ").split()
    )
    assert "q(1)  waist" in files("puma560")["+puma560/Contents.m"]
    assert "  1  shoulder left, elbow up, wrist no-flip" in files("puma560")["+puma560/inverse.m"]


@pytest.mark.parametrize("word", ["otherwise", "endfunction", "parfor", "size", "info"])
def test_words_of_matlab_are_refused(word: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    text = (ROBOTS / "calibrated_2r.yaml").read_text(encoding="utf-8")
    path.write_text(re.sub(r"^name: .*", f"name: {word}", text, flags=re.MULTILINE), encoding="utf-8")
    arm = load(path)
    with pytest.raises(KinegenError, match=f"robot name '{word}' is a word of MATLAB"):
        emit_language(RobotPrograms(arm, (lower(derive(arm, OUTPUTS[0])),), runtime_defaults(arm)), MATLAB)


def test_what_matlab_cannot_have_is_refused_with_a_reason() -> None:
    long = Quantity(Kind.BIAS_ACCELERATION, frame="f" * 50)

    assert "no loop" in MATLAB.refuses(NUMERIC_INVERSE)
    assert MATLAB.refuses(long) == "its name has 68 characters, of which 63 count"
    assert not kept(kernels("puma560", (NUMERIC_INVERSE,)), MATLAB).numeric_inverse


def test_every_operator_is_printed() -> None:
    text = emit_language(KERNELS, MATLAB)["matlab/+made_up/position.m"]

    for line in (
        "[s1, c1] = sincos_double(q(1, :));",
        "t1 = c1 .* (-0.3333333333333333);",
        "t1 = c1 .* (-single(0.33333334));",
        "t2 = double(params.far) ./ double(params.lambda);",
        "t6 = square_root(t2);",
        "t7 = arc_tangent_single(t3, t6);",
        "t8 = choose(q(1, :), 0.5, t3, t7);",
    ):
        assert f"\n{line}\n" in text


def test_arrays_keep_rows_and_columns() -> None:
    frames = Array("frames", (3, 4, 4), is_pose=True, per_frame=True)
    hessian = Array("hessian", (2, 6, 5), per_frame=False)

    assert (axes(frames), extents(frames)) == ((1, 2, 0), (4, 4, 3))
    assert (axes(hessian), extents(hessian)) == ((1, 2, 0), (6, 5, 2))
    assert places(frames)[:5] == (0, 4, 8, 12, 1)
    assert last_rows(frames)[:5] == ((3, 0), (7, 0), (11, 0), (15, 1), (19, 0))
    assert in_columns(Array("a", (2, 2)), tuple("abcd")) == tuple("acbd")  # type: ignore[arg-type]


def test_kernels_of_the_mex_file_are_those_of_c_in_another_order() -> None:
    (program,) = kernels("puma560", (Quantity.POSE,)).programs
    moved = columnwise(program)

    assert moved.statements == program.statements
    assert [moved.outputs[place] for place in places(program.signature.results[0])] == list(program.outputs)
    assert len(moved.outputs) == 16
    assert not batched(kernels("blocks", (Quantity.POSE,)))


@needs_octave
def test_the_header_of_the_mex_file_says_that_positions_of_tips_are_points() -> None:
    emitted = emit_language(kernels("hand", (parse_quantity("position"),)), MATLAB)

    assert "@param[out] base_p_tips  x, y, z of 5 points\n" in emitted["matlab/csrc/hand_mex.h"]


def test_what_octave_refuses_is_an_error_in_one_line() -> None:
    given = kernels("scara", (Quantity.POSE,))
    emitted = emit_language(given, MATLAB)
    path = "matlab/+scara/info.m"
    broken = {**emitted, path: emitted[path].replace("found.DOF", "found.(", 1)}
    with pytest.raises(CompileError, match="Octave refuses the tables of the package of scara: ") as caught:
        prove_language(given, MATLAB, broken)

    assert "\n" not in str(caught.value)
