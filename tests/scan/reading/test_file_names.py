"""Numbers, signs, dates and times in the names of files."""

from __future__ import annotations

import pytest

from viewer.scan.reading.names import (
    are_dates,
    frame_counts,
    has_signs,
    in_order,
    numbered_name,
    small_stamps,
    stamped_seconds,
)
from viewer.scan.times import natural_key


@pytest.mark.parametrize(
    "names",
    [
        ["f-2.ply", "f-1.ply", "f0.ply", "f1.ply", "f10.ply"],
        ["-1.ply", "0.ply", "1.ply"],
        ["scan-1.ply", "scan-2.ply", "scan-10.ply"],
        ["t-1.ply", "t+0.ply", "t+1.ply"],
        ["01.05.2024.ply", "15.05.2024.ply", "02.07.2024.ply"],
        ["05-01-2024.ply", "05-31-2024.ply", "06-02-2024.ply"],
        ["0.04.ply", "0.2.ply", "1.5.ply"],
        ["a0.05.ply", "a0.125.ply", "a0.2.ply"],
        ["v1.2.ply", "v1.9.ply", "v1.10.ply"],  # versions
        ["take1_9.ply", "take1_10.ply", "take2_1.ply"],
    ],
)
def test_names_are_in_the_order_of_a_person(names: list[str]) -> None:
    assert in_order(names[::-1]) == names


def test_natural_order() -> None:
    names = ["f10.ply", "F2.ply", "f1.ply", "f01.ply", "f2b.ply", "10.ply", "9.ply", "a.ply"]
    in_order = ["9.ply", "10.ply", "a.ply", "f01.ply", "f1.ply", "F2.ply", "f2b.ply", "f10.ply"]
    assert sorted(names, key=natural_key) == in_order
    assert sorted(reversed(names), key=natural_key) == in_order


@pytest.mark.parametrize(
    ("names", "signed"),
    [
        (["f-1.ply", "f0.ply"], True),
        (["f-1.ply", "f-2.ply"], False),
        (["2024-05-01.ply", "2024-05-02.ply"], False),
        (["a-1.ply", "b1.ply"], False),
    ],
)
def test_a_minus_is_a_sign_where_another_name_lacks_it(names: list[str], signed: bool) -> None:
    assert has_signs(names) == signed


def test_a_name_is_split_at_its_last_number() -> None:
    assert numbered_name("take1_frame007.ply") == ("take1_frame", "007", ".ply")
    assert numbered_name("f-2.ply") == ("f-", "2", ".ply")
    assert numbered_name("f-2.ply", signed=True) == ("f", "-2", ".ply")
    assert numbered_name("f12_cam1.ply") == ("f", "12", "_cam1.ply")
    assert numbered_name("cam1_f12.ply") == ("cam1_f", "12", ".ply")
    assert numbered_name("reference.ply") is None


@pytest.mark.parametrize(
    ("names", "numbers"),
    [
        (["00001.ply", "00002.ply", "00006.ply"], [1, 2, 6]),
        (["f-2.ply", "f-1.ply", "f0.ply"], [-2, -1, 0]),
        (["hand2_f8_v3.ply", "hand2_f10_v3.ply"], [8, 10]),
        (["20240501.ply", "20240502.ply"], None),  # days
        (["20249901.ply", "20249902.ply"], [20249901, 20249902]),  # no days
        (["only.ply"], None),
        (["left_1.ply", "right_2.ply"], None),
        (["1_17.ply", "2_34.ply"], None),  # a frame number and a clock: which is which?
        (["1623412345123456.ply", "1623412345156789.ply"], None),  # a clock
        (["1.ply", "01.ply"], None),
        (["1.ply", "1b2.ply"], None),
    ],
)
def test_frame_numbers(names: list[str], numbers: list[int] | None) -> None:
    assert frame_counts(names) == numbers


@pytest.mark.parametrize(
    ("names", "dates"),
    [
        (["20240501.ply", "20240702.ply"], True),
        (["scan_2024-05-31.ply", "scan_2024-06-01.ply"], True),
        (["2024-05-01.ply", "2024-05-02.ply"], True),
        (["2024-05-01_1.ply", "2024-05-01_2.ply"], False),
        (["00000001.ply", "00000002.ply"], False),
        (["01.05.2024.ply", "15.05.2024.ply", "02.07.2024.ply"], True),
        (["05-01-2024.ply", "05-31-2024.ply"], True),
        (["2024-05.ply", "2024-06.ply"], True),
        (["240501.ply", "240601.ply"], True),
        (["240501.ply", "240502.ply"], False),  # may be frame numbers
        (["2024-05-01.ply"], False),
    ],
)
def test_dates(names: list[str], dates: bool) -> None:
    assert are_dates(names) == dates


