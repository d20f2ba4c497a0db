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
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))


def build(folder: Path, target: Path, flags: str | None) -> Path:
    """A wheel in ``folder`` by maturin, with these flags of the compiler."""
    environment = {name: value for name, value in os.environ.items() if name != "RUSTFLAGS"}
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
        env=environment | ({"RUSTFLAGS": flags} if flags else {}),
        check=True,
    )
    (wheel,) = folder.glob("*.whl")
    return wheel


def join(plain: Path, others: dict[str, Path], out: Path) -> Path:
    """Write the wheel ``plain`` with the compiled modules of other wheels, which are for these levels."""
    modules = []
    for level, wheel in others.items():
        with zipfile.ZipFile(wheel) as archive:
            (name,) = [
                n for n in archive.namelist() if n.startswith("symspline/_core.") and not n.endswith(".pyi")
            ]
            info, module = archive.getinfo(name), archive.read(name)
        info.filename = name.replace("_core", f"_core_{level}", 1)
        modules.append((info, module))
    made = out / plain.name
    with zipfile.ZipFile(plain) as source, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as wheel:
        for entry in source.infolist():
            content = source.read(entry)
            if entry.filename.endswith(".dist-info/RECORD"):
                # The folder .dist-info comes last, as the format recommends.
                for info, module in modules:
                    wheel.writestr(info, module)
                    digest = base64.urlsafe_b64encode(hashlib.sha256(module).digest()).rstrip(b"=").decode()
                    content += f"{info.filename},sha256={digest},{len(module)}\n".encode()
            wheel.writestr(entry, content)
    return made


def main() -> None:
    out = ROOT / "dist"
    out.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        if platform.machine().lower() not in ("x86_64", "amd64"):
            print(shutil.copy(build(Path(temporary), TARGET, None), out))
            return
        plain, *others = (
            build(Path(temporary) / level, TARGET / level, f"-C target-cpu={cpu}")
            for level, cpu in (("plain", "x86-64"), ("v3", "x86-64-v3"), ("v4", "x86-64-v4"))
        )
        print(join(plain, dict(zip(("v3", "v4"), others, strict=True)), out))


if __name__ == "__main__":
    main()
