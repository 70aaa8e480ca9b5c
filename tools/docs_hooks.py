"""What MkDocs does beyond Markdown for docs/ (mkdocs.yml names this file).

- A line `<!-- help COMMAND -->` becomes the options of `itn COMMAND`, as the program itself prints them; `<!-- help -->`
  those that most commands have. So the reference cannot go stale.
- A line `<!-- code FILE -->` becomes that file of the project, as a block of C.
- A line `<!-- include FILE from "HEADING" -->` becomes the text of that file of the project, from that heading on.
- `parameters.md` must name every parameter, with its range, that `itn parameters` lists for the scenes of this project.
- Formulas become MathML, which browsers draw without a script.
- Pictures of the gallery are found under `images/`.
- Links in the READMEs of the project must lead to files that are there.
"""
import json
import re
import subprocess
from collections import Counter
from pathlib import Path

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parent.parent
ITN = ROOT / "build/bin/itn"


def itn(*arguments):
    run = subprocess.run([ITN, *arguments], capture_output=True, text=True, check=False)
    if run.returncode != 0:
        raise PluginError(f"itn {' '.join(map(str, arguments))}: exit code {run.returncode}\n{run.stderr}")
    return run.stdout


def help_entries(text):
    """The help that CLI11 prints: [(section, name, description)].

    A name stands at column 2 and its description at column 30 or, where the name is too long, on the next line. An
    example ends the text.
    """
    lines, entries, section = text.partition("\nExample:")[0].splitlines(), [], ""
    for line, following in zip(lines, [*lines[1:], ""]):
        continued = following.startswith(" " * 30) and section != "Subcommands"
        if line and not line.startswith(" "):
            section = line.rstrip(":")
        elif line.startswith("  ") and line[2:3].strip():
            end = len(line) if continued else 30
            entries.append([section, line[2:end].strip(), line[end:].strip()])
        elif line.strip():
            entries[-1][2] = f"{entries[-1][2]} {line.strip()}".strip()
    return entries


def commands():
    return [name for section, name, _ in help_entries(itn("--help")) if section == "Subcommands"]


def helps():
    """{command: its entries}, and the entries that most commands have with the same words."""
    entries = {command: help_entries(itn(command, "--help")) for command in commands()}
    seen = Counter(tuple(entry) for command in entries.values() for entry in command)
    return entries, [list(entry) for entry, times in seen.items() if times > len(entries) / 2]


OPTION = re.compile(r"(?P<name>\S+)( (?P<type>[A-Z]+(x[A-Z]+)?)(:((?P<choices>\{.*?\})|[A-Z]+=[A-Z,]+|\S+ in \[(?P<low>\S+) - (?P<high>\S+)\]))?"
                    r"(=(?P<default>\S+))?(?P<times>( x \d+)?( \.\.\.)?))?(?P<required> REQUIRED)?")


def as_list(entries):
    """A definition list. CLI11's names say everything at once: `--mode TEXT:{automatic,images}=automatic REQUIRED`."""
    lines, heading = [], ""
    for section, name, description in entries:
        if section != heading and section not in ("Positionals", "Options"):
            lines += [f"**{section}**", ""]
        heading = section
        option = OPTION.fullmatch(name)
        if not option:
            raise PluginError(f"itn --help: {name!r} is no option as CLI11 writes them")
        facts = []
        if option["choices"]:
            facts.append("one of " + ", ".join(f"`{choice}`" for choice in option["choices"][1:-1].split(",")))
        elif option["low"]:
            facts.append(f"{option['low']} to {option['high']}")
        facts += [f"default `{option['default']}`"] * bool(option["default"]) + ["required"] * bool(option["required"])
        term = " ".join(filter(None, [option["name"], option["type"], (option["times"] or "").strip()]))
        lines += [f"`{term}`" + f" ({'; '.join(facts)})" * bool(facts), f":   {escaped(description)}", ""]
    return "\n".join(lines)


def escaped(text):
    return re.sub(r"([*_<$\[])", r"\\\1", text)


def expand_help(markdown):
    if "<!-- help" not in markdown:
        return markdown
    entries, common = helps()
    shown = re.findall(r"^<!-- help (\S+) -->$", markdown, re.M)
    if sorted(shown) != sorted(entries):
        raise PluginError(f"the page shows the help of {sorted(shown)}; itn has {sorted(entries)}")
    markdown = re.sub(r"^<!-- help -->$", lambda _: as_list(common), markdown, flags=re.M)
    return re.sub(r"^<!-- help (\S+) -->$",
                  lambda match: as_list([entry for entry in entries[match[1]] if entry not in common]), markdown, flags=re.M)


def expand_include(markdown):
    def text(match):
        file, heading = match.groups()
        content = (ROOT / file).read_text()
        start = content.find(f"\n{heading}\n")
        if start < 0:
            raise PluginError(f"{file} has no line {heading!r}, which a page includes from")
        return content[start:].strip()
    markdown = re.sub(r"^<!-- code (\S+) -->$", lambda match: f"```c\n{(ROOT / match[1]).read_text()}```", markdown, flags=re.M)
    return re.sub(r'^<!-- include (\S+) from "(.*)" -->$', text, markdown, flags=re.M)


def check_parameters(markdown):
    scenes = sorted((ROOT / "scenes/gallery").glob("*.xml")) + sorted((ROOT / "scenes/test/mitsuba").glob("*.xml"))
    rows = [line for line in markdown.splitlines() if line.startswith("| `")]
    for scene in scenes:
        for parameter in json.loads(itn("parameters", scene, "--json", "-"))["parameters"]:
            name = re.sub(r"\.[RGB]$", "", parameter["name"]).rsplit(".", 1)[1]
            name = re.sub(r"_\d+$", "_k", name)  # weight_0, weight_1, ..., and values have one row each
            if not any(row.startswith(f"| `{name}` |") and parameter["range"] in row for row in rows):
                raise PluginError(f"parameters.md has no row for `{name}` with the range {parameter['range']} ({scene.name})")


def on_pre_build(config):
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "*.md", ":!docs"], cwd=ROOT, capture_output=True, text=True,
                            check=True).stdout
    for name in listed.split():
        for target in re.findall(r"\]\(([^)#\s]+)", (ROOT / name).read_text()):
            if not target.startswith("http") and not ((ROOT / name).parent / target).exists():
                raise PluginError(f"{name}: the link to {target} leads nowhere")


def on_files(files, config):
    for picture in sorted((ROOT / "scenes/gallery").glob("*.png")):
        files.append(File.generated(config, f"images/{picture.name}", abs_src_path=str(picture)))
    return files


def on_page_markdown(markdown, page, config, files):
    markdown = expand_include(expand_help(markdown))
    if page.file.src_uri == "reference/parameters.md":
        check_parameters(markdown)
    return markdown


# MathML knows no space around the names of functions, and takes the bars of an absolute value for operators.
FUNCTION = re.compile(r"<msup><mi>[a-z]{2,}</mi>.*?</msup>|<mi>[a-z]{2,}</mi>")


def on_page_content(html, page, config, files):
    def formula(match):
        inline = match[2].startswith(r"\(")
        latex = match[2][2:-2].replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")
        mathml = convert(latex, display="inline" if inline else "block")
        mathml = mathml.replace('<mo stretchy="false">&#x0007C;', '<mo stretchy="false" lspace="0" rspace="0">&#x0007C;')
        return FUNCTION.sub(r'<mspace width="0.15em"/>\g<0><mspace width="0.15em"/>', mathml)
    return re.sub(r'<(span|div) class="arithmatex">(.*?)</\1>', formula, html, flags=re.S)
