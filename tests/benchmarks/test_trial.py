import numpy as np

from benchmarks.trial import Limits, Refusal, Trial, Way, trials

LIMITS = Limits(seconds=1, gigabytes=8.0)


def sole(way: Way[float]) -> Trial[float] | Refusal:
    return trials([way], LIMITS, rounds=1)[way.name]


def endless() -> float:
    while True:
        pass


def failing() -> float:
    raise ValueError("no such order")


def large() -> float:
    return float(np.ones(2**30).sum())  # 8 GB


def test_a_trial_gives_the_time_the_memory_and_the_result() -> None:
    """64 MB: arrays of up to 32 MB may lie in memory that the process had before, which is not counted."""
    trial = sole(Way("sum", "numpy", lambda: float(np.ones(2**23).sum())))
    assert isinstance(trial, Trial)
    assert trial.result == 2.0**23
    assert 0 < trial.seconds < 1
    assert 60 < trial.megabytes < 100


def test_what_takes_too_long_is_stopped() -> None:
    assert sole(Way("endless", "numpy", endless)) == Refusal("stopped after 1 s")


def test_what_needs_too_much_memory_is_refused() -> None:
    assert sole(Way("large", "numpy", large)) == Refusal("needs more than 8 GB")


def test_a_failed_trial_gives_its_reason() -> None:
    assert sole(Way("failing", "numpy", failing)) == Refusal("ValueError: no such order")


def test_a_missing_package_is_a_refusal() -> None:
    assert sole(Way("missing", "no_such_package.at_all", failing)) == Refusal("not installed")


def test_the_trials_after_a_refusal_still_run() -> None:
    found = trials([Way("failing", "numpy", failing), Way("one", "numpy", lambda: 1.0)], LIMITS, rounds=1)
    assert list(found) == ["failing", "one"]
    assert isinstance(found["one"], Trial)
