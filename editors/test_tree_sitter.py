"""The tree-sitter grammars, compiled as editors compile them, on every file of the repository.

`pip install tree-sitter pytest`, a C compiler, and `vimc4` (the one of the workspace, or that of VIMC4).
"""

import ctypes
import json
import os
import re
import subprocess
import tomllib
from pathlib import Path

import pytest
from tree_sitter import Language, Parser, Query, QueryCursor

HERE = Path(__file__).parent
ROOT = HERE.parent
VIMC4 = os.environ.get("VIMC4", str(ROOT / "target/debug/vimc4"))

LISTS = [
    "examples/commands.txt", "examples/program.txt", "fixtures/programs/pattern.cnc",
    *[f"emulator/tests/programs/{name}.txt"
      for name in ["beyond", "drill", "gate", "halt", "poll", "shuttle", "stop", "stored"]],
]
FILES = [path for folder in ["examples", "fixtures/ncp"] for path in sorted((ROOT / folder).rglob("*.ncp"))]


@pytest.fixture(scope="session")
def language(tmp_path_factory):
    """The languages, by name."""
    built = {}

    def compiled(name):
        if name not in built:
            source = HERE / f"tree-sitter-{name}" / "src"
            out = tmp_path_factory.mktemp(name) / f"{name}.so"
            subprocess.run(["cc", "-shared", "-fPIC", "-Wall", "-Wno-unused", "-I", source, source / "parser.c", "-o", out], check=True)
            begin = getattr(ctypes.CDLL(str(out)), f"tree_sitter_{name}")
            begin.restype = ctypes.c_void_p
            capsule = ctypes.pythonapi.PyCapsule_New
            capsule.restype, capsule.argtypes = ctypes.py_object, [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]
            built[name] = Language(capsule(begin(), b"tree_sitter.Language", None))
        return built[name]

    return compiled


def parsed(language, text):
    return Parser(language).parse(text if isinstance(text, bytes) else text.encode()).root_node


def nodes(node):
    yield node
    for child in node.children:
        yield from nodes(child)


def shape(node):
    """The tree as a corpus has it."""
    inner = [shape(child) for child in node.named_children]
    return f"({' '.join([node.type, *inner])})"


def corpus():
    for path in sorted(HERE.glob("tree-sitter-*/test/corpus/*.txt")):
        grammar = path.parts[-4].removeprefix("tree-sitter-")
        for title, text, tree in re.findall(r"^=+\n(.+?)\n=+\n\n(.*?)\n---\n\n(.*?)(?=\n=+\n|\Z)", path.read_text(), re.S | re.M):
            yield pytest.param(grammar, text, tree, id=f"{grammar}: {title}")


@pytest.mark.parametrize(("grammar", "text", "tree"), list(corpus()))
def test_corpus(language, grammar, text, tree):
    wanted = re.sub(r"\s+", " ", tree).replace("( ", "(").replace(" )", ")").strip()
    assert shape(parsed(language(grammar), text)) == wanted


@pytest.mark.parametrize("path", [*FILES, *[ROOT / name for name in LISTS]], ids=lambda path: path.name)
def test_every_example_is_read_whole(language, path):
    grammar = language("ncp" if path.suffix == ".ncp" else "isel")
    root = parsed(grammar, path.read_bytes())
    wrong = [(node.start_point, node.type) for node in nodes(root) if node.is_error or node.is_missing or node.type == "unknown"]
    assert wrong == []


def test_every_command_of_isel_is_of_its_class(language):
    table = (ROOT / "crates/isel-wire/src/table.rs").read_text().split("const ROWS")[1]
    seen = 0
    wanted = {}
    for row in table.split("\n    row(")[1:]:
        kind = re.match(r'Op::\w+, "[^"]+", (\w+),', row)[1].lower()
        for name in re.findall(r'\.(?:direct|stored)\("([^"]+)"', row):
            wanted.setdefault(name, set()).add(kind)
    del wanted["@axes"]
    for name, kinds in wanted.items():
        line = name.replace("@", "@0") + ("Rp" if name == "@D" else "")
        root = parsed(language("isel"), line)
        assert not root.has_error, line
        assert root.children[0].child_by_field_name("command").type in kinds, line
        seen += 1
    assert seen > 65


