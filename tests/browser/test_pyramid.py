"""What a chart shows of a long signal is what all of its samples would show."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigwatch.browser.recordings import write_channels
from rigwatch.browser.signals.pyramid import FIRST, HIGH, LAST, LOW, STEP, Pyramid
from rigwatch.browser.signals.trace import Trace, open_trace, write_trace
from rigwatch.browser.work import RESULTS, Results
from rigwatch.wire.session import SessionWriter, run_info
from tests.browser.page import serving
from tests.browser.test_access import ask
from tests.bus.publisher import wave


@given(st.integers(1, 40_000), st.floats(0, 1), st.floats(0, 1), st.integers(1, 900), st.booleans())
def test_each_column_has_the_extremes_of_its_samples(n, a, b, width, holes):
    samples = np.random.default_rng(n).normal(size=n).astype(np.float32)
    if holes:
        samples[n // 3 : n // 2] = np.nan
    begin, end = sorted((int(a * n), int(b * n)))
    found = Pyramid(samples).span(begin, end, width)
    assert len(found.values) == len(found.edges) - 1 <= width
    if end > begin:
        assert found.edges[0] <= begin
        assert found.edges[-1] >= end
    for row, first, last in zip(found.values, found.edges[:-1], found.edges[1:], strict=True):
        part = samples[first:last]
        if not np.isfinite(part).any():
            continue
        assert row[LOW] == np.nanmin(part)
        assert row[HIGH] == np.nanmax(part)
        np.testing.assert_equal(row[[FIRST, LAST]], part[[0, -1]])


def test_a_spike_of_one_sample_is_seen_from_afar(tmp_path):
    values = np.zeros(300_000)
    values[123_456] = 7.0
    write_trace(tmp_path, "spike", values, 1e-3)
    trace = open_trace(tmp_path, "spike")
    times, shown = trace.between(*trace.ends, 800)
    assert len(shown) <= 4 * 800
    assert shown.max() == 7.0
    assert times[np.argmax(shown)] == pytest.approx(123.456, abs=0.4)
    times, shown = trace.between(123.45, 123.46, 800)
    assert times[np.argmax(shown)] == pytest.approx(123.456, abs=1e-9)


def test_any_span_of_five_million_samples_is_made_of_a_few_blocks_a_column(tmp_path, monkeypatch):
    write_trace(tmp_path, "long", np.random.default_rng(0).normal(size=5_000_000), 1e-3)
    trace, read, rows_of = open_trace(tmp_path, "long"), [], Pyramid._rows

    def counted(self, level, first, last):
        rows = rows_of(self, level, first, last)
        read.append(len(rows))
        return rows

    monkeypatch.setattr(Pyramid, "_rows", counted)
    for k in range(60):
        trace.between(40.0 * k, 5000.0 - 30.0 * k, 1200)
    assert len(read) == 60
    assert max(read) <= 2 * STEP * 1200 + 2


@given(st.integers(1, 300), st.sampled_from([1 / 256, 0.001, 1e-4, 0.3, 7.0]), st.data())
def test_equal_steps_need_no_list_of_times(n, step, data):
    samples = np.arange(n, dtype=np.float32)
    times = np.arange(n) * step
    even, listed = Trace(Pyramid(samples), np.array([step])), Trace(Pyramid(samples), times)
    assert even.even == (n > 1)
    if n == 1:
        return
    exact = st.integers(-2, n + 2).map(lambda k: k * step)
    start, end = sorted(data.draw(st.tuples(*[exact | st.floats(-step, (n + 1) * step)] * 2)))
    assert even.within(start, end) == listed.within(start, end)
    assert even.ends == listed.ends
    np.testing.assert_array_equal(even.at(np.arange(n)), times)


@pytest.mark.parametrize(("by_s", "boot"), [(-3600, 7), (-200, 7), (3600, 7), (-3600, 8)])
def test_a_clock_that_was_set_in_a_recording_does_not_turn_its_chart(tmp_path, by_s, boot):
    whole = wave(0, 1000, 7, 10**18)
    later = wave(500, 500, 7, 10**18)
    later = replace(later, boot=boot, t_ns=later.t_ns + by_s * 10**9)
    with SessionWriter(tmp_path / "set.mcap", run_info("bench", 256.0)) as writer:
        writer.write(wave(0, 500, 7, 10**18))
        writer.write(later)
    kept = Results(tmp_path / "kept")
    found = write_channels(kept, tmp_path / "set.mcap")
    assert found["samples"] == len(whole)
    assert found["seconds"] == pytest.approx((whole.t_ns[-1] - whole.t_ns[0]) / 1e9, abs=1e-3)
    trace = open_trace(kept.folder / "signals", next(iter(found["channels"])))
    times, _ = trace.between(*trace.ends, 4000)
    assert np.all(np.diff(times) >= 0.0)


def test_a_channel_that_is_not_there_is_no_fault_of_the_server(tmp_path):
    (tmp_path / "one").mkdir()
    (tmp_path / "one" / "study.toml").touch()
    results = Results(tmp_path / "one" / RESULTS / "abc")
    results.write("evidence", {"coulomb@load": {}, "later@load": {}})
    times, values = np.arange(100) / 10.0, np.ones((2, 100), np.float32)
    with results.whole("signals") as folder:
        write_trace(folder, "train.residual.x", values[0], times)
    with results.whole("directions") as folder:
        (folder / "labels.txt").write_text("coulomb@load")
        for name, content in (("taken", values[None]), ("residual", values), ("scale", np.ones(2))):
            np.save(folder / f"{name}.npy", content)
        np.save(folder / "times.npy", times)
    asked = (
        "/api/signals/one?key=abc&chart=residual&use=train&channel=x&preview={}%40load&number={}"
    )
    with serving(tmp_path) as served:
        found = [
            ask(served, asked.format(label, number))[0]
            for label, number in (("coulomb", 1), ("coulomb", 2), ("coulomb", -1), ("later", 0))
        ]
    assert found == [200, 404, 404, 404]
