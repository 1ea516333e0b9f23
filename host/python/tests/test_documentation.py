"""The examples of the reference run, and print what it says."""

import re


def examples(text):
    """Pairs of code and of the output that follows it, if any."""
    fences = re.findall(r"```(\w+)\n(.*?)```", text, re.DOTALL)
    for index, (kind, code) in enumerate(fences):
        if kind == "python":
            following = fences[index + 1] if index + 1 < len(fences) else ("", "")
            yield code, following[1] if following[0] == "text" else None


def test_examples(root, python, tmp_path):
    text = (root / "docs" / "reference" / "python.md").read_text()
    all_examples = list(examples(text))
    assert len(all_examples) >= 4
    (tmp_path / "scenes").symlink_to(root / "scenes")
    for code, expected in all_examples:
        process = python(code)
        assert process.returncode == 0, process.stderr
        if expected is not None:
            assert process.stdout == expected


def test_a_failing_example_is_noticed(python):
    """Negative control."""
    [(code, expected)] = examples("```python\nprint(1)\n```\n```text\n2\n```\n")
    assert python(code).stdout != expected
    assert python("import trisect.missing").returncode != 0