@pytest.mark.parametrize(("grammar", "files"), [("ncp", FILES), ("isel", [ROOT / name for name in LISTS])])
def test_every_piece_has_a_colour(language, grammar, files):
    query = Query(language(grammar), (HERE / f"tree-sitter-{grammar}/queries/highlights.scm").read_text())
    for path in files:
        root = parsed(language(grammar), path.read_bytes())
        coloured = {node.id for found in QueryCursor(query).captures(root).values() for node in found}
        bare = [node.type for node in nodes(root) if not node.children and node.id not in coloured and node.type != "_newline"]
        assert bare == [], path


# What the server calls the pieces of a job, in the order of its legend, and the nodes that are such pieces.
KINDS = ["line number", "command", "word", "number", "text", "comment"]
NODES = {
    "line_number": "line number", "motion": "command", "setting": "command", "output": "command", "flow": "command",
    "mark_name": "command", "word": "word", "constant": "word", "number": "number", "port_value": "number",
    "text": "text", "comment": "comment", "bracket_comment": "comment",
}


class Server:
    """`vimc4 ncp lsp`, in the framing of its protocol."""

    def __init__(self):
        self.process = subprocess.Popen([VIMC4, "ncp", "lsp"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.last = 0
        self.ask("initialize", {"processId": None, "rootUri": None, "capabilities": {}})

    def tell(self, method, params, **id):
        body = json.dumps({"jsonrpc": "2.0", "method": method, "params": params, **id}).encode()
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
        self.process.stdin.flush()

    def ask(self, method, params):
        self.last += 1
        self.tell(method, params, id=self.last)
        while True:
            length = int(self.process.stdout.readline().split(b":")[1])
            self.process.stdout.readline()
            message = json.loads(self.process.stdout.read(length))
            if message.get("id") == self.last:
                return message["result"]

    def pieces(self, lines):
        """The pieces of each line, without the blanks around them."""
        document = {"uri": f"file:///{self.last}.ncp", "languageId": "ncp", "version": 1, "text": "\n".join(lines)}
        self.tell("textDocument/didOpen", {"textDocument": document})
        data = self.ask("textDocument/semanticTokens/full", {"textDocument": {"uri": document["uri"]}})["data"]
        found, line, start = [[] for _ in lines], 0, 0
        for delta, column, length, kind, _ in zip(*[iter(data)] * 5):
            line, start = line + delta, column if delta else start + column
            text = lines[line][start:start + length]
            begin = start + len(text) - len(text.lstrip())
            found[line].append((begin, begin + len(text.strip()), KINDS[kind]))
        return found


def jobs():
    """All jobs of the fixtures, as lists of lines in ASCII, where bytes and columns are the same."""
    for path in sorted((ROOT / "fixtures/ncp").rglob("*.toml")):
        for job in tomllib.loads(path.read_text()).get("job", []):
            for text in (value for key, value in job.items() if key in ("program", "text", "each", "file") and isinstance(value, str)):
                yield path.name, re.split(r"\r\n|\n|\r", text)
    for path in FILES:
        yield path.name, path.read_text().splitlines()


def test_the_pieces_of_all_jobs_are_those_of_the_language_server(language):
    server, compared = Server(), 0
    try:
        for name, lines in jobs():
            if not all(line.isascii() for line in lines):
                continue
            ours = [[] for _ in lines]
            wrong = set()
            for node in nodes(parsed(language("ncp"), "\n".join(lines))):
                row = node.start_point[0]
                if node.type == "after_end":
                    # All of it is a comment, on the line of PROGEND too.
                    for at in range(row, len(lines)):
                        text = lines[at][node.start_point[1] if at == row else 0:]
                        begin = len(lines[at]) - len(text.lstrip())
                        if text.strip():
                            ours[at].append((begin, len(lines[at].rstrip()), "comment"))
                elif node.type in ("unknown", "ERROR", "bracket_comment") or node.is_missing:
                    # What is no command has no colours of the server's; the words of it have none here.
                    wrong.update(range(row, node.end_point[0] + 1))
                elif kind := NODES.get(node.type):
                    text = lines[row][node.start_point[1]:node.end_point[1]]
                    ours[row].append((node.start_point[1], node.start_point[1] + len(text.rstrip()), kind))
            for row, theirs in enumerate(server.pieces(lines)):
                # A name that runs into a word, as in MOVEABSX5, is none for the server; here it is taken apart.
                if row not in wrong and (theirs or not ours[row]):
                    assert ours[row] == theirs, f"{name}, line {row + 1}: {lines[row]}"
                    compared += len(theirs)
    finally:
        server.process.kill()
    assert compared > 5_000
