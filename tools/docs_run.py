#!/usr/bin/env python3
"""Runs the commands of the documentation: docs_run.py [PAGE...]; without PAGE all pages of docs/.

The blocks of a page that begin with ```bash are one script, in their order, in a new folder build/docs-run/PAGE that holds the
files beside the page which are no pages (scenes). Blocks with ```sh are not run: they take hours, or another machine.
Exit code 1 where a command fails.
"""
import os
import re
import resource
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BLOCK = re.compile(r"^```bash\n(.*?)^```$", re.M | re.S)


def script_of(page):
    """The page's blocks, each with a line that says where it stands; empty where the page has none."""
    text = page.read_text()
    blocks = [(text.count("\n", 0, match.start(1)) + 1, match[1]) for match in BLOCK.finditer(text)]
    return "".join(f"echo '== {page.relative_to(ROOT)}:{line}'\n{commands}" for line, commands in blocks)


def run(page, script):
    sys.stdout.flush()
    folder = ROOT / "build/docs-run" / page.relative_to(ROOT / "docs").with_suffix("")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for file in page.parent.iterdir():
        if file.is_file() and file.suffix != ".md":
            shutil.copy(file, folder)
    environment = dict(os.environ, PATH=f"{ROOT / 'build/bin'}:{os.environ['PATH']}")
    return subprocess.run(["bash", "-euo", "pipefail", "-c", script], cwd=folder, env=environment, check=False).returncode


def main():
    pages = [Path(name).resolve() for name in sys.argv[1:]] or sorted((ROOT / "docs").rglob("*.md"))
    scripts = {page: script for page in pages if (script := script_of(page))}
    failed = []
    for page, script in scripts.items():
        if code := run(page, script):
            print(f"{page.relative_to(ROOT)}: a command failed with exit code {code}: the last one below the last ==")
            failed.append(page)
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"The commands of {len(scripts)} pages took {usage.ru_utime + usage.ru_stime:.0f} s of CPU time.")
    print(f"pages: {len(scripts) - len(failed)} passed, {len(failed)} failed")
    return 1 if failed else 0


sys.exit(main())
