"""Who may ask: what comes from elsewhere, without a token or leads out of the folder is refused."""

import http.client
import json
import socket
import threading
from pathlib import Path

import pytest
from starlette.requests import Request

from rigwatch.browser.recordings import visible_files
from rigwatch.browser.server.access import Access, cookie_name, hosts_of
from rigwatch.browser.server.context import number_of
from rigwatch.browser.server.places import PlaceError, Places
from rigwatch.browser.server.serving import Options, serve
from rigwatch.wire.errors import RigwatchError
from tests.browser.page import Page, Served, looking, serving
from tests.waiting import eventually

pytestmark = pytest.mark.xdist_group("browser")


LOG = b"t[s],x[m]\n" + b"".join(b"%.3f,1.0\n" % (0.01 * row) for row in range(100))


def ask(
    served: Served, path: str, method: str = "GET", *, token: bool = True, body: bytes = b"",
    **headers: str,
) -> tuple[int, str]:  # fmt: skip
    """Status and text of an answer."""
    host = served.address.removeprefix("http://")
    given = {"Host": host, "Origin": served.address}
    if token:
        given["Cookie"] = f"{cookie_name(host)}={served.token}"
    given |= {name.replace("_", "-"): value for name, value in headers.items()}
    line = http.client.HTTPConnection(host, timeout=60)
    try:
        line.request(method, path, body or None, {k: v for k, v in given.items() if v})
        answer = line.getresponse()
        return answer.status, answer.read().decode(errors="replace")
    finally:
        line.close()


REFUSED = {
    "forged Host": ("/", "GET", {"Host": "evil.example"}, 421),
    "a name that was made to point here": ("/", "GET", {"Host": "evil.example:80"}, 421),
    "forged Origin": ("/api/story/emps", "POST", {"Origin": "http://evil.example"}, 403),
    "Origin of another port": ("/api/story/emps", "POST", {"Origin": "http://127.0.0.1:1"}, 403),
    "no Origin": ("/api/story/emps", "POST", {"Origin": ""}, 403),
    "Origin null": ("/api/story/emps", "POST", {"Origin": "null"}, 403),
    "wrong token": ("/", "GET", {"Cookie": "", "Authorization": "Bearer guess"}, 403),
    "dots": ("/api/parts/..%2f..%2fetc", "GET", {}, 404),
    "more dots": ("/api/recording/../../../etc/passwd", "GET", {}, 404),
    "an absolute path": ("/api/recording//etc/passwd", "GET", {}, 404),
    "dots in static": ("/static/..%2faccess.py", "GET", {}, 404),
    "a zero byte": ("/api/recording/a%00.mcap", "GET", {}, 404),
    "dots in an upload": ("/api/upload/..%2fa.csv", "PUT", {}, 404),
    "a hidden upload": ("/api/upload/.profile", "PUT", {}, 404),
    "a template that is a file": ("/api/template/pyproject.toml", "GET", {}, 409),
    "another method": ("/api/begin/emps", "DELETE", {}, 405),
}


@pytest.mark.parametrize(("path", "method", "headers", "status"), REFUSED.values(), ids=REFUSED)
def test_what_is_forged_is_refused(
    served: Served, path: str, method: str, headers: dict[str, str], status: int
) -> None:
    assert ask(served, path, method, **headers)[0] == status
    assert ask(served, "/")[0] == 200


MALFORMED = {
    "text that is no UTF-8": ("/api/new", b'{"a": "\xff"}', 409),
    "brackets in brackets": ("/api/new", b'{"a": ' + b"[" * 100_000, 409),
    "a name longer than a file's": (f"/api/recording/{'a' * 300}.mcap", None, 404),
    "a study with such a name": (f"/api/parts/{'a' * 300}", None, 404),
    "spans that are no list": ("/api/new", b'{"name": "n", "begin": "emps", "spans": 5}', 409),
    "a span that is none": ("/api/new", b'{"name": "n", "begin": "emps", "spans": [null]}', 409),
}


@pytest.mark.parametrize("text", ["nan", "-inf", "1e400", "9" * 400, "1e18", "x", ""])
def test_a_number_in_an_address_is_exact_or_none(text: str) -> None:
    asked = {"type": "http", "query_string": f"step={text}&to=-3".encode()}
    assert number_of(Request(asked), "step") is None
    assert number_of(Request(asked), "to") == -3.0


@pytest.mark.parametrize(("path", "body", "status"), MALFORMED.values(), ids=MALFORMED)
def test_what_is_malformed_is_refused_in_a_line(
    served: Served, path: str, body: bytes | None, status: int
) -> None:
    """Found by mutating the requests of the pages (benchmarks, `fuzzed_requests`)."""
    found, text = ask(served, path, "POST" if body else "GET", body=body or b"")
    assert found == status, text
    assert "Traceback" not in text
    assert len(text) < 1000


