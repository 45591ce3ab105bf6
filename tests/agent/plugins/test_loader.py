from __future__ import annotations

import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent.model.errors import BehaviourError, ErrorGroup, SettingsError, VisupError
from visup.agent.plugins.factory import find_factories, load_behaviours
from visup.agent.plugins.settings import merge_settings, parse_settings, read_settings

LAMP = """
from pydantic import BaseModel, Field, field_validator
from visup.agent import Contract

class Lamp:
    contract = Contract("lamp", gives=("lamp",))

    class Settings(BaseModel):
        contrast: float = Field(100, gt=0)
        colours: list[str] = []

        @field_validator("colours")
        @classmethod
        def known(cls, colours):
            if "octarine" in colours:
                raise ValueError("colours that people see")
            return colours

    def __init__(self, settings=None):
        self.settings = settings or self.Settings()

    def perceive(self, frame, observation, directives):
        yield self.contract.percept(frame, self.settings.contrast)
"""


@pytest.fixture
def lamp(tmp_path: Path) -> Path:
    path = tmp_path / "lamp.py"
    path.write_text(LAMP)
    return path


def contrast(path: Path | str, **values: object) -> float:
    (made,) = load_behaviours(str(path), {"lamp": values})
    return float(made.settings.contrast)  # type: ignore[attr-defined]


def test_settings_go_to_the_plug_ins_own_model(lamp: Path) -> None:
    assert contrast(lamp) == 100
    assert contrast(lamp, contrast=7) == 7
    assert contrast(lamp, contrast="7.5") == 7.5


@pytest.mark.parametrize(
    ("values", "where", "message"),
    [
        ({"contrast": -3}, "lamp.contrast", "-3 is not valid\n  expected: greater than 0"),
        ({"contrast": "much"}, "lamp.contrast", "'much' is not valid\n  expected: a valid number"),
        ({"contast": 3}, "lamp.contast", "did you mean 'contrast'?"),
        ({"zoom": 3}, "lamp.zoom", "expected: one of: contrast, colours"),
        ({"colours": ["octarine"]}, "lamp.colours", "expected: colours that people see"),
        ({"colours": ["red", 3]}, "lamp.colours.1", "3 is not valid"),
    ],
)
def test_an_invalid_setting_is_reported_with_its_place(
    lamp: Path, values: dict[str, object], where: str, message: str
) -> None:
    with pytest.raises(SettingsError) as caught:
        contrast(lamp, **values)
    assert caught.value.where == where
    assert message in str(caught.value)


def test_all_errors_of_settings_are_reported_together(lamp: Path) -> None:
    with pytest.raises(ErrorGroup) as caught:
        contrast(lamp, contrast=-1, colours=3)
    assert len(caught.value.errors) == 2


def test_a_behaviour_without_settings_refuses_any(tmp_path: Path) -> None:
    path = tmp_path / "plain.py"
    path.write_text(
        "from visup.agent import Contract\nclass A:\n    contract = Contract('a', ('x',))\n"
        "    def perceive(self, frame, observation, directives): return ()\n"
    )
    with pytest.raises(SettingsError, match="behaviour 'a' has no settings"):
        load_behaviours(str(path), {"a": {"n": 1}})


