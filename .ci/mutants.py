"""Mutation testing of the numerics' decisions with their own unit tests: which changed operators no test notices.

    python3 .ci/mutants.py                     all files of FILES; --page writes docs/reference/mutants.md
    python3 .ci/mutants.py lcp saltation       those whose paths contain one of the words
    python3 .ci/mutants.py --list              the mutants, none run

All mutants are compiled into one test program (a copy of the core below target/mutants): every operator stands there
beside what it is mistaken for, `a < b` as `if mutant(7) { a <= b } else { a < b }`, and a variable of the environment
says which one is wrong. So a mutant costs the tests that it is tried with, and no build. First the tests of its own
module are run, then, if these let it live, all of the core. A mutant is killed by a test that fails or takes ten times
as long. What differs only where two numbers are equal to the last bit (`<` for `<=`) is counted apart; mutants that
compute the same, or the same at more cost, stand in `.ci/mutants.toml`, each with its reason.
"""

import argparse
import hashlib
import math
import os
import re
import resource
import subprocess
import sys
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import tree_sitter
import tree_sitter_rust

ROOT = Path(__file__).parents[1]
HOUSE = ROOT / "target/mutants/house"
EXPLAINED = Path(__file__).with_suffix(".toml")
PAGE = ROOT / "docs/reference/mutants.md"
# complementarity problem, search, classification, continuation, saltation
FILES = [
    "contact/lcp.rs",
    "event/find.rs",
    "flow/bernstein.rs",
    "event/classify.rs",
    "event/held.rs",
    "event/friction.rs",
    "continuation/mod.rs",
    "continuation/newton.rs",
    "continuation/sequence.rs",
    "continuation/arclength/mod.rs",
    "continuation/arclength/borders.rs",
    "continuation/arclength/locate.rs",
    "orbit/saltation.rs",
]
# all tests of the core but those that take most of the time and look at none of these
ALL = ["--skip=flow::chebyshev", "--skip=flow::oscillator"]
# what an operator is mistaken for
WRONG = {
    "+": ["-"], "-": ["+"], "*": ["/"], "/": ["*"],
    "<": ["<=", ">"], "<=": ["<", ">"], ">": [">=", "<"], ">=": [">", "<"],
    "==": ["!="], "!=": ["=="], "&&": ["||"], "||": ["&&"],
    "+=": ["-="], "-=": ["+="], "*=": ["/="], "/=": ["*="],
}  # fmt: skip
# in these nothing is changed: what is no code of the program, and what the compiler computes
ASIDE = {"attribute_item", "const_item", "static_item", "macro_invocation", "type_arguments", "array_type", "enum_item"}

READING = """
A mutant that lives is not an error: it is a line that the core's own unit tests, two seconds of them, do not hold. What
friction, classification and borders decide is held by the integration tests (`tests/`), whose motions, switches and
families come from elsewhere; those are not run here.
"""

LANGUAGE = tree_sitter.Language(tree_sitter_rust.language())


class Mutant:
    def __init__(self, file: str, line: int, code: str, wrong: str, at_equality: bool):
        self.file, self.line, self.code, self.wrong, self.at_equality = file, line, code, wrong, at_equality

    def __str__(self) -> str:
        return f"{self.file}:{self.line}  {self.code}  ->  {self.wrong}"

    def key(self) -> tuple[str, str, str]:
        """What a reason knows it by: lines move."""
        return (self.file, self.code, self.wrong)


def write(path: Path, content: bytes) -> None:
    """A file that is the same already stays: it need not be compiled again."""
    if not path.exists() or path.read_bytes() != content:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