def test_without_a_token_nothing_is_shown(served: Served) -> None:
    for path in ("/", "/new", "/static/study.js", "/api/recordings"):
        status, text = ask(served, path, token=False)
        assert status == 403
        assert "token" in text


def test_the_address_brings_the_token_once_and_leaves_it_out_of_what_others_see(
    served: Served,
) -> None:
    line = http.client.HTTPConnection(served.address.removeprefix("http://"), timeout=60)
    line.request("GET", f"/?token={served.token}")
    answer = line.getresponse()
    assert (answer.status, answer.headers["location"]) == (303, "/")
    cookie = answer.headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "samesite=strict" in cookie.lower()
    assert answer.headers["content-security-policy"].startswith("default-src 'self'")
    assert answer.headers["referrer-policy"] == "no-referrer"


@pytest.mark.nightly
def test_a_test_that_fails_leaves_no_requests_to_the_next(page: Page, root: Path) -> None:
    with pytest.raises(ZeroDivisionError), serving(root) as other, looking(page.driver, other):
        raise ZeroDivisionError
    assert page.requests() <= {page.served.address}


@pytest.mark.nightly
def test_two_servers_of_one_machine_do_not_log_each_other_out(page: Page, root: Path) -> None:
    page.open("/")
    page.find("h1, h2")
    assert page.requests() <= {page.served.address}
    with serving(root) as other, looking(page.driver, other) as there:
        there.open("/")
        there.find("h1, h2")
    page.open("/")
    page.until(lambda: "no token" not in page.text("body"), "still logged in")


def test_a_file_that_is_too_long_is_refused_and_leaves_nothing(served: Served) -> None:
    lock = served.folder / ".uploads" / "lock"
    eventually(lock.exists, "the server has begun")
    before = sorted(served.folder.rglob("*"))
    whole = ask(served, "/api/upload/long.csv", "PUT", Content_Length=str(1 << 30))
    assert whole[0] == 413
    # Without a length, in parts: it is counted as it comes.
    host = served.address.removeprefix("http://")
    line = http.client.HTTPConnection(host, timeout=60)
    cookie = {"Cookie": f"{cookie_name(host)}={served.token}", "Origin": served.address}
    parts = (b"1,2\n" * 65536 for _ in range(64))
    try:
        line.request("PUT", "/api/upload/long.csv", parts, cookie, encode_chunked=True)
        assert line.getresponse().status == 413
    except (BrokenPipeError, ConnectionResetError):
        pass  # the server has hung up before all was sent
    assert ask(served, "/")[0] == 200
    left = [path for path in served.folder.rglob("*") if path not in before and path.is_file()]
    assert left == []


def uploads_in(folder: Path) -> list[str]:
    return sorted(path.name for path in (folder / ".uploads").rglob("*") if path.suffix)


def bring(served: Served, name: str) -> None:
    assert ask(served, f"/api/upload/{name}", "PUT", body=LOG)[0] == 200


@pytest.mark.nightly
def test_uploads_of_a_killed_server_go_with_the_next_start(tmp_path: Path) -> None:
    with serving(tmp_path) as first:
        bring(first, "a.csv")
        with serving(tmp_path) as beside:
            bring(beside, "b.csv")
            assert uploads_in(tmp_path) == ["a.csv", "b.csv"], "the first server still runs"
        first.process.kill()
        first.process.wait()
    assert uploads_in(tmp_path) == ["a.csv", "b.csv"]
    with serving(tmp_path) as again:
        eventually(lambda: uploads_in(tmp_path) == [], "what was left is removed")
        for number in range(12):
            bring(again, f"{number:02d}.csv")
        assert uploads_in(tmp_path) == [f"{number:02d}.csv" for number in range(4, 12)]


def test_a_long_request_is_bounded(served: Served) -> None:
    status, text = ask(served, "/api/new", "POST", body=b'{"name": "' + b"x" * (2 << 20) + b'"}')
    assert status == 409
    assert "expected a short request" in text


@pytest.mark.parametrize("begin", ["/etc/passwd", "model:../../etc/passwd", "model:a.toml"])
def test_a_study_begins_with_what_ships_alone(served: Served, begin: str) -> None:
    recording = served.folder / "empty.mcap"
    recording.write_bytes(b"")
    spans = [{"use": use, "session": recording.name} for use in ("train", "held_out")]
    body = json.dumps({"name": "stolen", "begin": begin, "spans": spans}).encode()
    status, text = ask(served, "/api/new", "POST", body=body)
    recording.unlink()
    assert (status, "expected one of" in text) == (409, True)
    assert not (served.folder / "stolen").exists()


