"""Builds the pages of the documentation: what they show is run and drawn here.

In the pages that are written by hand (docs/*.md) a block of `console` holds command lines behind `$ `; each is run, and
what it says is put beneath it. A block of `python` is run, and what it prints is put beneath it. An image of `results/`
is the one that a command before it has drawn. The pages of commands and effects are made from the program.

    python docs/build.py build/pages
"""

from __future__ import annotations

import io
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))
from pictures import draw_effects

import tables

DOCS = Path(__file__).parent
ROOT = DOCS.parent
BLOCK = re.compile(r"^```(console|python)\n(.*?)^```\n", re.MULTILINE | re.DOTALL)
IMAGE = re.compile(r"!\[([^\]]*)\]\((results/[^)]+)\)")
SECTION = re.compile(r'<!-- section "([^"]+)" of (\S+) -->')
TABLE = re.compile(r"<!-- table (\w+) -->")
NUMBERS = re.compile(r"<!-- numbers of (\w+) -->")
QUIET = re.compile(r"<!-- console quiet: (.*?) -->\n")
LINKS = {"](docs/": "](", "](CONTRIBUTING.md)": "](extending.md)", "](data/README.md)": "](data.md)"}
EXAMPLES = {
    "friction-chart": "my_test.toml",
    "identify-mu": "my_test.toml",
    "simulate-wear": "my_test.toml",
    "fit-k": "my_test.toml",
    "thermal": "my_test.toml",
    "contact": "my_test.toml --creepage 0.3",
    "check": "my_test.toml",
    "close-loop": "my_test.toml",
    "campaign": "simulate-wear loads.toml",
    "compare": "results/sweep_1 results/eurosprinter",
    "report": "my_test.toml",
    "effects": "falling_friction",
    "init": "another_test.toml",
}
"""What each command is shown with; one that is not here shows its options alone."""
FIGURES = {"campaign": "results/loads-simulate-wear.png", "compare": "results/compare/creep_curve.png"}
"""Where a command draws, if not results/my_test/COMMAND.png."""
EFFECTS = """---
hide: [toc]
---
# All effects

Sorted by the channel in which each shows first. The pictures show one test without the effect (dashed) and with it at a
typical size, and below what it leaves behind when it is missing.

"""
RESULTS = tuple(name for name in EXAMPLES if name not in ("campaign", "compare", "report", "effects", "init"))
ROOMS = ("physics", "effects", "laws", "model", "identify", "measurement", "loop")
"""Packages whose modules the reference lists."""


class DocumentationError(Exception):
    """A page shows something that does not work."""


@dataclass
class Workbench:
    """A folder with the tutorial's files in which the commands of the pages are run, one after the other."""

    folder: Path
    names: dict[str, Any] = field(default_factory=dict)

    def command(self, line: str) -> str:
        """What a command line says. Exit code 5 is a negative finding; others than 0 and it are errors."""
        said = io.StringIO()
        first, *pipe = line.split(" | ", 1)
        program, *arguments = shlex.split(first)
        if program == "twindisc":
            code = self._twindisc(arguments, said, io.StringIO() if pipe else said)
            if pipe and code in (0, 5):
                code, said = self._shell(pipe[0], said.getvalue())
        else:
            code, said = self._shell(line)
        if code not in (0, 5):
            raise DocumentationError(f"exit code {code} of `{line}`:\n{said.getvalue()}")
        return said.getvalue()

    def _shell(self, line: str, given: str = "") -> tuple[int, io.StringIO]:
        path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
        settings = {**os.environ, "PATH": path}
        done = subprocess.run(
            line, shell=True, cwd=self.folder, env=settings, input=given, capture_output=True, text=True
        )
        return done.returncode, io.StringIO(done.stdout + done.stderr)

    def _twindisc(self, arguments: list[str], said: io.StringIO, noted: io.StringIO) -> int:
        from twindisc_cli.cli import main

        with chdir(self.folder), redirect_stdout(said), redirect_stderr(noted):
            try:
                main(arguments)
            except SystemExit as left:
                return int(left.code or 0)
        return 0

    def python(self, code: str) -> str:
        """What a piece of Python prints; it sees the names of the pieces before it."""
        said = io.StringIO()
        with chdir(self.folder), redirect_stdout(said):
            exec(compile(code, "page", "exec"), self.names)
        return said.getvalue()


