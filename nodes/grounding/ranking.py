"""What ranking gives: candidates with evidence, and whether the evidence alone decides."""

from __future__ import annotations

from dataclasses import dataclass, field

from placegraph.runtime.scene_graph import Node

TIE = 0.03  # departs: scores that differ by less do not tell two objects apart


@dataclass
class Candidate:
    """One target with its score 0..1, its evidence, and whether every condition holds."""

    node: Node
    score: float
    evidence: list[str] = field(default_factory=list)
    holds: bool = True


@dataclass
class Ranking:
    """The candidates, best first, what else there is to say, and whether the evidence alone decides."""

    candidates: list[Candidate] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    sure: bool = True

    def tied(self) -> list[Candidate]:
        """The candidates that the evidence does not tell from the best one (that one included)."""
        return [
            candidate
            for candidate in self.candidates
            if candidate.score >= self.candidates[0].score - TIE and candidate.holds == self.candidates[0].holds
        ]

    def note(self, text: str) -> None:
        """Say something once, and that it leaves doubt."""
        self.sure = False
        if text not in self.notes:
            self.notes.append(text)