def test_links_do_not_lead_out(served: Served, tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text("model = 'emps-force'\n")
    (tmp_path / "secret.mcap").write_bytes(b"secret")
    links = {"linked": tmp_path, "linked.mcap": tmp_path / "secret.mcap"}
    for name, target in links.items():
        (served.folder / name).symlink_to(target)
    try:
        assert ask(served, "/api/parts/linked")[0] == 404
        assert ask(served, "/study/linked")[0] == 404
        assert ask(served, "/api/recording/linked.mcap")[0] == 404
        assert "linked" not in ask(served, "/api/recordings")[1]
    finally:
        for name in links:
            (served.folder / name).unlink()


def test_a_request_that_breaks_off_is_no_error(served: Served) -> None:
    host, _, port = served.address.removeprefix("http://").rpartition(":")
    before = len(served.said)
    for path in ("/api/new", "/api/import-preview"):
        head = (
            f"POST {path} HTTP/1.1\r\nHost: {host}:{port}\r\nOrigin: {served.address}\r\n"
            f"Authorization: {served.bearer}\r\nContent-Length: 1000\r\n\r\n"
        )
        with socket.create_connection((host, int(port)), timeout=60) as line:
            line.sendall(head.encode() + b'{"name": ')
    assert ask(served, "/")[0] == 200
    assert served.said[before:] == []


def test_hidden_folders_are_not_looked_into_and_links_that_lead_out_not_followed(
    tmp_path: Path,
) -> None:
    root, outside = tmp_path / "root", tmp_path / "outside"
    for folder in (root / "a" / "b" / "c" / "d", root / ".uploads", outside):
        folder.mkdir(parents=True)
        (folder / "x.mcap").touch()
    for folder in (root, root / "a", root / "a" / "b" / "c"):
        (folder / "seen.mcap").touch()
    (root / "a" / "linked").symlink_to(outside)
    found = {path.relative_to(root).as_posix() for path in visible_files(root)}
    assert found == {"seen.mcap", "a/seen.mcap", "a/b/c/seen.mcap"}


def test_a_study_that_names_files_outside_is_not_opened(served: Served, tmp_path: Path) -> None:
    folder = served.folder / "outside"
    folder.mkdir()
    span = f'session = "{tmp_path}/a.mcap"\n'
    text = f'model = "emps-force"\n[[train]]\n{span}[[held_out]]\n{span}'
    (folder / "study.toml").write_text(text)
    try:
        status, told = ask(served, "/study/outside")
        assert status == 404
        assert "lies outside" in told
    finally:
        (folder / "study.toml").unlink()
        folder.rmdir()


def test_fifty_clients_are_served(served: Served) -> None:
    found: list[int] = []

    def work() -> None:
        found.append(ask(served, "/new")[0])

    clients = [threading.Thread(target=work) for _ in range(50)]
    for client in clients:
        client.start()
    for client in clients:
        client.join()
    assert found == [200] * 50


def test_others_are_let_in_by_tls_or_behind_a_proxy_alone(tmp_path: Path) -> None:
    with pytest.raises(RigwatchError, match="--behind-proxy"):
        serve(Options("0.0.0.0", folder=tmp_path), lambda _: None)
    with pytest.raises(RigwatchError, match="expected both"):
        serve(Options(folder=tmp_path, certificate=tmp_path / "a.pem"), lambda _: None)


def test_a_proxy_is_named_without_its_port() -> None:
    access = Access(hosts_of(["rig.example"], 443), secure=True)
    assert "https://rig.example" in access.origins()
    assert "http://rig.example" not in access.origins()


def test_names_of_new_things_are_plain(tmp_path: Path) -> None:
    places = Places(tmp_path.resolve())
    for name in ("", ".", "..", "a/b", "../a", ".hidden", "a\x00", "a" * 200, "a\n"):
        with pytest.raises(PlaceError):
            places.new(name)
    assert places.new("my study-1.a") == tmp_path.resolve() / "my study-1.a"


def test_a_recording_that_is_taken_in_twice_at_once_stays(served: Served) -> None:
    """A second click on the button while the first one's request runs."""
    upload = json.loads(ask(served, "/api/upload/twice.csv", "PUT", body=LOG)[1])["upload"]
    mapping = {"channels": {"position": "x[m]"}, "time": "t[s]"}
    body = json.dumps({"upload": upload, "name": "twice", "mapping": mapping}).encode()
    found: list[int] = []
    clicks = [
        threading.Thread(
            target=lambda: found.append(ask(served, "/api/import", "POST", body=body)[0])
        )
        for _ in range(3)
    ]
    for click in clicks:
        click.start()
    for click in clicks:
        click.join()
    assert found.count(200) == 1, found
    assert (served.folder / "recordings" / "twice.mcap").is_file()


def test_a_folder_that_takes_no_recordings_is_told_in_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "recordings").write_text("no folder")
    with serving(tmp_path) as own:
        upload = json.loads(ask(own, "/api/upload/run.csv", "PUT", body=LOG)[1])["upload"]
        body = json.dumps({"upload": upload, "name": "run", "mapping": {}}).encode()
        status, text = ask(own, "/api/import", "POST", body=body)
    assert (status, "recordings: file exists" in text) == (409, True), text
