import json


def test_a_batch(cli, mapped, tmp_path) -> None:
    questions, out = tmp_path / "q.jsonl", tmp_path / "a.jsonl"
    questions.write_text('{"id": 1, "text": "the refrigerator"}\n{"id": 2, "text": "the piano"}\n{"id": 3}\n')
    done = cli("ask-batch", questions, "--graph", mapped, "--out", out, "--mode", "rules", "--k", 1)
    assert (done.code, done.err) == (0, "")
    assert done.out.startswith("3 questions: 1 found, 1 not in the map, 1 errors; ")
    answers = [json.loads(line) for line in out.read_text().splitlines()]
    assert [answer["question_id"] for answer in answers] == [1, 2, 3]
    single = json.loads(cli("ask", mapped, "the refrigerator", "--json", "--mode", "rules").out)
    assert (answers[0]["object_id"], answers[0]["evidence"]) == (single["object_id"], single["evidence"])
    assert answers[2]["error"].startswith("line 3: text: expected words")


def test_a_batch_that_cannot_begin(cli, mapped, tmp_path) -> None:
    (tmp_path / "q.jsonl").write_text('{"id": 1, "text": "the refrigerator"}\n')
    batch = (tmp_path / "q.jsonl", "--out", tmp_path / "a.jsonl")
    for arguments, reason in (
        ((*batch, "--graph", tmp_path / "no"), "no: no graph.json here"),
        ((*batch, "--graph", mapped, "--k", 0), "k: expected a whole number"),
        ((*batch, "--graph", mapped, "--mode", "model"), "mode: expected one of"),
        ((tmp_path / "no", *batch[1:], "--graph", mapped), "no: cannot read: No such file"),
    ):
        done = cli("ask-batch", *arguments)
        assert done.code == 1 and reason in done.reason
    for arguments in ((), batch[:1], (*batch, "more")):
        assert cli("ask-batch", *arguments).code == 2
    assert not (tmp_path / "a.jsonl").exists()
