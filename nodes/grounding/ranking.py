"""The result of executing a program: ranked candidates with evidence, notes, and whether the evidence decides."""

from __future__ import annotations

from dataclasses import dataclass, field

from placegraph.runtime.scene_graph import GraphNode


@dataclass
class Candidate:
    """One candidate with its score 0..1, its evidence sentences, and whether every condition holds."""

    node: GraphNode
    score: float
    evidence: list[str] = field(default_factory=list)
    holds: bool = True


@dataclass
class Ranking:
    """The candidates, best first; notes on what could not be followed; sure: the evidence alone decides."""

    candidates: list[Candidate] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    sure: bool = True

    def tied(self, max_difference: float) -> list[Candidate]:
        """The best candidate and those that the evidence cannot tell from it: with scores within max_difference."""
        return [
            candidate
            for candidate in self.candidates
            if candidate.score >= self.candidates[0].score - max_difference
            and candidate.holds == self.candidates[0].holds
        ]

    def note(self, text: str) -> None:
        """Add a note once; the answer is not sure any more."""
        self.sure = False
        if text not in self.notes:
            self.notes.append(text)
