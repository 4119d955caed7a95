"""The size of the first-level cache, as Linux's folders tell it."""

import pytest

from hpcclear.base.cache import USUAL, first_level_cache


def write(folder, *indices):
    for k, words in enumerate(indices):
        index = folder / f"index{k}"
        index.mkdir()
        for name, word in zip(("level", "type", "size"), words, strict=False):
            (index / name).write_text(f"{word}\n")


def test_the_data_s_part_of_the_first_level_is_found(tmp_path):
    write(tmp_path, ("1", "Instruction", "64K"), ("2", "Unified", "1024K"), ("1", "Data", "48K"))
    assert first_level_cache(tmp_path) == 48 * 1024


@pytest.mark.parametrize(
    "indices", [(), (("1", "Data"),), (("1", "Data", "32 KB"),), (("2", "Unified", "1024K"),)]
)
def test_without_a_word_it_is_the_usual_one(tmp_path, indices):
    write(tmp_path, *indices)
    assert first_level_cache(tmp_path) == USUAL


def test_this_processor_has_one():
    assert 4 * 1024 <= first_level_cache() <= 1024 * 1024
