"""The report is one page with everything in it, and its numbers are those of `compare`."""

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from rigwatch.commands import main
from rigwatch.page.scale import Scale, limits
from rigwatch.page.svg import Plot
from rigwatch.workbench.compare import Region
from rigwatch.workbench.explain.exchange import Exchange
from rigwatch.workbench.explain.verdict_calibration import LATER_COUNTS, later_probability_wrong
from rigwatch.workbench.fit import Value
from rigwatch.workbench.report import explanation_lines, next_command, next_step
from rigwatch.workbench.report.html_report import gather, report_html
from rigwatch.workbench.report.sections import headline, shown_at
from rigwatch.workbench.report.text_report import doubt_of
from rigwatch.workbench.study.study import Study
from tests.report.style import COLOURS, WORDS

SECTIONS = ("errors", "signals", "where", "ranking", "parameters", "ledger")
VOID = ("meta", "path", "rect", "circle", "i")


class Page(HTMLParser):
    """What a program finds in the page: numbers by name, text and pictures by section."""

    def __init__(self) -> None:
        super().__init__()
        self.numbers: dict[str, float] = {}
        self.verdict, self.section = "", "header"
        self.text: dict[str, str] = {}
        self.pictures: dict[str, int] = {}
        self.open: list[str] = []
        self.attributes: list[tuple[str, str]] = []

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.attributes += [(k, v or "") for k, v in found.items()]
        if tag not in VOID:
            self.open.append(tag)
        if tag == "section":
            self.section = found["id"]
        if tag == "svg":
            self.pictures[self.section] = self.pictures.get(self.section, 0) + 1
        if "data-name" in found:
            self.numbers[found["data-name"]] = float(found["value"])
        self.verdict = found.get("data-verdict", self.verdict)

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        self.text[self.section] = self.text.get(self.section, "") + data


@pytest.fixture(scope="module")
def page(study: Study, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Page]:
    target = Path(tmp_path_factory.mktemp("page")) / "drive.html"
    assert main(["study", "report", str(study.folder), "--output", str(target)]) == 0
    text, parsed = target.read_text(), Page()
    parsed.feed(text)
    return text, parsed


def test_it_asks_the_network_for_nothing(page: tuple[str, Page]) -> None:
    text, parsed = page
    assert not re.search(r"https?://|//[a-z]|@import|url\(|<script|<link|<img|<iframe", text)
    assert not {k for k, _ in parsed.attributes} & {"src", "href", "srcset", "onload"}


def test_its_colours_are_those_of_the_style(page: tuple[str, Page]) -> None:
    text, _ = page
    assert set(re.findall(r"var\(--(\w+)\)", text)) <= COLOURS["light"].keys()
    assert set(re.findall(r'<text [^>]*fill="var\(--(\w+)\)"', text)) <= WORDS


def test_it_is_whole_and_every_section_has_content(page: tuple[str, Page]) -> None:
    _, parsed = page
    assert not parsed.open
    for name in SECTIONS:
        assert len(parsed.text[name]) > 100, name
    # Signal and residual of three steps; two maps, three cuts and a spectrum.
    assert parsed.pictures["signals"] == 6
    assert parsed.pictures["where"] >= 5
    assert parsed.pictures["errors"] == 1