class House:
    """The core with mutants in it; those in `barred` (numbers) do not compile."""

    def __init__(self, files: list[str], barred: set[int]):
        self.mutants: list[Mutant] = []
        self.barred = barred
        for file in files:
            text = (ROOT / "src/core" / file).read_bytes()
            self.file, self.text = file, text
            write(HOUSE / "src/core" / file, self.rewritten(tree_sitter.Parser(LANGUAGE).parse(text).root_node))

    def number(self, node: tree_sitter.Node, wrong: bytes) -> int | None:
        """A new mutant, unless it is barred."""
        flat = lambda code: re.sub(r"\s+", " ", code.decode())
        operator = node.child_by_field_name("operator")
        before = flat(node.text) if node.type != "block" else f"fn {flat(node.parent.child_by_field_name('name').text)}"
        edges = [b"%s=" % operator.text, operator.text.rstrip(b"=")] if operator and operator.text[:1] in b"<>" else []
        at_equality = any(wrong.startswith(b"%s %s " % (node.children[0].text, e)) for e in edges if e != operator.text)
        self.mutants.append(Mutant(self.file, node.start_point[0] + 1, before, flat(wrong), at_equality))
        number = len(self.mutants)
        return None if number in self.barred else number

    def rewritten(self, node: tree_sitter.Node) -> bytes:
        if node.type in ASIDE or (node.type == "mod_item" and self.is_test(node)):
            return node.text
        parts, at = [], node.start_byte
        for child in node.children:
            length_of_array = node.type == "array_expression" and node.child_by_field_name("length") == child
            parts += [self.text[at : child.start_byte], child.text if length_of_array else self.rewritten(child)]
            at = child.end_byte
        parts.append(self.text[at : node.end_byte])
        code = b"".join(parts)
        for wrong in self.mistakes(node):
            number = self.number(node, wrong)
            if number is None:
                continue
            if node.type == "block":
                code = b"{ if crate::mutant(%d) { %s }\n" % (number, wrong) + code[1:]
            elif node.type == "compound_assignment_expr":
                code = b"if crate::mutant(%d) { %s } else { %s }" % (number, wrong, code)
            else:
                code = b"(if crate::mutant(%d) { %s } else { %s })" % (number, wrong, code)
        return code

    def mistakes(self, node: tree_sitter.Node) -> list[bytes]:
        if node.type in ("binary_expression", "compound_assignment_expr"):
            left, operator, right = (node.child_by_field_name(n) for n in ("left", "operator", "right"))
            if b"let " in node.text:
                return []
            return [b"%s %s %s" % (left.text, w.encode(), right.text) for w in WRONG.get(operator.text.decode(), [])]
        if node.type == "unary_expression" and node.children[0].text in (b"!", b"-"):
            literal = node.children[1].type in ("float_literal", "integer_literal")
            in_pattern = node.parent.type.endswith("pattern")
            return [] if in_pattern else [b"(%s)" % node.children[1].text if not literal else node.children[1].text]
        if node.type == "block" and node.parent.type == "function_item":
            if any(c.type == "function_modifiers" and b"const" in c.text for c in node.parent.children):
                return []
            kind = node.parent.child_by_field_name("return_type")
            kind = b"" if kind is None else kind.text
            values = {b"": [b"return;"], b"bool": [b"return true;", b"return false;"], b"f64": [b"return 0.0;", b"return 1.0;"]}
            values |= {b"usize": [b"return 0;", b"return 1;"]}
            if kind.startswith(b"Vec<"):
                return [b"return vec![];"]
            if kind.startswith(b"Option<"):
                return [b"return None;"]
            return values.get(kind, [])
        return []

    def is_test(self, node: tree_sitter.Node) -> bool:
        before = node.prev_sibling
        return before is not None and b"cfg(test)" in before.text


