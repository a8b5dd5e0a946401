"""Curves of error as SVG text: both axes logarithmic, one line an engine, bars for intervals."""

import math
from dataclasses import dataclass

WIDTH, HEIGHT = 440, 300
LEFT, RIGHT, TOP, BOTTOM = 58, 12, 14, 40
GRID = 'stroke="#e6e2d8"'
TICK = 'font-size="10.5" fill="#5f6b73"'
TITLE = 'font-size="11.5" fill="#1d2327"'
COLOURS = ("#8fb339", "#0b6e4f", "#c8553d", "#e3a857", "#3f5fa8", "#8a5a9e", "#5f6b73")


@dataclass(frozen=True)
class Point:
    """A mean with its 95 % interval; low and high may be equal to it."""

    x: float
    y: float
    low: float
    high: float


def _ticks(low, high):
    """1, 2, 5 of each decade within the limits; whole decades where these would be many."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    steps = (1, 2, 5) if last - first <= 2 else (1,)
    values = (step * 10.0**decade for decade in range(first, last + 1) for step in steps)
    return [value for value in values if low * 0.999 <= value <= high * 1.001]


def _label(value):
    if 1e-3 <= value < 1e4:
        return f"{value:g}"
    decade = math.floor(math.log10(value))
    return f"{value / 10.0**decade:.0f}e{decade}"


class _Axis:
    """Values to places on the page, logarithmically."""

    def __init__(self, values, start, end):
        low, high = min(values), max(values)
        self.low, self.high = low / 1.15, high * 1.15
        self._start, self._end = start, end

    def __call__(self, value):
        share = math.log(value / self.low) / math.log(self.high / self.low)
        return self._start + share * (self._end - self._start)

    def ticks(self):
        return _ticks(self.low, self.high)


def _grid(x, y, x_title, y_title):
    parts = [f'<line {GRID} x1="{x(value):.1f}" x2="{x(value):.1f}" y1="{TOP}" '
             f'y2="{HEIGHT - BOTTOM}"/><text {TICK} x="{x(value):.1f}" '
             f'y="{HEIGHT - BOTTOM + 14}" text-anchor="middle">{_label(value)}</text>'
             for value in x.ticks()]
    parts += [f'<line {GRID} x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y(value):.1f}" '
              f'y2="{y(value):.1f}"/><text {TICK} x="{LEFT - 5}" '
              f'y="{y(value) + 3.5:.1f}" text-anchor="end">{_label(value)}</text>'
              for value in y.ticks()]
    middle = (TOP + HEIGHT - BOTTOM) / 2
    parts.append(f'<text {TITLE} x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 8}" '
                 f'text-anchor="middle">{x_title}</text><text {TITLE} x="13" y="{middle}" '
                 f'text-anchor="middle" transform="rotate(-90 13 {middle})">{y_title}</text>')
    return parts


def _curve(name, points, colour, x, y):
    places = [(x(p.x), y(p.y)) for p in points]
    line = " ".join(f"{a:.1f},{b:.1f}" for a, b in places)
    parts = [f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="1.8"/>']
    for p, (a, b) in zip(points, places, strict=True):
        parts.append(f'<line x1="{a:.1f}" x2="{a:.1f}" y1="{y(p.low):.1f}" y2="{y(p.high):.1f}" '
                     f'stroke="{colour}" stroke-width="1.2"/>')
        parts.append(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3" fill="{colour}"><title>{name}: '
                     f'{p.y:.3g} [{p.low:.3g}, {p.high:.3g}] at {p.x:.3g}</title></circle>')
    return parts


def chart(curves, x_title, y_title, colours):
    """`curves` maps a name to its points, `colours` to its colour; positive values only."""
    curves = {name: [p for p in points if min(p.x, p.y, p.low) > 0.0]
              for name, points in curves.items()}
    flat = [p for points in curves.values() for p in points]
    if not flat:
        return '<p class="note">Every error is zero within what can be measured.</p>'
    x = _Axis([p.x for p in flat], LEFT, WIDTH - RIGHT)
    y = _Axis([v for p in flat for v in (p.low, p.high)], HEIGHT - BOTTOM, TOP)
    parts = _grid(x, y, x_title, y_title)
    for name, points in curves.items():
        parts += _curve(name, points, colours[name], x, y)
    return (f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" '
            f'aria-label="{y_title} over {x_title}">' + "".join(parts) + "</svg>")


def legend(colours):
    return '<p class="legend">' + " ".join(
        f'<span><i style="background:{colour}"></i>{name}</span>'
        for name, colour in colours.items()) + "</p>"


def colours_of(names):
    return {name: COLOURS[i % len(COLOURS)] for i, name in enumerate(names)}


def bar(parts, colours):
    """Shares of a whole as one horizontal bar; `parts` maps a name to a number."""
    total = sum(parts.values()) or 1.0
    at, out = 0.0, []
    for name, value in parts.items():
        width = 600.0 * value / total
        out.append(f'<rect x="{at:.1f}" y="0" width="{width:.1f}" height="18" '
                   f'fill="{colours[name]}"><title>{name}: {100 * value / total:.1f} %</title>'
                   f'</rect>')
        at += width
    return '<svg class="bar" viewBox="0 0 600 18">' + "".join(out) + "</svg>"
