"""Exceptions survive the way back from another process."""

import pickle

import pytest

from grazemap import errors
from grazemap.wire import Job, Problem, ProblemError

PROBLEM = Problem(
    type="urn:x",
    title="Title",
    status=422,
    detail="detail",
    errors=[ProblemError(pointer="/omega", detail="wrong", allowed="> 0")],
)
JOB = Job(id="abc", process="trajectories", request={}, status="failed", problem=PROBLEM)
CLASSES = [getattr(errors, name) for name in errors.__all__ if isinstance(getattr(errors, name), type)]


def made(cls: type[errors.GrazemapError]) -> errors.GrazemapError:
    if issubclass(cls, errors.ServiceProblem):
        return cls(PROBLEM, "request-1", 3.0)
    if issubclass(cls, errors.JobError):
        return cls("it did not end well", JOB)
    return cls("a picture", "plot") if issubclass(cls, errors.MissingExtra) else cls("a reason")


@pytest.mark.parametrize("cls", CLASSES)
def test_every_exception_survives_pickling_with_all_its_fields(cls):
    error = made(cls)
    error.add_note("while drawing")
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is cls
    assert str(again) == str(error)
    assert again.__dict__ == error.__dict__
    assert again.__notes__ == ["while drawing"]


def test_a_sentence_is_printed_once_and_an_empty_list_of_what_is_allowed_not_at_all():
    error = ProblemError(pointer="/overshoot", detail="the overshoot is too great")
    problem = PROBLEM.model_copy(update={"detail": error.detail, "errors": [error]})
    assert errors.problem_text(problem) == "Title: the overshoot is too great\n  at /overshoot"
    other = problem.model_copy(update={"detail": "Values are wrong."})
    assert errors.problem_text(other) == "Title: Values are wrong.\n  /overshoot: the overshoot is too great"