def build(files: list[str]) -> tuple[House, Path]:
    """The test program with all mutants that compile."""
    known = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    changed = {f"src/core/{f}" for f in [*files, "lib.rs"]}
    for name in filter(None, known.split("\0")):
        if name not in changed:
            write(HOUSE / name, (ROOT / name).read_bytes())
    chosen = """
/// Whether a mutant is the one that is tried.
fn mutant(number: u32) -> bool {
    static TRIED: std::sync::LazyLock<u32> =
        std::sync::LazyLock::new(|| std::env::var("MUTANT").map_or(0, |m| m.parse().unwrap_or(0)));
    *TRIED == number
}
"""
    write(HOUSE / "src/core/lib.rs", ((ROOT / "src/core/lib.rs").read_text() + chosen).encode())
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "mutants"
    environment = {**os.environ, "CARGO_TARGET_DIR": str(target), "RUSTFLAGS": "-Awarnings"}
    # what did not compile the last time, of the same files
    last = HOUSE.parent / "barred"
    which = hashlib.sha256(b"".join((ROOT / "src/core" / f).read_bytes() for f in files)).hexdigest()
    told = last.read_text().split() if last.exists() else []
    barred = {int(n) for n in told[1:]} if told[:1] == [which] else set()
    while True:
        house = House(files, barred)
        command = ["cargo", "check", "--locked", "-p", "signorini-core", "--lib", "--profile", "test", "--message-format=short"]
        done = subprocess.run(command, cwd=HOUSE, env=environment, capture_output=True, text=True)
        if done.returncode == 0:
            break
        # the mutants that begin before an error, on its line
        worse = set()
        for file, line, column in re.findall(r"^src/core/(\S+?):(\d+):(\d+): error", done.stderr, flags=re.M):
            text = (HOUSE / "src/core" / file).read_text().split("\n")[int(line) - 1]
            before = text.encode()[: int(column)].decode(errors="ignore")
            numbers = re.findall(r"crate::mutant\((\d+)\)", before) or re.findall(r"crate::mutant\((\d+)\)", text)
            worse |= {int(numbers[-1])} if numbers else set()
        if not worse - barred:
            sys.exit(done.stderr[-4000:])
        barred |= worse
        print(f"{len(barred)} do not compile", file=sys.stderr)
    last.write_text(" ".join([which, *map(str, sorted(barred))]))
    command = ["cargo", "test", "--release", "--locked", "-p", "signorini-core", "--lib", "--no-run", "--message-format=short"]
    done = subprocess.run(command, cwd=HOUSE, env=environment, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(done.stderr[-4000:])
    program = re.search(r"Executable .*\((.*)\)", done.stderr)[1]
    return house, HOUSE / program


def ends_well(program: Path, number: int, words: list[str], limit: float) -> bool:
    """Whether the tests pass with a mutant (0: with none) within some seconds of the processor's time, which the system
    counts: what has no end does not outlive this program by much."""
    environment = {**os.environ, "MUTANT": str(number), "RUST_BACKTRACE": "0"}
    command = [str(program), "--test-threads=1", *words]
    seconds = (math.ceil(limit),) * 2
    limited = lambda: resource.setrlimit(resource.RLIMIT_CPU, seconds)
    done = subprocess.run(command, cwd=HOUSE / "src/core", env=environment, capture_output=True, preexec_fn=limited)
    return done.returncode == 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("words", nargs="*", help="files whose paths contain one of these")
    parser.add_argument("--list", action="store_true", help="list the mutants")
    parser.add_argument("--page", action="store_true", help="write docs/reference/mutants.md")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="mutants tried at a time")
    arguments = parser.parse_args()
    files = [f for f in FILES if not arguments.words or any(word in f for word in arguments.words)]
    house, program = build(files)
    tried = [n for n in range(1, len(house.mutants) + 1) if n not in house.barred]
    if arguments.list:
        print("\n".join(str(house.mutants[n - 1]) for n in tried))
        return 0
    explained = tomllib.loads(EXPLAINED.read_text())["mutant"]
    reasons = {(e["file"], e["code"], e["wrong"]): e["why"] for e in explained}
    modules = {f: f.removesuffix(".rs").removesuffix("/mod").replace("/", "::") + "::" for f in files}
    times = {}
    for words in [ALL, *([m] for m in modules.values())]:
        begun = time.time()
        if not ends_well(program, 0, words, 3600):
            sys.exit(f"the tests {words} fail without a mutant")
        times[tuple(words)] = time.time() - begun

    def lives(number: int) -> bool:
        mutant = house.mutants[number - 1]
        stages = [[modules[mutant.file]], ALL]
        return all(ends_well(program, number, words, 10 * times[tuple(words)] + 20) for words in stages)

    count = {f: [0, 0, 0, 0] for f in files}
    with ThreadPoolExecutor(arguments.jobs) as pool:
        for number, living in zip(tried, pool.map(lives, tried)):
            mutant = house.mutants[number - 1]
            count[mutant.file][0] += 1
            if living:
                why = reasons.get(mutant.key())
                count[mutant.file][1 if mutant.at_equality else 2 if why else 3] += 1
                known = mutant.at_equality or why
                print(f"{'explained' if known else 'LIVES'}  {mutant}{f'  # {why}' if why else ''}", flush=True)
    head = ["file", "mutants", "killed", "only at equality", "the same program", "alive"]
    table = [f"| {' | '.join(head)} |", "| --- | ---: | ---: | ---: | ---: | ---: |"]
    table += [f"| `{f}` | {a} | {a - b - c - d} | {b} | {c} | {d} |" for f, (a, b, c, d) in count.items()]
    print("\n".join(table))
    if arguments.page:
        PAGE.write_text(f"# Mutation testing\n\n{__doc__}\n" + "\n".join(table) + f"\n{READING}")
    return min(1, sum(c[3] for c in count.values()))


sys.exit(main())
