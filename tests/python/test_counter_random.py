from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy import special, stats

from ahrs_fmu import counter_random as rng
from ahrs_fmu.errors import ParameterError

ROOT = Path(__file__).resolve().parents[2]
SIZE = 200_000


@pytest.fixture(scope="module")
def normals() -> np.ndarray:
    return rng.normal_pair(7, 3, np.arange(SIZE)).ravel()


@pytest.mark.parametrize(
    ("counter", "key", "expected"),
    [
        ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
        ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
        (
            (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
            (0xA4093822, 0x299F31D0),
            (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
        ),
    ],
)
def test_the_words_are_the_known_answers_of_philox(
    counter: tuple[int, ...], key: tuple[int, int], expected: tuple[int, ...]
) -> None:
    pack = [counter[0] | counter[1] << 32, counter[2] | counter[3] << 32, key[0] | key[1] << 32]
    index, stream, seed = (np.uint64(x) for x in pack)
    assert tuple(int(w) for w in rng.words(seed, stream, index)) == expected


def test_a_draw_depends_on_its_own_index_only() -> None:
    whole = rng.normal_pair(5, np.arange(3)[:, None], np.arange(100))
    assert whole.shape == (3, 100, 2)
    np.testing.assert_array_equal(whole[2, 57], rng.normal_pair(5, 2, 57))


def test_uniform_numbers_fill_the_open_interval_evenly() -> None:
    u = rng.uniform_pair(1, 2, np.arange(SIZE)).ravel()
    assert 0.0 < u.min() < 2e-5
    assert 1.0 - 2e-5 < u.max() < 1.0
    assert stats.kstest(u, "uniform").pvalue > 0.01
    low_bits = (np.ldexp(u, 52).astype(np.uint64) & np.uint64(0xFF)).astype(int)
    assert stats.chisquare(np.bincount(low_bits, minlength=256)).pvalue > 0.01


def test_the_normal_quantile_agrees_with_an_independent_one() -> None:
    p = np.concatenate((np.linspace(1e-4, 0.49999, 20_001), 10.0 ** -np.arange(4, 16), [2.0**-53]))
    np.testing.assert_allclose(rng.normal_quantile(p), special.ndtri(p), rtol=4e-15)
    np.testing.assert_array_equal(rng.normal_quantile(1.0 - 2.0**-53), -rng.normal_quantile(2.0**-53))


def test_the_own_logarithm_is_exact_to_the_last_bits() -> None:
    x = np.concatenate((np.ldexp(1.0, -np.arange(1, 60)), np.linspace(1e-3, 0.5, 5001)))
    np.testing.assert_allclose(rng._log(x), np.log(x), rtol=5e-16)


def test_normal_numbers_have_the_moments_of_the_normal_distribution(normals: np.ndarray) -> None:
    n = normals.size
    assert abs(normals.mean()) < 3.0 / np.sqrt(n)
    assert abs(normals.var() - 1.0) < 3.0 * np.sqrt(2.0 / n)
    assert abs((normals**3).mean()) < 3.0 * np.sqrt(15.0 / n)
    assert abs((normals**4).mean() - 3.0) < 3.0 * np.sqrt(96.0 / n)


def test_normal_numbers_pass_kolmogorov_smirnov(normals: np.ndarray) -> None:
    assert stats.kstest(normals, "norm").pvalue > 0.01


@pytest.mark.parametrize("limit", [2.0, 3.0, 4.0])
def test_the_tails_hold_as_many_numbers_as_they_should(normals: np.ndarray, limit: float) -> None:
    expected = normals.size * 2.0 * stats.norm.sf(limit)
    count = int(np.count_nonzero(np.abs(normals) > limit))
    assert abs(count - expected) < 3.0 * np.sqrt(expected)


def test_neighbouring_samples_streams_seeds_and_pairs_are_uncorrelated() -> None:
    index = np.arange(SIZE)
    base = rng.normal_pair(7, 3, index)
    others = {
        "next sample": rng.normal_pair(7, 3, index + 1)[:, 0],
        "next stream": rng.normal_pair(7, 4, index)[:, 0],
        "next seed": rng.normal_pair(8, 3, index)[:, 0],
        "other of the pair": base[:, 1],
        "stream and index exchanged": rng.normal_pair(7, index, 3)[:, 0],
    }
    for name, other in others.items():
        for transform in (lambda x: x, np.square):
            a, b = transform(base[:, 0]), transform(other)
            assert abs(np.corrcoef(a, b)[0, 1]) < 3.5 / np.sqrt(SIZE), name


@pytest.mark.parametrize("bad", [-1, 0.5, np.array([1, -2])])
def test_seeds_that_are_no_unsigned_integers_are_refused(bad: object) -> None:
    with pytest.raises(ParameterError, match="seed"):
        rng.words(bad, 0, 0)  # type: ignore[arg-type]


def _compiler() -> list[str]:
    if shutil.which("gcc"):
        return ["gcc"]
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    pytest.skip("no C compiler: install gcc or the ziglang package")


_PROGRAM = r"""
#include <stdio.h>
#include "random.h"
int main(void) {
    for (uint64_t stream = 0; stream < 4; ++stream) {
        for (uint64_t index = 0; index < 5000; ++index) {
            double pair[2];
            ahrs_random_uniform_pair(UINT64_C(0xFEDCBA9876543210), stream, index, pair);
            printf("%a %a ", pair[0], pair[1]);
            ahrs_random_normal_pair(UINT64_C(0xFEDCBA9876543210), stream, index, pair);
            printf("%a %a\n", pair[0], pair[1]);
        }
    }
    for (int e = 1; e <= 53; ++e) {
        double p = 1.0;
        for (int i = 0; i < e; ++i) p *= 0.5;
        const double q = ahrs_random_normal_quantile(p), r = ahrs_random_normal_quantile(1.0 - p);
        printf("%a %a %a %a\n", p, 1.0 - p, q, r);
    }
    return 0;
}
"""


def test_the_c_twin_gives_the_same_bits(tmp_path: Path) -> None:
    source, program = tmp_path / "twin.c", tmp_path / "twin"
    source.write_text(_PROGRAM)
    flags = "-std=c99 -O2 -ffp-contract=off -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Werror"
    command = [
        *_compiler(),
        *flags.split(),
        f"-I{ROOT / 'fmu_src' / 'core'}",
        str(source),
        "-o",
        str(program),
    ]
    subprocess.run([*command, "-lm"], check=True)
    printed = subprocess.run([program], check=True, capture_output=True, text=True).stdout
    c = np.array([[float.fromhex(word) for word in line.split()] for line in printed.splitlines()])
    stream, index = np.arange(4)[:, None], np.arange(5000)
    seed = np.uint64(0xFEDCBA9876543210)
    draws = np.concatenate((rng.uniform_pair(seed, stream, index), rng.normal_pair(seed, stream, index)), -1)
    np.testing.assert_array_equal(c[:20_000], draws.reshape(-1, 4))
    np.testing.assert_array_equal(c[20_000:, 2:], rng.normal_quantile(c[20_000:, :2]))
