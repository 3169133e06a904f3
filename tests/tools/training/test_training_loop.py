"""The training loop on a network of a few weights: stopping, going on, and the average."""

from __future__ import annotations

import copy

import pytest

torch = pytest.importorskip("torch", reason="training needs the extra `train`")

from placegraph.runtime.errors import ConfigError  # noqa: E402
from placegraph.tools.training.training_loop import fit, read_average  # noqa: E402

torch.set_num_threads(1)


class Stopped(Exception):
    """The machine was switched off."""


def make_network():
    torch.manual_seed(3)
    return torch.nn.Sequential(torch.nn.Linear(4, 8), torch.nn.BatchNorm1d(8), torch.nn.ReLU(), torch.nn.Linear(8, 1))


def make_step(network, seen, stop_at=None):
    """Losses of step i from data of that step alone; `seen` collects the steps done."""

    def step(i):
        if i == stop_at:
            raise Stopped
        seen.append(i)
        x = torch.randn(16, 4, generator=torch.Generator().manual_seed(i))
        error = network(x)[:, 0] - x.sum(1)
        return {"square": (error**2).mean(), "absolute": error.abs().mean() * 0.1}

    return step


def run(network, checkpoint, steps=10, stop_at=None, save_every=250):
    seen = []
    settings = {"steps": steps, "rate": 0.02, "checkpoint": checkpoint, "warm_up": 3, "save_every": save_every}
    try:
        return fit(network, make_step(network, seen, stop_at), **settings), seen
    except Stopped:
        return None, seen


def assert_equal(a, b):
    for name, value in a.state_dict().items():
        torch.testing.assert_close(b.state_dict()[name], value, atol=0, rtol=0)


def test_training_lowers_the_loss_and_says_how_far_it_is(tmp_path, capsys):
    network = make_network()
    before = float(make_step(network, [])(999)["square"].detach())
    average, seen = run(network, tmp_path / "net.pt", steps=100)
    assert seen == list(range(100))
    assert float(make_step(network, [])(999)["square"].detach()) < 0.5 * before
    assert not average.training and network.training
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in lines] == ["step 50 of 100", "step 100 of 100"]
    assert "square" in lines[0] and "absolute" in lines[0]


def test_stopped_and_gone_on_equals_straight_through(tmp_path):
    network = make_network()
    straight, seen = run(network, tmp_path / "straight.pt")
    assert seen == list(range(10))
    checkpoint = tmp_path / "deep" / "net.pt"
    _, first = run(make_network(), checkpoint, stop_at=8, save_every=3)
    assert first == list(range(8))
    resumed = make_network()
    with torch.no_grad():
        resumed[0].weight.zero_()  # what a new process starts with must not matter
    average, second = run(resumed, checkpoint)
    assert second == [6, 7, 8, 9]  # from the last checkpoint
    assert_equal(network, resumed)
    assert_equal(straight, average)


def test_what_is_finished_is_only_read(tmp_path):
    average, _ = run(make_network(), tmp_path / "net.pt", steps=5)
    again, seen = run(make_network(), tmp_path / "net.pt", steps=5)
    assert seen == []
    assert_equal(average, again)
    _, seen = run(make_network(), tmp_path / "net.pt", steps=7)
    assert seen == [5, 6]


def test_the_last_step_is_saved_and_nothing_half_written_is_left(tmp_path):
    average, _ = run(make_network(), tmp_path / "net.pt", steps=7)
    assert [path.name for path in tmp_path.iterdir()] == ["net.pt"]
    read = read_average(tmp_path / "net.pt", make_network())
    assert not read.training
    assert_equal(average, read)


def test_a_write_that_fails_keeps_the_checkpoint_before(tmp_path, monkeypatch):
    checkpoint = tmp_path / "net.pt"
    run(make_network(), checkpoint, steps=4)
    kept = checkpoint.read_bytes()

    def full(state, path):
        path.write_bytes(b"half")
        raise OSError("no space left on device")

    monkeypatch.setattr(torch, "save", full)
    with pytest.raises(OSError, match="no space"):
        run(make_network(), checkpoint, steps=6)
    assert checkpoint.read_bytes() == kept


def test_the_average_follows_the_weights(tmp_path):
    network, weights = make_network(), []
    step = make_step(network, [])
    start = network[0].weight.detach().clone()

    def watched(i):
        weights.append(network[0].weight.detach().clone())
        return step(i)

    average = fit(network, watched, steps=6, rate=0.02, checkpoint=tmp_path / "net.pt", warm_up=3)
    wanted = start
    for i, now in enumerate([*weights[1:], network[0].weight.detach()]):
        share = (i + 1) / (i + 20)
        wanted = share * wanted + (1 - share) * now
    torch.testing.assert_close(average[0].weight, wanted)
    assert not torch.equal(average[0].weight, network[0].weight)
    assert int(average[1].num_batches_tracked) == int(network[1].num_batches_tracked) == 6


def test_the_rate_warms_up_and_falls(tmp_path, monkeypatch):
    rates = []
    plain = torch.optim.AdamW.step

    def noted(self, *arguments, **options):
        rates.append([group["lr"] for group in self.param_groups])
        return plain(self, *arguments, **options)

    monkeypatch.setattr(torch.optim.AdamW, "step", noted)
    network = make_network()
    fit(network, make_step(network, []), steps=40, rate=1.0, checkpoint=tmp_path / "net.pt", warm_up=4)
    assert [rate[0] for rate in rates[:3]] == [0.25, 0.5, 0.75]
    falling = [rate[0] for rate in rates[4:]]
    assert falling == sorted(falling, reverse=True) and 0.02 <= falling[-1] < 0.03
    assert all(a == b for a, b in rates)


def test_only_matrices_decay(tmp_path):
    """With losses that do not depend on the weights, decay alone moves them."""
    network = make_network()
    with torch.no_grad():
        network[0].bias.fill_(1.0)
    before = copy.deepcopy(network.state_dict())

    def nothing(i):
        return {"none": sum((p * 0).sum() for p in network.parameters())}

    fit(network, nothing, steps=5, rate=0.1, checkpoint=tmp_path / "net.pt", weight_decay=0.5, warm_up=1)
    after = network.state_dict()
    assert after["0.weight"].norm() < 0.95 * before["0.weight"].norm()
    assert torch.equal(after["0.bias"], before["0.bias"]) and torch.equal(after["1.weight"], before["1.weight"])


def test_a_checkpoint_that_is_absent_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"absent\.pt: not there"):
        read_average(tmp_path / "absent.pt", make_network())
