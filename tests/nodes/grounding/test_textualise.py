from placegraph.nodes.grounding.ranking import Candidate
from placegraph.nodes.grounding.textualise import small_graph


def test_no_candidates_no_text(house):
    assert small_graph(house, []) == ""


def test_a_line_holds_id_place_other_tags_and_evidence(house):
    text = small_graph(house, [Candidate(house.nodes["O12"], 1.0, ["it is green"]), Candidate(house.nodes["O5"], 1.0)])
    assert text.splitlines() == [
        "O12: armchair (or chair) in living room, floor 1; it is green",
        "O5: cup in dining area, kitchen, floor 1",
    ]
