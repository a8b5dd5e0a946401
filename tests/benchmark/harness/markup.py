"""What both pages share: the look, tables, crops."""

import base64
from html import escape

STYLE = """
:root{color-scheme:light}body{font:15px/1.5 system-ui,sans-serif;color:#1d2327;background:#fbfaf7;
max-width:1020px;margin:2.2em auto;padding:0 1.2em}h1{font-size:1.7em;margin-bottom:.1em}
h2{margin-top:2.2em;border-bottom:1px solid #d9d5cb;padding-bottom:.15em}h3{margin:1.3em 0 .3em}
table{border-collapse:collapse;margin:.7em 0;font-variant-numeric:tabular-nums}
th,td{padding:.22em .75em;white-space:nowrap;text-align:right;border-bottom:1px solid #e6e2d8}
th:first-child,td:first-child{text-align:left}th{font-weight:600;color:#4b545a}
.wide{overflow-x:auto}.win{color:#0b6e4f;font-weight:600}.loss{color:#b0341d;font-weight:600}.note{color:#5f6b73}
.charts{display:flex;flex-wrap:wrap;gap:12px}.charts svg{flex:1 1 420px;max-width:470px;
background:#fff;border:1px solid #e6e2d8}.legend span{margin-right:1.2em;white-space:nowrap}
.legend i{display:inline-block;width:.85em;height:.85em;margin-right:.35em;vertical-align:-.08em}
.crops{display:flex;flex-wrap:wrap;gap:10px}.crops figure{margin:0}
.crops img{display:block;width:150px;image-rendering:pixelated;border:1px solid #d9d5cb}
.crops figcaption{font-size:12px;width:150px}.bar{width:100%;max-width:600px;height:18px}
code,pre{font:13px/1.45 ui-monospace,monospace;background:#f1eee6;padding:.1em .3em}
pre{padding:.6em .8em;white-space:pre-wrap}
"""


def document(title, parts):
    body = "\n".join(part for part in parts if part)
    return (f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
            f'<meta name="viewport" content="width=device-width">'
            f"<title>{escape(title)}</title><style>{STYLE}</style></head>\n<body>\n"
            f"<h1>{escape(title)}</h1>\n{body}\n</body></html>\n")


class Html(str):
    """Text that is markup already."""

    __slots__ = ()


def _cell(tag, value):
    return f"<{tag}>{value if isinstance(value, Html) else escape(str(value))}</{tag}>"


def table(head, rows):
    lines = ["<tr>" + "".join(_cell("th", cell) for cell in head) + "</tr>"]
    lines += ["<tr>" + "".join(_cell("td", cell) for cell in row) + "</tr>" for row in rows]
    return '<div class="wide"><table>\n' + "\n".join(lines) + "\n</table></div>"


def listed(lines):
    return "<ul>" + "".join(f"<li>{escape(line)}</li>" for line in lines) + "</ul>"


def paragraph(text, kind=""):
    return f'<p class="{kind}">{escape(text)}</p>' if kind else f"<p>{escape(text)}</p>"


def crops(pictures):
    """(caption, PNG bytes) side by side, inside the page."""
    figures = [f'<figure><img alt="{escape(caption)}" src="data:image/png;base64,'
               f'{base64.b64encode(data).decode()}"><figcaption>{escape(caption)}</figcaption>'
               f"</figure>" for caption, data in pictures]
    return '<div class="crops">' + "".join(figures) + "</div>" if figures else ""


def about(meta):
    """Date, machine, versions and the command that made the figures."""
    facts = [f"{meta['date']}"] if "date" in meta else []
    if "machine" in meta:
        facts.append(f"{meta['machine']}, {meta.get('threads', '?')} threads")
    facts += [f"{name} {version}" for name, version in meta.get("versions", {}).items()]
    command = f"<pre>{escape(meta['command'])}</pre>" if "command" in meta else ""
    return paragraph(" · ".join(facts), "note") + command
