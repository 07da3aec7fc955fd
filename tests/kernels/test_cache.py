"""Where compiled code is kept, and what Python may call."""

import shutil
from pathlib import Path

import pytest

from fastncm.kernels import cache


def test_an_edit_of_any_compiled_source_starts_a_new_cache(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "fastncm"
    for folder in cache.COMPILED_FOLDERS:
        ignore = shutil.ignore_patterns("__pycache__")
        shutil.copytree(cache._PACKAGE / folder, package / folder, ignore=ignore)
    before = cache.source_hash()
    monkeypatch.setattr(cache, "_PACKAGE", package)
    assert cache.source_hash() == before
    files = sorted(package.rglob("*.py"))
    assert any("numba" in file.read_text() for file in files)
    for file in files:
        text = file.read_text()
        file.write_text(text + "#\n")
        assert cache.source_hash() != before
        file.write_text(text)
    assert cache.source_hash() == before


def test_every_file_with_compiled_code_is_in_a_hashed_folder() -> None:
    for file in cache._PACKAGE.rglob("*.py"):
        folder = file.relative_to(cache._PACKAGE).parts[0]
        if folder not in cache.COMPILED_FOLDERS:
            assert "kernels.cache import driver" not in file.read_text(), file
            assert "kernels.cache import inner" not in file.read_text(), file
            assert "kernels.cache import kernel" not in file.read_text(), file


@pytest.mark.compiled
def test_functions_without_a_wrapper_refuse_python() -> None:
    @cache.inner
    def double(x):
        return 2.0 * x

    @cache.kernel
    def call(x):
        return double(x)

    assert call(1.5) == 3.0
    for _ in range(2):
        with pytest.raises(TypeError):
            double(1.5)
