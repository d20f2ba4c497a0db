"""Builds one wheel that suits every processor of this machine's architecture, into dist/.

On x86-64 it holds three compiled modules, of which `symspline/_cpu.py` picks one at import: `_core` for any processor,
`_core_v3` for those with AVX2 and FMA, and `_core_v4` for those with AVX-512. They are three builds, each with its own
target folder, joined afterwards: nothing is put into the checkout, where a second module would be loaded in place of
the one under development.
"""

import base64
import hashlib
import os
import platform
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))


def without_paths() -> list[str]:
    """Return flags that keep folders of this machine out of the compiled module, where messages name source files."""
    cargo = Path(os.environ.get("CARGO_HOME", Path.home() / ".cargo"))
    return [f"--remap-path-prefix={cargo / 'registry' / 'src'}=crates", f"--remap-path-prefix={ROOT}=."]


def build(folder: Path, target: Path, flags: list[str]) -> Path:
    """A wheel in ``folder`` by maturin, with these flags of the compiler."""
    environment = {name: value for name, value in os.environ.items() if name != "RUSTFLAGS"}
    # With this separator, flags may contain spaces, as folders do.
    environment["CARGO_ENCODED_RUSTFLAGS"] = "\x1f".join([*flags, *without_paths()])
    # Flags for a named target are not those of build scripts, which this processor must be able to run.
    version = subprocess.run(["rustc", "-vV"], capture_output=True, encoding="utf-8", check=True).stdout
    host = next(line.removeprefix("host: ") for line in version.splitlines() if line.startswith("host: "))
    command = [
        sys.executable,
        "-m",
        "maturin",
        "build",
        "--release",
        "--locked",
        "--interpreter",
        sys.executable,
        "--target",
        host,
    ]
    subprocess.run(
        [*command, "--target-dir", str(target), "--out", str(folder)],
        cwd=ROOT,
        env=environment,
        check=True,
    )
    (wheel,) = folder.glob("*.whl")
    return wheel


def join(plain: Path, others: dict[str, Path], out: Path) -> Path:
    """Write the wheel ``plain`` with the compiled modules of other wheels, which are for these levels."""
    entries, metadata = [], []
    with zipfile.ZipFile(plain) as source:
        for info in source.infolist():
            # The folder .dist-info comes last, as the format recommends.
            where = metadata if ".dist-info/" in info.filename else entries
            # The list of crates names their folders on this machine.
            where.append((info, source.read(info).replace(ROOT.as_uri().encode(), b"file:///symspline")))
    for level, wheel in others.items():
        with zipfile.ZipFile(wheel) as archive:
            (name,) = [
                n for n in archive.namelist() if n.startswith("symspline/_core.") and not n.endswith(".pyi")
            ]
            info, module = archive.getinfo(name), archive.read(name)
        info.filename = name.replace("_core", f"_core_{level}", 1)
        entries.append((info, module))
    made = out / plain.name
    lines = []
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as wheel:
        for info, content in [*entries, *metadata]:
            if info.filename.endswith(".dist-info/RECORD"):
                record = info
                continue
            wheel.writestr(info, content)
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            lines.append(f"{info.filename},sha256={digest},{len(content)}\n")
        wheel.writestr(record, "".join([*lines, f"{record.filename},,\n"]))
    return made


def main() -> None:
    out = ROOT / "dist"
    out.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        if platform.machine().lower() not in ("x86_64", "amd64"):
            print(join(build(Path(temporary), TARGET, []), {}, out))
            return
        plain, *others = (
            build(Path(temporary) / level, TARGET / level, [f"-Ctarget-cpu={cpu}"])
            for level, cpu in (("plain", "x86-64"), ("v3", "x86-64-v3"), ("v4", "x86-64-v4"))
        )
        print(join(plain, dict(zip(("v3", "v4"), others, strict=True)), out))


if __name__ == "__main__":
    main()
