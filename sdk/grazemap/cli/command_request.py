"""The request of a command, from --json and from flags, which take precedence. Its errors name fields and flags."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from copy import deepcopy
from typing import Any

from grazemap import units
from grazemap.cli.flags import Flag, flags_of, flags_of_short_forms, value_at
from grazemap.errors import ParameterError, RequestWarning
from grazemap.wire import PROCESSES, ProblemError, ProcessRequest
from grazemap.wire.error_texts import written_schema
from grazemap.wire.problems import parameter_error

_MAX_VALUE_LENGTH = 60
# By the code of a note: the parameter that it concerns, and the unit that was probably meant.
_SUSPECTED_UNITS = {"frequencies-in-hertz": ("omega", "Hz"), "clearances-in-millimetres": ("clearance", "mm")}


class CommandRequest:
    """The request of a process, as a command line gives it.

    Parameters
    ----------
    process : str
    fields : mapping
        The fields of --json.
    texts : mapping
        The text of each flag on the command line, by the place of its field in the request; true or false for a switch.
    errors : sequence of ProblemError
        What is wrong with the flags themselves.
    """

    def __init__(
        self,
        process: str,
        fields: Mapping[str, Any],
        texts: Mapping[tuple[str, ...], str | bool],
        errors: Sequence[ProblemError] = (),
    ) -> None:
        self._flags = flags_of(process)
        self._used = [flag for flag in self._flags if flag.place in texts]
        # a flag of a short form replaces an axis that --json may have, and a flag of an axis a short form
        with suppress(LookupError, TypeError, ValueError, AttributeError):  # the validation says what is wrong
            if any(flag in self._used for flag in flags_of_short_forms(process)):
                fields = PROCESSES[process].short_form(fields)
            elif any(len(flag.place) > 1 and flag.field == "vary" for flag in self._used):
                fields, _ = PROCESSES[process].long_form(fields)
        self._process, self._fields, self._texts = process, fields, texts
        self._body: dict[str, Any] = deepcopy(dict(fields))
        self._errors = [*errors]
        self._shown = units.Shown()
        units.in_si(fields, "SI", [], shown=self._shown)
        for flag in self._used:
            self._set(flag, texts[flag.place])

    @property
    def shown_units(self) -> tuple[str, ...]:
        """The units in which the result is shown."""
        return self._shown.units

    def validated(self) -> ProcessRequest:
        """Return the request. Raises ParameterError with all errors."""
        errors = list(self._errors)
        try:
            request = PROCESSES[self._process].checked(self._body)
        except ParameterError as error:
            errors += error.problem.errors
        if errors:
            raise parameter_error(errors)
        return request

    @contextmanager
    def naming_flags(self) -> Iterator[None]:
        """Within this block notes and the errors of a ParameterError name flags with their values and allowed forms."""
        show = warnings.showwarning

        def show_note(message: Warning | str, *rest: Any, **keywords: Any) -> None:
            show(self._note(message) if isinstance(message, RequestWarning) else message, *rest, **keywords)

        warnings.showwarning = show_note
        try:
            yield
        except ParameterError as error:
            errors = [self._error_with_flags(entry) for entry in error.problem.errors]
            raise ParameterError(error.problem.model_copy(update={"errors": errors}), error.request_id) from error
        finally:
            warnings.showwarning = show

    def _set(self, flag: Flag, text: str | bool) -> None:
        value = flag.value(self._si_text(flag, text)) if isinstance(text, str) else text
        if flag.ambiguous and isinstance(value, list) and len(value) == 3 and isinstance(value[2], int):
            start, stop, points = str(text).split(",")
            detail = (
                "Three numbers with a whole one at the end may be a list, or a start, a stop and a number of points"
            )
            allowed = f"{start}:{stop}:{points} for the range, {start},{stop},{points}.0 for the list"
            self._refuse(flag, detail, allowed)
        inside = self._body
        for depth, part in enumerate(flag.place[:-1], 1):
            if inside.get(part) is None:
                inside[part] = {}
            inside = inside[part]
            if not isinstance(inside, dict):
                whole = next((used.name for used in self._used if used.place == flag.place[:depth]), None)
                if whole:
                    self._refuse(flag, f"{whole} gives the whole, of which this is a part", "one of the two flags")
                else:
                    self._refuse(flag, f"{part} in --json is not an object, and this is a field of it", "an object")
                return
        inside[flag.place[-1]] = value

    def _si_text(self, flag: Flag, text: str) -> str:
        """Return the text of a flag with its numbers in rad/s or m."""
        law = self._effective_value((*flag.place[:-1], "law"))
        name = units.quantity_of(self._quantity_of(flag), law=law, several="," in text)
        if name not in units.FIELD_UNITS:
            return text
        if refused := units.refusal(text, name, self._effective_value(("oscillator", "units"))):
            self._refuse(flag, *refused)
            return units.text_without_units(text)
        self._shown.write(name, units.units_in(text))
        return units.si_text(text, name)

    def _quantity_of(self, flag: Flag) -> str:
        """Return the field whose quantity the numbers of a flag are: for a range, the field that `vary` names."""
        *parents, name = flag.place
        if name not in units.OF_WHAT_VARIES:
            return flag.field
        quantities = (self._effective_value((*parents, field)) for field in ("quantity", "vary"))
        return str(next(filter(None, quantities), "")).partition("[")[0]

    def _effective_value(self, place: tuple[str, ...]) -> Any:
        """Return the value at a place: that of its flag, else of --json, else the default of the request."""
        if place in self._texts:
            return self._texts[place]
        value = value_at(self._fields, place)
        schema = written_schema(PROCESSES[self._process])
        return value_at(schema, ("properties", *place, "default")) if value is None else value

    def _refuse(self, flag: Flag, detail: str, allowed: str) -> None:
        self._errors.append(ProblemError(pointer=flag.pointer, detail=detail, allowed=allowed))

    def _note(self, warning: RequestWarning) -> str:
        """Return the text of a note; where a flag causes the note, with what to write instead of the flag."""
        detail = str(warning)
        name, unit = _SUSPECTED_UNITS.get(warning.code, (detail.partition(" ")[0], ""))
        of_request = (flag for flag in self._used if len(flag.place) == 1)
        flag = next((flag for flag in of_request if self._quantity_of(flag) == name), None)
        if flag is None:
            return detail
        text = str(self._texts[flag.place])
        if unit and units.text_without_units(text) == text:
            instead = f"{flag.name} {units.text_with_unit(text, unit)}"
            return f"{detail.rpartition(':')[0]}: write {instead} if {unit} was meant"
        if warning.code == "two-values":
            return f"{flag.name} {text} is a list of two values; for a range write {text.replace(',', ':')}:POINTS"
        return detail

    def _error_with_flags(self, error: ProblemError) -> ProblemError:
        """Return an error whose pointer is replaced by the flags concerned, or followed by the value in --json."""
        if not error.pointer.startswith("/"):
            return error
        place = tuple(error.pointer[1:].split("/"))
        enclosing = [flag for flag in self._used if place[: len(flag.place)] == flag.place]
        value = value_at(self._fields, place)
        if value is not None and not enclosing:
            return error.model_copy(update={"pointer": f"{error.pointer}{_shown(value)}"})
        contained = [flag for flag in self._flags if flag.place[: len(place)] == place]
        concerned = enclosing or [flag for flag in contained if flag in self._used] or contained
        if not concerned:
            return error
        location = ", ".join(self._flag_text(flag) for flag in concerned)
        inside = [f"number {int(part) + 1}" if part.isdigit() else part for part in place[len(concerned[0].place) :]]
        written = " or ".join(form for flag in concerned for form in flag.forms) if len(concerned) == 1 else ""
        top = concerned[0].place
        parts = [flag.name for flag in self._flags if flag.place[:-1] == top]
        written += f", or with {', '.join(parts)}" if written and parts else ""
        allowed = "; written ".join(filter(None, (error.allowed, written)))
        return error.model_copy(update={"pointer": ": ".join((location, *inside)), "allowed": allowed})

    def _flag_text(self, flag: Flag) -> str:
        text = self._texts.get(flag.place)
        return f"{flag.name} {text}" if isinstance(text, str) else flag.name


def _shown(value: Any) -> str:
    text = json.dumps(value)
    return f" {text}" if len(text) <= _MAX_VALUE_LENGTH else ""
