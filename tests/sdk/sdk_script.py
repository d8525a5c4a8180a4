"""Runs a flow on a clock that only `Sleep` moves, with outcomes from a function instead of a network."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from grazemap.client.io_effects import CloseStream, Effect, Event, Flow, LinkBroken, Now, Sleep


@dataclass
class Script:
    """`answer` gives the outcome of Send, OpenStream and NextLine effects, or an exception to be thrown."""

    answer: Callable[[Effect], Any]
    now: float = 1000.0
    slept: list[float] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    effects: list[Effect] = field(default_factory=list)

    def run(self, flow: Flow[Any]) -> Any:
        outcome: Any = None
        try:
            while True:
                effect = flow.throw(outcome) if isinstance(outcome, LinkBroken) else flow.send(outcome)
                self.effects.append(effect)
                assert len(self.effects) < 10_000, "the flow does not come to an end"
                outcome = self._perform(effect)
        except StopIteration as stop:
            return stop.value

    def _perform(self, effect: Effect) -> Any:
        match effect:
            case Event():
                self.events.append(effect)
            case Sleep():
                assert effect.seconds >= 0
                self.now += effect.seconds
                self.slept.append(effect.seconds)
            case Now():
                return self.now
            case CloseStream():
                return None
            case _:
                return self.answer(effect)
        return None
