"""What `check` accepts can be watched, in bounded time and memory; all else it refuses in words."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from visup.agent import Mind, Observation
from visup.agent.model.errors import VisupError
from visup.rules.language.parser import load_rules, parse_rules
from visup.tasks import load_tasks, parse_task
from visup.tasks.checks.bounds import DEEPEST_STAGES, MAX_FAULTS
from visup.tasks.supervision.supervise import task_reasoner
from visup.tasks.tools.outline import outline

ACTIONS = ("converging", "touching", "diverging")


def sequential_stages(count: int) -> str:
    lines = [f"<s{i}> ::= {ACTIONS[i % 3]}(a, b) <s{i + 1}>" for i in range(count)]
    return "\n".join([*lines, f"<s{count}> ::= {ACTIONS[count % 3]}(a, b)"])


def parallel_actions(count: int, form: str) -> str:
    return "<t> ::= " + "\n & ".join(f"({form.format(n)})" for n in range(count))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (sequential_stages(3000), "3001 stages"),
        (sequential_stages(DEEPEST_STAGES), "inside one another"),
        (
            "\n".join(f"<s{n}> ::= <s{n + 1}>" for n in range(1500)) + "\n<s1500> ::= seen(a)",
            "inside",
        ),
        (
            parallel_actions(25, "converging(a, b{0}) | touching(a, b{0})"),
            "25 things at the same time",
        ),
        (parallel_actions(10, "converging(a, b{0}) | touching(a, b{0})"), "1024 ways"),
        ("<t> ::= " + " ".join(f"convergin{n}(a, b)" for n in range(5000)), "characters"),
        ("<t> ::= " + "\n".join(f"<s{n}>" for n in range(90_000)), "characters"),
        ("<t> ::= " + "(" * 3000 + "seen(a)" + ")" * 3000, "too deep|60 deep|characters"),
    ],
)
def test_tasks_beyond_the_limits_are_refused_quickly(text: str, said: str) -> None:
    begin = time.process_time()
    with pytest.raises(VisupError, match=said) as told:
        parse_task(text)
    assert time.process_time() - begin < 5.0
    assert len(str(told.value)) < 100_000


def test_many_mistakes_give_a_bounded_report() -> None:
    text = "<t> ::= " + "\n".join(f"convergin{n}(a, b)" for n in range(5000))
    with pytest.raises(VisupError) as told:
        parse_task(text)
    assert len(getattr(told.value, "errors", (1,))) <= MAX_FAULTS
    assert len(str(told.value)) < 100_000


@settings(max_examples=20, deadline=None)
@given(
    st.one_of(
        st.integers(1, DEEPEST_STAGES - 1).map(sequential_stages),
        st.tuples(
            st.integers(2, 8),
            st.sampled_from(
                ["converging(a, b{0}) | touching(a, b{0})", "seen(b{0}) touching(a, b{0})"]
            ),
        ).map(lambda t: parallel_actions(*t)),
    )
)
def test_accepted_tasks_can_be_supervised_drawn_and_formatted(text: str) -> None:
    task = parse_task(text)
    begin = time.process_time()
    reason, mind = task_reasoner([task]), Mind()
    for n in range(3):
        mind = reason(mind, Observation(n, n / 10, (64, 48))).mind
    assert outline(task).inside
    assert parse_task(str(task)) == task
    assert time.process_time() - begin < 10.0


def test_includes_are_limited_to_the_folder_of_the_task(tmp_path: Path) -> None:
    inside = tmp_path / "cell"
    (inside / "parts").mkdir(parents=True)
    (tmp_path / "secret").write_text("the password is swordfish\n")
    (inside / "parts" / "common.task").write_text("<near> ::= converging(a, b)\n")
    (inside / "link.task").symlink_to(tmp_path / "secret")
    good = inside / "good.task"
    good.write_text('include "parts/common.task"\n<t> ::= <near> touching(a, b)\n')
    assert load_tasks(good)[0].name == "t"
    for path in ("../secret", str(tmp_path / "secret"), "link.task", "parts/../../secret"):
        (inside / "bad.task").write_text(f'include "{path}"\n<t> ::= seen(a)\n')
        with pytest.raises(VisupError, match="cannot be included") as told:
            load_tasks(inside / "bad.task")
        assert "swordfish" not in str(told.value)


def test_includes_are_limited_to_the_given_root(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root, cell = tmp_path / "tasks", tmp_path / "tasks" / "cell"
    cell.mkdir(parents=True)
    for folder in (tmp_path, root):
        (folder / "common.task").write_text("<near> ::= converging(a, b)\n")
    monkeypatch.setenv("VISUP_TASK_ROOT", str(root))
    for path, allowed in (("../common.task", True), ("../../common.task", False)):
        (cell / "t.task").write_text(f'include "{path}"\n<t> ::= <near> touching(a, b)\n')
        if allowed:
            assert load_tasks(cell / "t.task")[0].name == "t"
        else:
            with pytest.raises(VisupError, match="cannot be included"):
                load_tasks(cell / "t.task")


@pytest.mark.parametrize("name", ["x" * 3900, "x/" * 1900, "\\0", "/dev/zero", "."])
def test_an_include_of_a_device_or_pipe_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "a.task").write_text(f'include "{name}"\n<t> ::= seen(a)\n')
    with pytest.raises(VisupError) as told:
        load_tasks(tmp_path / "a.task")
    assert len(str(told.value)) < 1000


RULE = 'rule close(a, b): warning\n    when gap(a, b) < 9 px\n    say "{a}."\n'


def test_a_byte_order_mark_is_accepted_in_both_languages(tmp_path: Path) -> None:
    (tmp_path / "a.rules").write_text(RULE, "utf-8-sig")
    assert load_rules(tmp_path / "a.rules")[0].name == "close"
    (tmp_path / "a.task").write_text("<t> ::= seen(a)\n", "utf-8-sig")
    assert load_tasks(tmp_path / "a.task")[0].name == "t"


@pytest.mark.parametrize(
    "text",
    [
        RULE.replace("when ", "when " + "not " * 1000),
        RULE.replace(
            "when gap(a, b) < 9 px", "when " + " and ".join(["gap(a, b) < 9 px"] * 20_000)
        ),
        RULE.replace("gap", "(" * 3000 + "gap"),
        "".join(RULE.replace("close", f"r{n}") for n in range(2000)),
        "rule " * 40_000,
        RULE * 900,
    ],
)
def test_rules_beyond_the_limits_are_refused_quickly(text: str) -> None:
    begin = time.process_time()
    with pytest.raises(VisupError) as told:
        parse_rules(text)
    assert time.process_time() - begin < 10.0
    assert len(str(told.value)) < 100_000


def test_devices_and_pipes_are_never_read(tmp_path: Path) -> None:
    import os

    from visup.runs.inputs.zones import load_zones

    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "large").write_bytes(b"#" * (2**20 + 1))
    for path in (Path("/dev/zero"), tmp_path / "pipe", tmp_path / "large", tmp_path):
        for load in (load_rules, load_tasks, load_zones):
            with pytest.raises(VisupError):
                load(path)
