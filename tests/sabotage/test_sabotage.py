"""Every alteration of the emitted text is refused, and the untouched text passes; `make test-sabotage` runs this."""

from __future__ import annotations

import re
import shutil
from importlib import import_module
from pathlib import Path

import pytest

from kinegen.backends.languages import LANGUAGES
from kinegen.errors import KinegenError
from tests.sabotage.case import Sabotage, Setting
from tests.sabotage.workshop import attempt

pytestmark = pytest.mark.sabotage

MODULES = sorted(path.stem for path in Path(__file__).parent.glob("cases_*.py"))
CASES: tuple[Sabotage, ...] = tuple(case for name in MODULES for case in import_module(f"tests.sabotage.{name}").CASES)


@pytest.fixture(autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is remembered of other runs; what one attempt compiled may serve the next."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.getbasetemp() / "user-cache"))
    monkeypatch.delenv("CC", raising=False)


@pytest.fixture(autouse=True)
def _tools(request: pytest.FixtureRequest) -> None:
    """What runs a language is needed to refuse it."""
    given = request.node.callspec.params if hasattr(request.node, "callspec") else {}
    words = " ".join(map(str, (given.get("setting"), getattr(given.get("case"), "setting", ""))))
    for language in LANGUAGES.values():
        if f"--languages={language.name}" in words and not any(map(shutil.which, language.tools)):
            pytest.skip(f"needs {language.install}")


def in_one_process(setting: Setting) -> pytest.MarkDecorator:
    """All attempts at one setting share what is emitted and expected."""
    return pytest.mark.xdist_group(str(setting))


SETTINGS = [
    pytest.param(each, id=str(each), marks=in_one_process(each))
    for each in dict.fromkeys(case.setting for case in CASES)
]
ALTERED = [pytest.param(each, id=each.name, marks=in_one_process(each.setting)) for each in CASES]


@pytest.mark.parametrize("setting", SETTINGS)
def test_untouched_text_passes(setting: Setting, tmp_path: Path) -> None:
    attempt(setting, tmp_path)

    assert any(tmp_path.iterdir())


@pytest.mark.parametrize("case", ALTERED)
def test_altered_text_is_refused(case: Sabotage, tmp_path: Path) -> None:
    with pytest.raises(KinegenError) as caught:
        attempt(case.setting, tmp_path, case)

    assert isinstance(caught.value, case.errors), caught.value
    assert re.search(case.message, str(caught.value)), caught.value
    assert not any(tmp_path.iterdir()), "something was written"


def test_every_alteration_has_a_name_of_its_own() -> None:
    assert len({case.name for case in CASES}) == len(CASES)