def page(text: str, bench: Workbench, place: Path) -> str:
    """A page with its blocks run and its images copied beside it, to the folder `place`."""

    def run(match: re.Match[str]) -> str:
        kind, body = match.groups()
        if kind == "python":
            return f"```python\n{body}```\n{shown(bench.python(body))}"
        return "".join(f"```console\n{line}\n{bench.command(line[2:])}```\n" for line in body.splitlines() if line)

    def image(match: re.Match[str]) -> str:
        name = match[2].replace("/", "-")
        place.mkdir(parents=True, exist_ok=True)
        shutil.copy(bench.folder / match[2], place / name)
        return f"![{match[1]}]({name})"

    text = TABLE.sub(lambda match: str(getattr(tables, match[1])()), SECTION.sub(section, text))
    text = NUMBERS.sub(lambda match: tables.numbers(match[1]), text)
    text = QUIET.sub(lambda match: bench.command(match[1])[:0], text)
    parts, end = [], 0
    for match in BLOCK.finditer(text):
        parts += [IMAGE.sub(image, text[end : match.start()]), run(match)]
        end = match.end()
    return "".join([*parts, IMAGE.sub(image, text[end:])])


def section(match: re.Match[str]) -> str:
    """A section of a file of the checkout, by its title; its links as they are here."""
    text = (ROOT / match[2]).read_text(encoding="utf-8")
    found = re.search(rf"^## {re.escape(match[1])}\n.*?(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)
    if found is None:
        raise DocumentationError(f"{match[2]} has no section {match[1]!r}")
    body = found[0]
    for there, here in LINKS.items():
        body = body.replace(there, here)
    return body


def shown(said: str) -> str:
    """What was printed, as a block; nothing where nothing was."""
    return f"```text\n{said}```\n" if said else ""


def command_pages() -> Iterator[tuple[str, str]]:
    """Name and page of every command: what it is for, an example with its figure, its options."""
    from importlib import import_module

    from typer.main import get_command

    from twindisc_cli.cli import app

    for name, command in sorted(get_command(app).commands.items()):  # type: ignore[attr-defined]
        module = name.replace("-", "_")
        try:
            about = (import_module(f"twindisc_cli.commands.{module}").__doc__ or "").partition(": ")[2]
        except ModuleNotFoundError:
            about = command.help or ""
        lines = [f"# {name}", "", capital(about.strip() or command.help or ""), ""]
        if name in EXAMPLES:
            lines += ["```console", f"$ twindisc {name} {EXAMPLES[name]}", "```", ""]
            figure = FIGURES.get(name, f"results/my_test/{name}.png")
            if name not in ("effects", "init", "check", "report"):
                lines += [f"![What {name} draws of the example]({figure})", ""]
        lines += ["## Options", "", "```console", f"$ twindisc {name} --help", "```", ""]
        yield name, "\n".join(lines)


def effect_pages() -> Iterator[tuple[str, str]]:
    """Name and page of every effect, from its file, with its formula typeset and its picture."""
    from twindisc_cli.effects import catalogue

    for name, effect in sorted(catalogue().items()):
        title, _, rest = effect.explanation.partition("\n")
        head, _, what = title.partition(": ")
        lines = [f"# {head}", "", f"`[effects.{name}]`: {what}", "", f"$$ {tables.FORMULAS[name]} $$", ""]
        lines += [f"![A test without and with {head.lower()}, in the {effect.channel}]({name}.png)", ""]
        lines += [
            "*A test without the effect, and with it at a typical size; below, what it leaves behind.*",
            "",
        ]
        lines += ["```text", rest.strip("\n"), "```", ""]
        lines += ["| parameter | unit | from | to | off | what it is |", "|---|---|---|---|---|---|"]
        for p in effect.params:
            off = "" if p.off is None else f"{p.off:g}"
            lines.append(f"| `{p.name}` | {p.unit} | {p.lower:g} | {p.upper:g} | {off} | {p.meaning} |")
        seen = ", ".join(sorted(effect.seen_in))
        lines += [
            "",
            f"Acts at the stage *{effect.stage}*; shows first in the {effect.channel}, may be seen in: {seen}.",
        ]
        lines += ["", f"Source: {effect.source}.", ""]
        yield name, "\n".join(lines)


def results_of(bench: Workbench) -> str:
    """For every command the keys of its JSON and the variables of its HDF5 file, of the tutorial's test."""
    parts = []
    for name in RESULTS:
        answer = json.loads(bench.command(f"twindisc {name} {EXAMPLES[name]} --json -q"))
        parts.append(f"### {name}\n\n{tables.outcome(answer)}")
        parts.append(tables.variables(bench.folder / f"results/my_test/{name}.h5"))
    return "\n".join(parts)


def modules() -> str:
    """A reference of every module that is not internal, below the public interface."""
    import pkgutil

    import twindisc_cli

    found: dict[str, list[str]] = {}
    for module in pkgutil.walk_packages(twindisc_cli.__path__, "twindisc_cli."):
        parts = module.name.split(".")[1:]
        if parts[0] in ROOMS and not module.ispkg and not any(part.startswith("_") for part in parts):
            found.setdefault(parts[0], []).append(module.name)
    lines = []
    for room in ROOMS:
        lines += [f"## {room}", "", *(f"::: {name}\n" for name in found.get(room, ()))]
    return "\n".join(lines)


def capital(text: str) -> str:
    """The text with a capital at its beginning."""
    return text[:1].upper() + text[1:]


def build(target: Path, workbench: Path) -> None:
    """Write all pages to `target`; commands run in `workbench`."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    shutil.rmtree(target, ignore_errors=True)
    target.mkdir(parents=True)
    for name in ("tutorial", "examples"):
        shutil.copytree(DOCS / name, workbench, dirs_exist_ok=True)
    for name in ("configs", "data"):
        shutil.copytree(ROOT / name, workbench / name, dirs_exist_ok=True)
    for picture in DOCS.glob("*.png"):
        shutil.copy(picture, target)
    shutil.copy(ROOT / "data/README.md", target / "data.md")
    shutil.copy(ROOT / "CODE_OF_CONDUCT.md", target / "conduct.md")
    bench = Workbench(workbench)
    for path in [DOCS / "tutorial.md", *sorted(set(DOCS.glob("*.md")) - {DOCS / "tutorial.md"})]:
        bench.names = {}
        text = path.read_text(encoding="utf-8").replace("](../data/README.md)", "](data.md)")
        text = text.replace("<!-- modules -->", modules())
        if "<!-- results -->" in text:
            text = text.replace("<!-- results -->", results_of(bench))
        (target / path.name).write_text(page(text, bench, target), encoding="utf-8")
    listed: dict[str, list[str]] = {}
    for folder, pages in (("commands", command_pages()), ("effects", effect_pages())):
        (target / folder).mkdir()
        rows = []
        for name, text in pages:
            done = page(text, bench, target / folder)
            (target / folder / f"{name}.md").write_text(done, encoding="utf-8")
            rows.append(f"- [{name}]({name}.md)")
        listed[folder] = [f"{folder}/index.md", *(f"{folder}/{row[3 : row.index(']')]}.md" for row in rows)]
        index = EFFECTS + tables.effects() if folder == "effects" else "# All commands\n\n" + "\n".join(rows) + "\n"
        (target / folder / "index.md").write_text(index, encoding="utf-8")
    draw_effects(target / "effects")
    shutil.copy(DOCS / "site.css", target)
    for name in ("hooks.py", "doctests.py"):
        shutil.copy(DOCS / name, target.parent)
    site = (DOCS / "mkdocs.yml").read_text(encoding="utf-8")
    for folder, paths in listed.items():
        site = re.sub(
            rf"^( *)(- \w+:) {folder}/\n",
            lambda at, paths=paths: f"{at[1]}{at[2]}\n" + "".join(f"{at[1]}  - {path}\n" for path in paths),  # type: ignore[misc]
            site,
            flags=re.MULTILINE,
        )
    (target.parent / "mkdocs.yml").write_text(site, encoding="utf-8")


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as name:
        build(Path(sys.argv[1]), Path(name))
