"""Time and memory are those of the block, not of what came before it."""

import math
import subprocess
import sys
import time

import pytest

from PolyPoseLib.benchmark.measures import Measures, measured


def test_processor_time_is_counted_with_that_of_processes_that_were_waited_for():
    spin = "import time\nwhile time.process_time() < 0.3: pass"
    with measured() as found:
        time.sleep(0.2)
        subprocess.run([sys.executable, "-S", "-c", spin], check=True)
    assert 0.3 <= found.cpu_seconds < 1.0 and found.seconds >= 0.4


def test_a_block_that_sleeps_takes_no_processor_time_and_one_that_raises_is_measured():
    assert math.isnan(Measures().seconds)
    with pytest.raises(ZeroDivisionError), measured() as found:
        time.sleep(0.1)
        _ = 1 / 0
    assert found.seconds >= 0.1 and 0 <= found.cpu_seconds < 0.1


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux forgets an earlier peak")
def test_memory_that_was_given_back_before_the_block_is_not_its_own():
    """In a process of its own: one that has run many tests has free memory in hand."""
    code = """if True:
        from PolyPoseLib.benchmark.measures import measured

        def touched(mib):
            block = bytearray(mib << 20)
            block[::4096] = b"x" * len(block[::4096])

        with measured() as rest:
            pass
        touched(400)
        with measured() as small:
            touched(50)
        with measured() as large:
            touched(400)
        print(*(each.peak_memory_mib - rest.peak_memory_mib for each in (small, large)))
    """
    ran = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    small, large = map(float, ran.stdout.split())
    assert 30 < small < 150
    assert 350 < large < 500