def test_its_numbers_are_those_of_compare(
    page: tuple[str, Page], study: Study, capsys: pytest.CaptureFixture[str]
) -> None:
    _, parsed = page
    assert main(["compare", str(study.folder), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    for name in ("train_error", "held_out_error", "noise_floor"):
        assert parsed.numbers[name] == found[name]
        for channel, values in found["channels"].items():
            assert parsed.numbers[f"{channel}.{name}"] == values[name]
    for name, value in found["parameters"].items():
        assert parsed.numbers[name] == value["value"]


def test_errors_are_shown_in_the_unit_of_the_verdict_and_kept_in_si(study: Study) -> None:
    material = gather(study)
    last = material.stages[-1]
    channels = {n: replace(c, told_in="mm") for n, c in last.comparison.channels.items()}
    told = replace(last.comparison, told_in="mm", channels=channels)
    stages = [*material.stages[:-1], replace(last, comparison=told)]
    page, parsed = report_html(replace(material, stages=stages)), Page()
    parsed.feed(page)
    assert parsed.numbers["held_out_error"] == told.held_out_error
    shown = f"{1e3 * told.held_out_error:.4g}"
    assert f'data-name="held_out_error">{shown}</data></b><span>held-out error now [mm]' in page
    for name in channels:
        row = page[page.index(f'data-name="{name}.held_out_error"') :].split("</tr>")[0]
        assert row.startswith(f'data-name="{name}.held_out_error">{shown}<')
        assert "<td>mm</td>" in row


def test_it_tells_the_story(page: tuple[str, Page]) -> None:
    _, parsed = page
    assert parsed.verdict in ("nothing_missing", "missing_effect", "undetermined", "unknown_effect")
    assert "+ coulomb" in parsed.text["errors"]
    assert "+ constant force" in parsed.text["errors"]
    assert "stribeck@load refused" in parsed.text["errors"]
    assert "stribeck@load" in parsed.text["ranking"]
    assert "constant_force@load" in parsed.text["ledger"]


@pytest.mark.parametrize(
    ("rivals", "said"),
    [(["stribeck@load"], "cannot tell lag at drive from stribeck"),
     ([], "cannot tell whether lag at drive is missing")],
)  # fmt: skip
def test_an_undetermined_verdict_is_a_whole_sentence(
    study: Study, rivals: list[str], said: str
) -> None:
    material = gather(study)
    best = replace(material.explanation.ranking[0], effect="lag", port="drive")
    found = replace(
        material.explanation, verdict="undetermined", rivals=rivals, also=[], ranking=[best]
    )
    assert headline(replace(material, explanation=found)).endswith(said)


def test_a_named_effect_has_its_strength_and_the_command_that_adds_it(study: Study) -> None:
    found = gather(study).explanation
    strength = {"Fc": Value(0.43, "N", (0.41, 0.45))}
    best = replace(found.ranking[0], effect="coulomb", port="load", parameters=strength)
    named = replace(found, verdict="missing_effect", ranking=[best], beside=["lag@drive"])
    assert "  coulomb@load: Fc = 0.43 N (0.41 … 0.45)" in explanation_lines(named)
    assert next_command(named, "rub") == "rigwatch add rub coulomb --port load --with lag@drive"
    assert next_command(replace(named, verdict="undetermined"), "rub") == ""


def test_what_to_do_next_is_told_where_the_recordings_do_not_decide(study: Study) -> None:
    found = replace(gather(study).explanation, verdict="undetermined", next_experiment=None)
    best = replace(found.ranking[0], effect="coulomb", port="load", accepted=True)
    told = next_step(replace(found, ranking=[best]), "rub")
    assert told == (
        "record another motion, list it under [[train]] in rub/study.toml, and explain again; or,"
        " if you know that it is coulomb@load: rigwatch add rub coulomb --port load"
    )
    beside = next_step(replace(found, ranking=[best], beside=["lag@drive"]), "rub")
    assert beside.endswith("rigwatch add rub coulomb --port load --with lag@drive")
    only_trained = next_step(replace(found, ranking=[replace(best, accepted=False)]), "rub")
    assert "list it under [[held_out]] in rub/study.toml" in only_trained
    assert only_trained.endswith("rigwatch add rub coulomb --port load --anyway")
    named = replace(found, verdict="missing_effect", ranking=[best])
    assert next_step(named, "rub") == next_command(named, "rub")
    assert next_step(replace(found, verdict="nothing_missing"), "rub") == ""


def test_where_no_known_effect_explains_the_error_it_is_told_where_to_look(study: Study) -> None:
    found = replace(gather(study).explanation, verdict="unknown_effect", beside=[], exchange=None)
    best = replace(found.ranking[0], effect="coulomb", port="load", accepted=True)
    look = "rigwatch locate rub shows where the model fails; an effect of your own is tried with"
    look += " rigwatch add rub --effect-file FILE"
    part = "; or, if you know that coulomb@load is a part of it: rigwatch add rub coulomb"
    assert next_step(replace(found, ranking=[best]), "rub") == f"{look}{part} --port load"
    assert next_step(replace(found, ranking=[replace(best, accepted=False)]), "rub") == look
    assert next_step(replace(found, ranking=[]), "rub") == look
    offered = Exchange("bouc_wen", "load", "dahl", 0.1, 0.01)
    assert not next_step(replace(found, ranking=[best], exchange=offered), "rub")


def test_the_commands_of_the_first_rivals_are_told_beside_that_of_the_simplest(
    study: Study,
) -> None:
    found = replace(gather(study).explanation, verdict="undetermined", next_experiment=None)
    rows = [
        replace(found.ranking[0], effect=name, port="load", accepted=name != "cubic_stiffness")
        for name in ("jenkins", "cubic_stiffness", "bouc_wen", "elastoplastic", "lugre")
    ]
    rivals = [f"{row.effect}@load" for row in rows[1:]]
    pair = replace(found, ranking=rows, rivals=rivals[1:2])
    assert next_step(pair, "rub").endswith(
        "it is jenkins@load: rigwatch add rub jenkins --port load;"
        " if it is bouc_wen@load: rigwatch add rub bouc_wen --port load"
    )
    # A rival that is refused alone, and one after the second, are in the verdict's sentence only.
    told = next_step(replace(pair, rivals=rivals), "rub")
    assert told.endswith("if it is elastoplastic@load: rigwatch add rub elastoplastic --port load")
    assert "add rub cubic_stiffness" not in told
    beside = next_step(replace(pair, beside=["lag@drive", "lugre@load"], rivals=rivals[3:]), "rub")
    assert beside.endswith(
        "it is jenkins@load: rigwatch add rub jenkins --port load --with lag@drive lugre@load"
    )
    offered = Exchange("bouc_wen", "load", "dahl", 0.1, 0.01)
    assert "add rub bouc_wen" not in next_step(replace(pair, exchange=offered), "rub")


def test_that_more_is_missing_than_the_effect_named_is_in_the_headline(study: Study) -> None:
    material = gather(study)
    found = replace(material.explanation, verdict="missing_effect", remains=0.63)
    more = ", and more than that: it leaves 63% of the error's energy"
    more += ", for which no known effect is found yet"
    assert explanation_lines(found)[0] == f"verdict: an effect is missing{more}"
    assert headline(replace(material, explanation=found)).endswith(more)
    alone = replace(found, remains=0.0)
    assert explanation_lines(alone)[0] == "verdict: an effect is missing"
    assert "more than that" not in headline(replace(material, explanation=alone))


def test_the_doubt_of_a_later_step_is_that_of_later_steps(study: Study) -> None:
    found = gather(study).explanation
    assert found.like_this == LATER_COUNTS
    assert found.wrong_probability == later_probability_wrong()


@pytest.mark.parametrize(
    ("most", "cases", "unlike", "said"),
    [
        (
            None,
            (8, 0),
            "",
            "is unknown: of 8 similar simulated cases 0 were wrong, which are too few",
        ),
        (0.0894, (32, 0), "", "wrong at most 8.9%: of 32 similar simulated cases 0 were wrong"),
        (0.0145, (325, 1), "", "wrong at most 1.5%: of 325 similar simulated cases 1 was wrong"),
        (None, (200, 0), "inputs are missing", "is unknown: inputs are missing, unlike simulated"),
        (None, (0, 0), "", "no simulated case is similar"),
    ],
)
def test_a_doubt_is_stated_no_finer_than_simulated_cases_support(
    study: Study, most: float | None, cases: tuple[int, int], unlike: str, said: str
) -> None:
    found = gather(study).explanation
    stated = None if most is None else found.wrong_probability
    told = replace(
        found, wrong_at_most=most, wrong_probability=stated, like_this=cases, unlike=unlike
    )
    assert said in doubt_of(told)


def test_an_output_that_cannot_be_written(
    study: Study, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "no" / "such" / "folder.html"
    assert main(["study", "report", str(study.folder), "--output", str(target)]) == 2
    assert str(target) in capsys.readouterr().err


def test_ticks_are_round_and_inside() -> None:
    for low, high in ((0.0, 1.0), (-3.7, 12.1), (1e-7, 5e-7), (-1e4, 3e5)):
        ticks = Scale(low, high, 0, 100).ticks()
        assert 3 <= len(ticks) <= 8
        assert min(ticks) >= low - 1e-9 * (high - low)
        assert max(ticks) <= high + 1e-9 * (high - low)
    assert Scale(0.1, 1000.0, 0, 100, log=True).ticks() == pytest.approx([0.1, 1, 10, 100, 1000])


def test_a_line_breaks_where_nothing_was_measured_and_keeps_its_peaks() -> None:
    x = np.linspace(0, 1, 5000)
    y = np.sin(50 * x)
    y[2000:2600] = np.nan
    y[4321] = 7.0
    plot = Plot("test", (0, 1), limits(y))
    plot.line(x, y, "held")
    path = re.search(r'<path d="(M[^"]+)" fill="none"', plot.drawn())
    assert path is not None
    assert path[1].count("M") == 2
    assert len(path[1]) < 20_000
    highest = min(float(pair.split()[1]) for pair in re.findall(r"[\d.]+ [\d.]+", path[1]))
    assert highest == pytest.approx(plot.up.at(7.0), abs=0.06)


def test_pieces_of_recordings_with_numbers_in_their_names_stand_as_recorded() -> None:
    names = [
        f"{run}.mcap, {ends} s" for run in ("20_run", "3 runs") for ends in ("0 to 5", "5 to 9")
    ]
    regions = [
        Region("time", name, "y", 1.0, 0.0, 0.1, 1.0, np.arange(100 * k, 100 * k + 100))
        for k, name in enumerate(names)
    ]
    by_energy = regions[::-1]
    assert [region.name for region in sorted(by_energy, key=shown_at)] == names
