"""Ranges of readings of actuators in languages beside C and Python."""

from __future__ import annotations

from kinegen.errors import CompileError, ProofError
from tests.sabotage.case import Sabotage

# Language, name, file, place, what it becomes, after.
_ALTERED = (
    ("javascript", "a range", "palletiser.js", r"0\.5235987755982988", "0.5235", "ACTUATOR_RANGES"),
    ("javascript", "a range is missing", "palletiser.js", r", Object\.freeze\(\[[^]]*\]\)\]", "]", "ACTUATOR_RANGES"),
    ("javascript", "no ranges", "palletiser.js", r"export const ACTUATOR_RANGES", "const ACTUATOR_RANGES", ""),
    ("cpp", "a range", "palletiser.hpp", r"\(0\.5235987755982988", "(0.5235", "actuators_low"),
    ("cpp", "a range of floats", "palletiser.hpp", r"0\.52359873F", "0.5236F", "actuators_low"),
    ("cpp", "a reading at the end of its range", "palletiser.hpp", r" >= actuators_low", " > actuators_low",
     "bool actuators_within_limits("),
    ("cpp", "NaN within", "palletiser.hpp", r"\(actuators\[i\] >= (\S+)\) && \(actuators\[i\] <= (\S+)\)",
     r"!(actuators[i] < \1 || actuators[i] > \2)", "bool actuators_within_limits("),
    ("cpp", "readings are not clamped", "palletiser.hpp", r"clamped\[i\] = above[^;]*;", "clamped[i] = above;",
     "clamp_actuators("),
    ("rust", "a range", "src/lib.rs", r"0\.5235987755982988", "0.5235", "ACTUATOR_RANGES"),
    ("rust", "a reading at the end of its range", "src/lib.rs", r"0\.5235987755982988\.\.=", "0.5236..=",
     "fn actuators_within_limits("),
    ("rust", "a reading that is not looked at", "src/lib.rs", r"\n +&& [^\n]*\[3\]\)", "",
     "fn actuators_within_limits("),
    ("rust", "a range of floats", "src/f32.rs", r"clamp\(0\.5\d+", "clamp(0.5236", "fn clamp_actuators("),
    ("matlab", "a range", "+palletiser/info.m", r"0\.5235987755982988", "0.5235", "ACTUATOR_RANGES"),
    ("matlab", "a reading at the end of its range", "+palletiser/actuators_within_limits.m", r" >= low", " > low", ""),
    ("matlab", "readings are not clamped", "+palletiser/clamp_actuators.m", r"clamped\(actuators > high\)[^\n]*", "", ""),
    ("cuda", "a range", "palletiser.cuh", r"\(0\.5235987755982988", "(0.5235", "bool actuators_within_limits("),
    ("cuda", "a range that readings are clamped to", "palletiser.cuh", r"\(0\.5235987755982988", "(0.5235",
     "void clamp_actuators("),
)  # fmt: skip

CASES = tuple(
    Sabotage(
        f"readings in {language}: {name}", "palletiser", "actuators_to_joints", f"{language}/{file}", old, new, "double",
        (f"--languages={language}",), after=after, errors=(CompileError, ProofError),
    )
    for language, name, file, old, new, after in _ALTERED
)  # fmt: skip
