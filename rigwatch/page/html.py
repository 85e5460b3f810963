"""The page around a report's sections: one HTML file that asks the network for nothing."""

from collections.abc import Sequence
from html import escape

STYLE = """
:root{color-scheme:light dark;--paper:#f6f5f1;--card:#fff;--ink:#1d232b;--soft:#69727d;
--line:#e2e0d9;
--held:#1467c6;--train:#7b8794;--before:#c9862b;--floor:#cfe3d3;--measured:#b3bac2;--model:#c4302b;
--rest:#7a4fb5;--refused:#c4302b;--plus:#c4302b;--minus:#1467c6;--good:#1f7a45;--warn:#9a5b00}
@media(prefers-color-scheme:dark){:root{--paper:#14171b;--card:#1c2026;--ink:#e6e8ea;--soft:#98a2ad;
--line:#323840;--held:#62a8ff;--train:#8d99a6;--before:#e2a24a;--floor:#24432f;--measured:#5d6773;
--model:#ff7a6e;--rest:#b794f0;--refused:#ff7a6e;--plus:#ff7a6e;--minus:#62a8ff;--good:#5fc98b;
--warn:#e2a24a}}
*{box-sizing:border-box}
body{margin:0;background:var(--paper);color:var(--ink);font:16px/1.55 system-ui,-apple-system,
"Segoe UI",Roboto,"Noto Sans",sans-serif}
main{max-width:880px;margin:0 auto;padding:36px 20px 64px}
header h1{font-size:30px;line-height:1.2;margin:4px 0 10px;letter-spacing:-.01em}
header p.sub,.note,figcaption{color:var(--soft);font-size:14px;margin:6px 0}
.kicker{color:var(--soft);font-size:13px;letter-spacing:.06em;text-transform:uppercase;margin:0}
.figures{display:grid;
grid-template-columns:repeat(auto-fit,minmax(150px,1fr));gap:12px;margin:22px 0}
.figure{background:var(--card);border:1px solid var(--line);border-radius:10px;padding:12px 16px}
.figure b{display:block;font-size:26px;line-height:1.25;font-variant-numeric:tabular-nums}
.figure span{color:var(--soft);font-size:13px}
section{background:var(--card);border:1px solid var(--line);border-radius:12px;padding:20px 24px;
margin:18px 0}
h2{font-size:20px;margin:0 0 4px}h3{font-size:15px;margin:18px 0 2px}
svg{display:block;width:100%;height:auto;font:12px system-ui,sans-serif;overflow:visible}
svg text{fill:var(--soft)}svg .grid{stroke:var(--line);stroke-width:1}
svg .axis{stroke:var(--soft);stroke-width:1}svg.whisker{width:120px}
figure{margin:10px 0 0}.pair{display:grid;grid-template-columns:1fr 1fr;gap:10px}
.key{display:flex;flex-wrap:wrap;gap:4px 18px;font-size:13px;color:var(--soft);margin:8px 0 0}
.key i{display:inline-block;width:20px;height:4px;border-radius:2px;margin-right:7px;
vertical-align:middle}
.scroll{overflow-x:auto}table{border-collapse:collapse;width:100%;font-size:14px;margin-top:10px}
th,td{text-align:left;padding:6px 10px 6px 0;border-bottom:1px solid var(--line);vertical-align:top}
th{color:var(--soft);font-weight:500;font-size:13px}
.num{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}
.good{color:var(--good)}.no{color:var(--refused)}.warn{color:var(--warn)}
code{font:13px ui-monospace,Menlo,Consolas,monospace;overflow-wrap:anywhere}
summary{cursor:pointer;color:var(--soft);font-size:14px;margin-top:12px}
@media(max-width:640px){.pair{grid-template-columns:1fr}section{padding:16px 14px}}
@media print{:root{--paper:#fff}body{font-size:12px}main{max-width:none;padding:0}
section,.figure{break-inside:avoid;border-color:#ccc}details>*{display:block}}
"""


def page(title: str, header: str, sections: Sequence[tuple[str, str, str]]) -> str:
    """A whole page.

    Args:
        title: of the window.
        header: HTML above the sections.
        sections: id, heading and HTML of each.
    """
    body = "".join(
        f'<section id="{name}"><h2>{escape(heading)}</h2>{content}</section>'
        for name, heading, content in sections
    )
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        f"<title>{escape(title)}</title><style>{STYLE}</style></head>"
        f"<body><main><header>{header}</header>{body}</main></body></html>\n"
    )


def table(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """A table; cells are HTML already, columns in `numbers` stand to the right."""
    kinds = [' class="num"' if k in numbers else "" for k in range(len(head))]
    top = "".join(f"<th{kind}>{escape(cell)}</th>" for cell, kind in zip(head, kinds, strict=True))
    lines = "".join(
        "<tr>" + "".join(f"<td{k}>{c}</td>" for c, k in zip(row, kinds, strict=True)) + "</tr>"
        for row in rows
    )
    whole = f"<table><thead><tr>{top}</tr></thead><tbody>{lines}</tbody></table>"
    return f'<div class="scroll">{whole}</div>'


def key(*entries: tuple[str, str]) -> str:
    """What the colours mean: colour and words of each."""
    parts = (
        f'<span><i style="background:var(--{colour})"></i>{escape(words)}</span>'
        for colour, words in entries
    )
    return f'<p class="key">{"".join(parts)}</p>'


def figure(picture: str, caption: str = "") -> str:
    """A picture with its caption."""
    words = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    return f"<figure>{picture}{words}</figure>"


def exact(value: float | None, name: str = "") -> str:
    """A number of four digits that carries all its digits for programs."""
    if value is None:
        return "–"
    known = f' data-name="{escape(name)}"' if name else ""
    return f'<data value="{value!r}"{known}>{value:.4g}</data>'
