"""The same archive in an object store: moto's S3 behind a real HTTP server, which also fails."""

import json
import threading
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest

from rigwatch.archive import Store, ask, index, query, retain
from rigwatch.batch import executor_on
from rigwatch.commands import main
from rigwatch.wire.errors import ArchiveError
from rigwatch.wire.rig_config import RecorderSection
from tests.archive.sessions import DAY_S, write_session

VERIFY = Path(__file__).parents[1] / "verify"
KEYS = {"aws_access_key_id": "key", "aws_secret_access_key": "secret", "region_name": "us-east-1"}


class Sometimes:
    """Answers every n-th request with an error of the server, before it has any effect."""

    def __init__(self, application: Any) -> None:
        self._application = application
        self.every = 0
        self.requests = self.failures = 0

    def __call__(self, environ: dict[str, Any], start: Callable[..., Any]) -> Iterable[bytes]:
        self.requests += 1
        if self.every and self.requests % self.every == 0:
            self.failures += 1
            start("503 Slow Down", [("Content-Length", "0")])
            return [b""]
        answered: Iterable[bytes] = self._application(environ, start)
        return answered


@pytest.fixture(scope="module")
def served() -> Iterator[tuple[str, Sometimes]]:
    """Address of the server, and what makes it fail."""
    # Loaded by the worker that uses it: every worker reads this file.
    from moto.server import DomainDispatcherApplication, create_backend_app
    from werkzeug.serving import make_server

    application = Sometimes(DomainDispatcherApplication(create_backend_app))
    server = make_server("127.0.0.1", 0, application, threaded=True)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.port}", application
    server.shutdown()
    thread.join()


@pytest.fixture
def bucket(
    served: tuple[str, Sometimes],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    request: pytest.FixtureRequest,
) -> tuple[Store, Store]:
    """The same sessions in a folder and in a bucket."""
    import boto3

    address, _ = served
    for name, value in (
        ("AWS_ENDPOINT_URL", address),
        ("AWS_ACCESS_KEY_ID", "key"),
        ("AWS_SECRET_ACCESS_KEY", "secret"),
        ("AWS_DEFAULT_REGION", "us-east-1"),
    ):
        monkeypatch.setenv(name, value)
    for day in range(4):
        write_session(tmp_path / f"one{day}.mcap", start_s=day * DAY_S, missing=day)
    write_session(tmp_path / "segments" / "000001.mcap", rig="b 2", start_s=9)
    write_session(tmp_path / "segments" / "000002.mcap", rig="b 2", start_s=13, boot=2)
    client = boto3.client("s3", endpoint_url=address, **KEYS)
    name = f"rigs-{abs(hash(request.node.name))}"
    client.create_bucket(Bucket=name)
    for file in tmp_path.rglob("*.mcap"):
        client.upload_file(str(file), name, f"all/{file.relative_to(tmp_path)}")
    return Store(str(tmp_path)), Store(f"s3://{name}/all")


QUERY = "select * exclude (stamp) from sessions order by session"
SECONDS = "select * from seconds order by rig, name, second"


@pytest.mark.nightly
def test_a_bucket_gives_the_answers_of_a_folder(bucket):
    here, there = bucket
    assert index(here).sessions == index(there).sessions == 5
    assert query(there, QUERY).rows == query(here, QUERY).rows
    assert query(there, SECONDS).rows == query(here, SECONDS).rows
    assert ask(there, "losses").rows == ask(here, "losses").rows
    assert index(there).read == 0


def test_workers_read_and_write_the_bucket(bucket):
    here, there = bucket
    index(here)
    with executor_on("local:2") as executor:
        assert index(there, executor=executor).read == 5
    assert query(there, SECONDS).rows == query(here, SECONDS).rows


def test_a_store_that_fails_every_tenth_request_loses_nothing(bucket, served):
    here, there = bucket
    index(here)
    failing = served[1]
    failing.every, failing.failures = 10, 0
    try:
        done = index(there)
        assert done.statuses == {"ok": 5}
        assert query(there, QUERY).rows == query(here, QUERY).rows
        assert failing.failures > 2
    finally:
        failing.every = 0


def test_a_query_stays_in_the_archive(bucket):
    _, there = bucket
    index(there)
    for place in ("/etc/passwd", f"{there.url}/one0.mcap"):
        with pytest.raises(ArchiveError, match="disabled by configuration"):
            query(there, f"select * from read_text('{place}')")


def test_a_bucket_that_is_not_there_is_said(bucket):
    with pytest.raises(ArchiveError, match="s3://none/all"):
        index(Store("s3://none/all"))


def test_old_sessions_of_a_bucket_go_although_it_fails_now_and_then(bucket, served):
    _, there = bucket
    index(there)
    served[1].every = 7
    try:
        done = retain(there, RecorderSection(keep_days=1), remove=True)
    finally:
        served[1].every = 0
    assert (done.removed, done.failures) == (5, [])
    assert there.listed() == there.listed("rigwatch-index")
    assert query(there, "select * from sessions").rows == []


@pytest.fixture
def replayed(bucket: tuple[Store, Store]) -> tuple[Path, str]:
    """A folder and a bucket that also hold two recordings of a rig, one of them in segments."""
    here, there = bucket
    for name in ("friction.mcap", "stiction/000001.mcap"):
        source = VERIFY / f"{name.split('/')[0].removesuffix('.mcap')}.mcap"
        there.put(source, f"replay/{name}")
        here.put(source, f"replay/{name}")
    return Path(here.root, "replay"), f"{there.url}/replay"


def _replayed(given: list[str], target: Path, *on: str) -> dict[str, bytes]:
    words = ["--model", str(VERIFY / "model.toml"), "--results", str(target), *on]
    assert main(["replay", *given, *words]) == 0
    lines = map(json.loads, target.read_bytes().splitlines())
    return {line["path"]: json.dumps(line["value"]).encode() for line in lines}


def test_recordings_of_a_bucket_are_replayed_as_those_of_a_folder(replayed, tmp_path):
    folder, address = replayed
    here = _replayed([str(folder)], tmp_path / "here.jsonl")
    there = _replayed([address], tmp_path / "there.jsonl", "--on", "local:2")
    assert set(there) == {f"{address}/friction.mcap", f"{address}/stiction"}
    assert there == {name.replace(str(folder), address): value for name, value in here.items()}
    some = _replayed([f"{address}/fric*", str(folder / "stiction")], tmp_path / "some.jsonl")
    assert set(some) == {f"{address}/friction.mcap", str(folder / "stiction")}
    one = _replayed([f"{address}/stiction"], tmp_path / "one.jsonl")
    assert one == {f"{address}/stiction": there[f"{address}/stiction"]}


def test_a_recording_that_is_not_in_the_bucket_is_named_by_its_address(replayed, capsys):
    _, address = replayed
    given = [f"{address}/none.mcap", f"{address}/friction.mcap"]
    assert main(["replay", *given, "--model", str(VERIFY / "model.toml")]) == 1
    out, err = capsys.readouterr()
    assert f"{address}/friction.mcap: 2048 samples" in out
    assert f"failed: {address}/none.mcap: found no session, expected one" in err
    assert main(["replay", f"{address}/x*", "--model", str(VERIFY / "model.toml")]) == 2
    assert "found no session, expected at least one" in capsys.readouterr().err
    assert main(["explain", address]) == 2
    assert "only recordings are read from an object store" in capsys.readouterr().err