@pytest.mark.parametrize(
    ("names", "seconds"),
    [
        (["1716383012345678.ply", "1716383012378678.ply"], [0, 0.033]),  # microseconds since 1970
        (["1716383012345.ply", "1716383012378.ply"], [0, 0.033]),
        (["1716383012345678000.ply", "1716383012378678000.ply"], [0, 0.033]),
        (["1716383012.ply", "1716383014.ply"], [0, 2]),
        (["1305031102.175304.png", "1305031102.211214.png"], [0, 0.03591]),
        (["0.040.ply", "0.080.ply", "0.200.ply"], [0, 0.04, 0.16]),
        (["a_0.5.ply", "a_0.75.ply"], [0, 0.25]),
        (["12-30-01.ply", "12-30-02.ply", "12-31-04.ply"], [0, 1, 63]),
        (["12_30_59.ply", "12_31_02.ply"], [0, 3]),
        (["20240501_123001.ply", "20240501_123003.ply"], [0, 2]),
        (["2024-05-01_23-59-59.ply", "2024-05-02_00-00-01.ply"], [0, 2]),
        (["2024-05-01T12-30-01.250.ply", "2024-05-01T12-30-01.750.ply"], [0, 0.5]),
        (["a_1.ply", "a_2.ply"], None),
        (["0000000000.pcd", "0000000001.pcd"], None),
        (["1_02_03.ply", "1_02_04.ply"], None),
        (["01_02_03.ply", "01_02_04.ply"], None),  # subject, session, frame
        (["take1.01.ply", "take1.02.ply"], None),
        (["shot1.0001.ply", "shot1.0011.ply"], None),  # a tenth of a millisecond is no step
        (["20240501.ply", "20240601.ply"], None),
        (["12-30-61.ply", "12-30-62.ply"], None),
        (["20240501123001.ply", "20240501123003.ply"], [0, 2]),
        (["20240501123001040.ply", "20240501123001120.ply"], [0, 0.08]),
        (["1716383012_345678000.ply", "1716383013_012001000.ply"], [0, 0.666323]),
        (["0001_1716383012345.ply", "0002_1716383012378.ply", "0003_1716383012512.ply"], [0, 0.033, 0.167]),
        (["f_0ms.ply", "f_40ms.ply", "f_120ms.ply"], [0, 0.04, 0.12]),
        (["t0us.ply", "t40000us.ply"], [0, 0.04]),
        (["t0s.ply", "t1.5s.ply"], [0, 1.5]),
        (["0,00.ply", "0,04.ply", "0,12.ply"], [0, 0.04, 0.12]),
        (["t0p00.ply", "t0p04.ply", "t0p12.ply"], [0, 0.04, 0.12]),
        (["12h30m01s.ply", "12h31m02s.ply"], [0, 61]),
        (["00m59s.ply", "01m02s.ply"], [0, 3]),
        (["f1_steps.ply", "f2_steps.ply"], None),
        (["2024-05-01_12-30-01_001.ply", "2024-05-01_12-30-01_002.ply"], None),  # frames of one second
        (["01.05.2024.ply", "15.05.2024.ply", "02.07.2024.ply"], None),
        (["a_9.5.ply", "a_0.75.ply"], None),
        (["1716383012345678.ply"], None),
        ([], None),
    ],
)
def test_times_in_names(names: list[str], seconds: list[float] | None) -> None:
    found = stamped_seconds(names)
    assert found == (None if seconds is None else pytest.approx(seconds, abs=1e-6))


@pytest.mark.parametrize(
    ("names", "seconds"),
    [
        (["10.ply", "50.ply", "90.ply"], [0, 0.04, 0.08]),
        (["500000.ply", "533000.ply"], [0, 0.033]),
        (["a_1.ply", "a_2.ply"], None),
        (["20240501.ply", "20240601.ply"], None),
        (["a.ply", "b.ply"], None),
    ],
)
def test_numbers_that_may_be_times(names: list[str], seconds: list[float] | None) -> None:
    found = small_stamps(names)
    assert found == (None if seconds is None else pytest.approx(seconds, abs=1e-6))