def test_a_behaviour_is_loaded_by_module_path(lamp: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = lamp.parent / "my_lamps"
    package.mkdir()
    (package / "__init__.py").touch()
    lamp.rename(package / "bright.py")
    monkeypatch.syspath_prepend(lamp.parent)
    assert contrast("my_lamps.bright:Lamp", contrast=9) == 9
    with pytest.raises(BehaviourError, match="has no 'Lantern'") as caught:
        load_behaviours("my_lamps.bright:Lantern")
    assert caught.value.expected == "one of: Lamp"
    with pytest.raises(BehaviourError, match=r"No module named 'my_lamps\.dark'"):
        load_behaviours("my_lamps.dark:Lamp")


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("    def perceive(self, frame): return ()", "cannot be called: too many positional"),
        (
            "    async def perceive(self, frame, observation, directives): return ()",
            "is asynchronous",
        ),
        ("    perceive = 3", "has no method `perceive`"),
    ],
)
def test_a_perceive_that_cannot_be_called_is_refused(
    tmp_path: Path, body: str, message: str
) -> None:
    path = tmp_path / "odd.py"
    path.write_text(
        f"from visup.agent import Contract\nclass A:\n    contract = Contract('a', ('x',))\n{body}\n"
    )
    with pytest.raises(BehaviourError, match=message) as caught:
        load_behaviours(str(path))
    assert "perceive(self, frame, observation, directives)" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "line"), [("x = 1\ny = x +\n", 2), ("x = 1\n\nraise SystemExit\n", 3)]
)
def test_a_file_that_does_not_run_is_reported_with_its_line(
    tmp_path: Path, text: str, line: int
) -> None:
    path = tmp_path / "broken.py"
    path.write_text(text)
    with pytest.raises(BehaviourError, match="it does not run") as caught:
        load_behaviours(str(path))
    assert caught.value.where == f"{path}:{line}"


def test_an_invalid_contract_in_a_file_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "lamp.py"
    path.write_text("from visup.agent import Contract\nContract('lamp', gives=('lamp'))\n")
    with pytest.raises(BehaviourError, match="a tuple of one has a comma"):
        load_behaviours(str(path))


def test_two_files_of_the_same_name_are_different_modules(lamp: Path, tmp_path: Path) -> None:
    other = tmp_path / "other" / "lamp.py"
    other.parent.mkdir()
    other.write_text(LAMP.replace("100", "5"))
    first, second = load_behaviours(str(lamp))[0], load_behaviours(str(other))[0]
    assert type(first).__module__ != type(second).__module__
    assert sys.modules[type(first).__module__].__file__ == str(lamp)


def test_imported_classes_are_not_behaviours_of_the_file(lamp: Path) -> None:
    lamp.write_text(lamp.read_text() + "\nfrom visup.percepts.health import HealthBehaviour\n")
    assert [o.contract.name for o in find_factories(str(lamp)) if o.contract] == ["lamp"]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("120", 120),
        ("1.5", 1.5),
        ("true", True),
        ("[1, 2]", [1, 2]),
        ('"7"', "7"),
        ("red", "red"),
        ("a=b", "a=b"),
        ("", ""),
    ],
)
def test_values_on_the_command_line_are_toml_or_text(text: str, value: object) -> None:
    assert parse_settings([f"lamp.x={text}"]) == {"lamp": {"x": value}}


@pytest.mark.parametrize("text", ["lamp", "lamp=3", "lamp.=3", ".x=3", "lamp.x"])
def test_a_malformed_setting_is_refused(text: str) -> None:
    with pytest.raises(SettingsError, match="cannot be read"):
        parse_settings([text])


@given(st.text(max_size=20))
def test_any_setting_is_read_or_refused_with_a_message(text: str) -> None:
    try:
        values = parse_settings([text])
    except VisupError:
        return
    assert [len(table) for table in values.values()] == [1]


def test_one_setting_given_twice_is_refused() -> None:
    with pytest.raises(SettingsError, match="comes twice"):
        parse_settings(["lamp.x=1", "lamp.x=2"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "cannot be read"),
        ("x =", "it is not TOML"),
        ("[lamp]\nx = 1", "'lamp' is unknown"),
        ("behaviours = 3", "not a table of tables"),
        ("[behaviours]\nlamp = 3", "not a table of tables"),
    ],
)
def test_an_invalid_settings_file_is_refused(
    tmp_path: Path, text: str | None, message: str
) -> None:
    path = tmp_path / "settings.toml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(SettingsError, match=message) as caught:
        read_settings(path)
    assert caught.value.where == str(path)


def test_the_command_line_overrides_the_file(tmp_path: Path) -> None:
    path = tmp_path / "settings.toml"
    path.write_text("[behaviours.lamp]\ncontrast = 3\ncolours = ['red']\n")
    values = merge_settings(read_settings(path), parse_settings(["lamp.contrast=4"]))
    assert values == {"lamp": {"contrast": 4, "colours": ["red"]}}
