"""Terms that a scene does not mention cost no instructions: valgrind counts those of an objective, its
gradient and its Hessian action on the same springs without prisms, with prisms and no volume term,
and with one."""

import os
import re
import shutil

import pytest

from conftest import finish, programs

pytestmark = pytest.mark.quick


@pytest.fixture(scope="module")
def instructions(tmp_path_factory, environment):
    """count(case): instructions of evaluate_often() in a case of tests/unit/mechanics."""
    if not shutil.which("valgrind"):
        pytest.skip("no valgrind: apt-get install valgrind")
    if "ASAN_OPTIONS" in os.environ:
        pytest.skip("valgrind runs no program that has the address sanitizer")
    folder = tmp_path_factory.mktemp("callgrind")

    def count(case):
        done = finish(["valgrind", "--tool=callgrind", "--callgrind-out-file=out",
                       "--toggle-collect=repose::mechanics::evaluate_often*",
                       str(programs() / "test_mechanics"), f"--gtest_filter=UnusedTerms.{case}"],
                      folder, environment, 300)
        assert done.returncode == 0 and "[  PASSED  ] 1 test" in done.stdout, done.stderr
        return int(re.search(r"Collected : (\d+)", done.stderr)[1])

    return count


@pytest.mark.long
def test_prisms_without_a_volume_term_cost_nothing(instructions):
    alone = instructions("NoPrisms")
    assert alone > 1e6
    assert abs(instructions("PrismsWithoutVolumeTerm") / alone - 1) < 0.01
    assert instructions("PrismsWithVolumeTerm") > 1.2 * alone
