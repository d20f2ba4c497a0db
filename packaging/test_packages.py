"""Installs the wheel, the crate and the npm package in empty folders, and runs the examples of their READMEs there.

    python packaging/test_packages.py [python] [rust] [javascript]     # all by default

The wheel must be in dist/ (`make wheel`) and the npm package in build/npm (`make wasm`). `import symspline` must not
issue a warning.
"""

import os
import re
import subprocess
import sys
import tarfile
import tempfile
import venv
from pathlib import Path

from test_wheel import ROOT, newest_wheel

ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
# The README that the installed wheel has, as a package index shows it.
SESSIONS = """
import doctest, importlib.metadata, re, sys
import symspline
text = importlib.metadata.metadata("symspline").json["description"]
session = "\\n".join(re.findall(r"^```pycon\\n(.*?)^```", text, re.M | re.S))
test = doctest.DocTestParser().get_doctest(session, {}, "README", None, 0)
result = doctest.DocTestRunner().run(test)
print(f"{result.attempted} statements of the README in {symspline.__file__}")
sys.exit(result.failed or not result.attempted)
"""


def blocks(readme: Path, language: str) -> list[str]:
    """Return the code blocks of a README."""
    found: list[str] = re.findall(rf"^```{language}\n(.*?)^```", readme.read_text("utf-8"), re.M | re.S)
    if not found:
        sys.exit(f"{readme} has no code in {language}")
    return found


def run(*command: str | Path, cwd: Path) -> None:
    """Run a command, which must succeed."""
    subprocess.run(command, cwd=cwd, env=ENVIRONMENT, check=True)


def python(folder: Path) -> None:
    """Install the wheel of dist/ and NumPy in a new environment."""
    venv.create(folder / "venv", with_pip=True)
    programs = folder / "venv" / ("Scripts" if os.name == "nt" else "bin")
    wheel = newest_wheel()
    run(
        programs / "python",
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
        wheel,
        cwd=folder,
    )
    run(programs / "python", "-W", "error", "-c", "import symspline", cwd=folder)
    run(programs / "python", "-W", "error", "-c", SESSIONS, cwd=folder)
    run(programs / "symspline", "--version", cwd=folder)


def rust(folder: Path) -> None:
    """Depend on the packaged crates in a new crate, with the lines of the README in its Cargo.toml."""
    crates = sorted(path.parent.name for path in (ROOT / "crates").glob("*/README.md"))
    names = [name if name == "symspline" else f"symspline-{name}" for name in crates]
    chosen = [argument for name in names for argument in ("-p", name)]
    run("cargo", "package", "--quiet", "--no-verify", "--allow-dirty", *chosen, cwd=ROOT)
    patches = []
    for name in names:
        (package,) = (ROOT / "target/package").glob(f"{name}-[0-9]*.crate")
        with tarfile.open(package) as archive:
            archive.extractall(folder / "crates", filter="data")
        patches.append(f'{name} = {{ path = "crates/{package.name.removesuffix(".crate")}" }}')
    readme = ROOT / "crates/symspline/README.md"
    head = '[package]\nname = "trial"\nversion = "0.1.0"\nedition = "2024"\n\n'
    manifest = [head, *blocks(readme, "toml"), "\n[patch.crates-io]\n", "\n".join(patches)]
    (folder / "Cargo.toml").write_text("".join(manifest), "utf-8")
    (folder / "src/bin").mkdir(parents=True)
    for k, block in enumerate(blocks(readme, "rust")):
        (folder / f"src/bin/readme_{k}.rs").write_text(block, "utf-8")
        # A new target folder: files in packages all have one date, by which cargo would not see that they changed.
        run("cargo", "run", "--quiet", "--target-dir", "target", "--bin", f"readme_{k}", cwd=folder)


def javascript(folder: Path) -> None:
    """Install the npm package in an empty folder and run all code of its README as one module."""
    package = ROOT / "build/npm"
    if not package.exists():
        sys.exit("no npm package in build/npm: run `make wasm` first")
    npm = "npm.cmd" if os.name == "nt" else "npm"
    run(npm, "pack", "--silent", package, cwd=folder)
    (archive,) = folder.glob("*.tgz")
    (folder / "package.json").write_text('{ "private": true, "type": "module" }')
    run(npm, "install", "--silent", "--no-audit", "--no-fund", archive, cwd=folder)
    # Later blocks declare names again.
    parts = (
        block if "import" in block else f"{{\n{block}\n}}" for block in blocks(package / "README.md", "js")
    )
    (folder / "readme.js").write_text("\n".join(parts), "utf-8")
    run("node", "readme.js", cwd=folder)


def main() -> None:
    checks = {check.__name__: check for check in (python, rust, javascript)}
    for name in sys.argv[1:] or checks:
        with tempfile.TemporaryDirectory() as folder:
            checks[name](Path(folder))
        print(f"{name}: the examples of the README run", flush=True)


if __name__ == "__main__":
    main()
