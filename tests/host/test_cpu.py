"""The processor is checked before the compiled module is imported."""

import pytest

from symspline import _cpu


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(_cpu, "_has_v3", lambda: False)
    return tmp_path


def test_an_old_processor_gets_a_clear_message(folder):
    (folder / "_core.abi3.so").write_bytes(b"..." + _cpu._MARK + b"...")
    with pytest.raises(ImportError, match=r"AVX2 and FMA.*RUSTFLAGS"):
        _cpu.check(folder)


def test_a_module_built_for_any_processor_is_let_in(folder):
    (folder / "_core.abi3.so").write_bytes(b"... symspline built for any processor ...")
    _cpu.check(folder)
