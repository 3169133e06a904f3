from placegraph.runtime.health import StepStats


def test_no_steps() -> None:
    report = StepStats("pose").report(elapsed_s=1.0, queue=0, memory_mb=1.0)
    assert (report.steps, report.rate_hz, report.step_p50_ms, report.step_p95_ms) == (0, 0.0, 0.0, 0.0)
    assert StepStats("pose").report(elapsed_s=0.0, queue=0, memory_mb=1.0).rate_hz == 0.0


def test_rate_counts_since_the_last_report_and_percentiles_over_all() -> None:
    stats = StepStats("pose")
    for _ in range(4):
        stats.add_step(0.010)
    assert stats.report(2.0, 3, 50.0).rate_hz == 2.0
    stats.add_step(0.110)
    report = stats.report(1.0, 0, 50.0)
    assert (report.rate_hz, report.steps) == (1.0, 5)
    assert abs(report.step_p50_ms - 10) < 1e-6 and 80 < report.step_p95_ms < 110
