"""A picture of what two ways to find the numbers of a photo say, one row a photo, beside the truth: used by invert_dataset.py."""
import base64
import html

THUMBNAIL, GAP, PANEL, ROW, TOP, FONT = 64, 12, 210, 76, 58, 12
BY_NETWORK, BY_INVERSION, OF_TRUTH = '#999999', '#1f6fb4', '#d62728'


def line(x, y, to_x, to_y, colour, width=1.5):
    return f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{to_x:.1f}" y2="{to_y:.1f}" stroke="{colour}" stroke-width="{width}"/>'


def text(x, y, words, anchor='start', colour='black'):
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}">{html.escape(words)}</text>'


def thumbnail(x, y, file):
    if not file.exists():
        return ''
    data = base64.b64encode(file.read_bytes()).decode()
    return (f'<image x="{x}" y="{y}" width="{THUMBNAIL}" height="{THUMBNAIL}" style="image-rendering:pixelated" '
            f'href="data:image/png;base64,{data}"/>')


def interval(place, found, y, colour):
    """found: value, low and high."""
    low, high, value = (place(found[key]) for key in ('low', 'high', 'value'))
    return (line(low, y, high, y, colour, 3) + line(low, y - 4, low, y + 4, colour) + line(high, y - 4, high, y + 4, colour)
            + f'<circle cx="{value:.1f}" cy="{y:.1f}" r="4" fill="{colour}"/>')


def interval_picture(photos, parameters):
    """SVG. photos: dicts of folder (of the inversion: its target.png and rerender.png), truth, network, found; the
    latter three by short name of a parameter, as numbers and as dicts of value, low, high. parameters: title by short name."""
    first = 2 * (THUMBNAIL + GAP)
    width = first + len(parameters) * (PANEL + 2 * GAP)
    height = TOP + ROW * len(photos) + 24
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
             f'font-family="sans-serif" font-size="{FONT}"><rect width="{width}" height="{height}" fill="white"/>']
    for k, (words, colour) in enumerate((('network', BY_NETWORK), ('inversion', BY_INVERSION), ('truth', OF_TRUTH))):
        x = first + GAP + 130 * k
        parts.append(line(x, 14, x + 24, 14, colour, 3) + text(x + 30, 18, words))
    parts += [text(GAP / 2, 46, 'photo'), text(GAP / 2 + THUMBNAIL + GAP, 46, 'rendered')]
    for k, photo in enumerate(photos):
        y = TOP + ROW * k
        parts += [thumbnail(GAP / 2, y, photo['folder'] / 'target.png'),
                  thumbnail(GAP / 2 + THUMBNAIL + GAP, y, photo['folder'] / 'rerender.png')]
    for column, (short, title) in enumerate(parameters.items()):
        left = first + GAP + column * (PANEL + 2 * GAP)
        numbers = [p['truth'][short] for p in photos]
        numbers += [p[who][short][key] for p in photos for who in ('network', 'found') for key in ('low', 'high')]
        low, high = min(numbers), max(numbers)
        scale = PANEL / max(high - low, 1e-30)

        def place(value):
            return left + (value - low) * scale
        parts.append(text(left + PANEL / 2, 46, title, 'middle'))
        parts += [text(left, height - 6, f'{low:.3g}'), text(left + PANEL, height - 6, f'{high:.3g}', 'end')]
        for k, photo in enumerate(photos):
            y = TOP + ROW * k
            parts += [f'<rect x="{left}" y="{y}" width="{PANEL}" height="{ROW - GAP}" fill="#f4f4f4"/>',
                      interval(place, photo['network'][short], y + 20, BY_NETWORK),
                      interval(place, photo['found'][short], y + 44, BY_INVERSION),
                      line(place(photo['truth'][short]), y, place(photo['truth'][short]), y + ROW - GAP, OF_TRUTH)]
    return '\n'.join((*parts, '</svg>\n'))
