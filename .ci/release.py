"""make release VERSION=X.Y.Z: everything that a release is made of, and nothing published.

    python3 .ci/release.py X.Y.Z [--tree FOLDER] [--date YYYY-MM-DD] [--texts]

Versions in all manifests, the lock file, CITATION.cff, .zenodo.json and the recipe of conda; the part of CHANGELOG.md that is unreleased gets version and date; the text of the tag goes to
target/release-notes/X.Y.Z.md. Then the crates are packaged and built from their packages, and archive and wheel are made (.ci/package). `--texts` stops before that.
"""

import argparse
import datetime
import json
import os
import pathlib
import platform
import re
import shutil
import subprocess
import sys

UNRELEASED = "## Unreleased\n"


def refuse(why):
    sys.exit(f"release: {why}")


def replaced(path, pattern, new, count=1):
    """The file with the places of the pattern, which must be so many, in other words."""
    text = path.read_text()
    changed, found = re.subn(pattern, new, text, flags=re.M)
    if found != count:
        refuse(f"{path}: {found} places of {pattern!r}, not {count}")
    path.write_text(changed)


def release_of(version):
    parts = re.fullmatch(r"(\d+)\.(\d+)\.(\d+)", version)
    if not parts:
        refuse(f"{version} is no version: give three numbers, as in 0.2.0")
    return tuple(map(int, parts.groups()))


def texts(tree, version, date):
    """All files that say the version."""
    manifest = tree / "Cargo.toml"
    old = re.search(r'^version = "(.*)"', manifest.read_text(), re.M).group(1)
    if release_of(version) <= release_of(old):
        refuse(f"{version} is not later than {old}")
    changelog = tree / "CHANGELOG.md"
    text = changelog.read_text()
    if text.count(UNRELEASED) != 1:
        refuse(f"{changelog}: one heading 'Unreleased' is expected")
    before, after = text.split(UNRELEASED)
    end = after.find("\n## ")
    notes = (after if end < 0 else after[:end]).strip()
    if not notes:
        refuse(f"{changelog}: nothing is unreleased")
    # checked before anything is written
    for path in [manifest, *(tree / name / "Cargo.toml" for name in ("src/core", "src/c", "python"))]:
        replaced(path, rf'^version = "{re.escape(old)}"', f'version = "{version}"')
    replaced(manifest, rf'(signorini-core = \{{ path = "src/core", version = "=){re.escape(old)}"', rf'\g<1>{version}"')
    lock = tree / "Cargo.lock"
    replaced(lock, rf'(name = "signorini(?:-core|-c|-python)?"\nversion = "){re.escape(old)}"', rf'\g<1>{version}"', 4)
    citation = tree / "CITATION.cff"
    replaced(citation, r"^version: .*$", f"version: {version}")
    if "date-released:" in citation.read_text():
        replaced(citation, r"^date-released: .*$", f"date-released: {date}")
    else:
        replaced(citation, r"^(version: .*)$", rf"\g<1>\ndate-released: {date}")
    replaced(tree / ".ci/conda/recipe.yaml", r'^  version: ".*"$', f'  version: "{version}"')
    zenodo = tree / ".zenodo.json"
    deposit = json.loads(zenodo.read_text())
    deposit["version"] = version
    zenodo.write_text(json.dumps(deposit, indent=2, ensure_ascii=False) + "\n")
    changelog.write_text(f"{before}{UNRELEASED}\n## {version} - {date}\n{after}")
    folder = tree / "target/release-notes"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{version}.md").write_text(f"signorini {version}\n\n{notes}\n")
    return old


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("version")
    parser.add_argument("--tree", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent)
    parser.add_argument("--date", default=datetime.date.today().isoformat())
    parser.add_argument("--texts", action="store_true")
    given = parser.parse_args()
    run = lambda *words: subprocess.run(words, cwd=given.tree, check=True)
    if not given.texts:
        dirty = subprocess.run(["git", "status", "--porcelain"], cwd=given.tree, check=True, capture_output=True, text=True).stdout
        if dirty:
            refuse(f"not all is committed:\n{dirty}")
    old = texts(given.tree, given.version, given.date)
    print(f"{old} -> {given.version}: manifests, lock, citation, changelog; the text of the tag is in target/release-notes/{given.version}.md")
    if given.texts:
        return
    run("cargo", "metadata", "--locked", "--format-version", "1", "--no-deps", "--quiet")
    # the crates are built from each other's packages, and what cargo once unpacked of a version it does not unpack again
    home = pathlib.Path(os.environ.get("CARGO_HOME", pathlib.Path.home() / ".cargo"))
    for unpacked in home.glob(f"registry/src/*/signorini*-{given.version}"):
        shutil.rmtree(unpacked)
    run("cargo", "package", "--locked", "--allow-dirty", "-p", "signorini-core", "-p", "signorini")
    run(".ci/package", f"linux-{platform.machine()}")
    print(
        f"""
Nothing is published. When you are content (make test, .ci/run):
  git commit -am 'Version {given.version}'
  git tag -s v{given.version} -F target/release-notes/{given.version}.md
  git push origin HEAD v{given.version}      # the release workflow builds for all systems
To have the files as they were: git checkout ."""
    )


main()
