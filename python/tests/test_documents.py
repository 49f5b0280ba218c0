"""What the documents say of Python is so."""

import re

import pytest

#: Sections of docs/library.md whose twin in docs/python.md has another name, or that have none.
TWINS = {
    "Choose a model, a machine and a clock": "A controller is a fixture",
    "Rust": "The driver",
    "Python": "Without pytest",
    "C": None,
    "In the same process": None,
}


def headings(text):
    text = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    return [match[1] for match in re.finditer(r"^##+ (.*)$", text, re.MULTILINE)]


@pytest.mark.parametrize("page", ["docs/python.md", "README.md"])
def test_code_is_quoted_from_files_that_run(root, page):
    quoted, path = 0, None
    lines = iter((root / page).read_text().splitlines())
    for line in lines:
        if link := re.match(r"\s*From \[(python/tests/[^]]+|examples/python/[^]]+)\]\(", line):
            path = root / link[1]
        elif line.startswith(("#", "From ")):
            path = None
        elif line.strip() == "```python":
            indent = line[: -len("```python")]
            block = [text.removeprefix(indent) for text in iter(lines.__next__, f"{indent}```")]
            if path is not None:
                assert "\n".join(block) in path.read_text(), block
                quoted += 1
            else:
                assert page == "README.md", f"no line says from which file this is: {block}"
    assert quoted >= (15 if page == "docs/python.md" else 1)


def test_the_report_of_a_failure_is_as_shown(root, pytester):
    page = (root / "docs/python.md").read_text()
    shown = page.split("```text\n")[1].split("```")[0].splitlines()
    example = (root / "python/tests/test_readme.py").read_text()
    pytester.makepyfile(test_stop=example.replace('b"0F"', 'b"00"').replace("[2_500, 0, 0, 0]", "[]"))
    result = pytester.runpytest("--basetemp", pytester.path / "kept")

    def pattern(line):
        # Numbers of emulators, widths and folders are those of the day.
        line = re.sub(r"\[", "[[]", line)
        line = re.sub(r"-{10,} vimc4 \d+|-{10,}", "*", line)
        return re.sub(r" /tmp/.*/", " */", line.replace("…", "*"))

    result.stdout.fnmatch_lines([pattern(line) for line in shown])


def test_every_section_of_the_library_has_its_twin(root):
    mine = headings((root / "docs/python.md").read_text())
    for heading in headings((root / "docs/library.md").read_text()):
        twin = TWINS.get(heading, heading)
        assert twin is None or twin in mine, heading


def test_names_that_are_written_are_there(root):
    import vimc4 as virtual

    text = (root / "docs/python.md").read_text()
    prose = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    named = set(re.findall(r"`vimc4\.(\w+)", prose)) | set(re.findall(r"`emulator\.(\w+)", prose))
    assert len(named) > 10
    for name in named:
        assert hasattr(virtual, name) or hasattr(virtual.Emulator, name), name
    options = set(re.findall(r"`(\w+)=", prose)) - {"timeout"}
    init = virtual.Emulator.__init__.__annotations__.keys() | {"rtscts"}
    init |= virtual.sweep.__annotations__.keys()
    assert options <= init, options - init
