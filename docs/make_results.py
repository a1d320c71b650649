"""Reproduce the paper, check it, and put what came of it where the documentation shows it.

    python docs/make_results.py

Writes docs/results: claims.md, certificate.md and falsification.md, which pages include; and the
pictures of these pages and of README in docs/images. Run it after every change of a scenario, a
law, a claim or a proposition.
"""

import shutil
import sys
import tempfile
from pathlib import Path

from PIL import Image

from alight.cli.check import keep_certificate
from alight.files import whole_file
from alight.reproduction import reproduce
from alight.theory import check, page
from alight.theory.falsification import falsify, markdown

DOCS = Path(__file__).resolve().parent
COLOURS = 64
"""Enough for line drawings; a picture takes a third of its size."""


def main() -> None:
    reproduced()
    certified()
    print("attacking every proposition", file=sys.stderr)
    write("falsification.md", markdown(falsify(effort="full")))


def certified() -> None:
    """The certificate of Experiment 1, without its title, which the page has."""
    with tempfile.TemporaryDirectory() as out:
        made = check("experiment-1")
        keep_certificate(made, Path(out))
        _, _, body = page(made).partition("\n\n")
        write("certificate.md", body)
        for picture in sorted(Path(out).glob("*.png")):
            shrink(picture, DOCS / "images" / picture.name)


def write(name: str, text: str) -> None:
    """Write one of the parts that pages include."""
    with whole_file(DOCS / "results" / name) as file:
        file.write(text.encode("utf-8"))


def reproduced() -> None:
    """The table of claims, the figures and the animation."""
    with tempfile.TemporaryDirectory() as out:
        done = reproduce(out, lambda share, what: print(f"{share:4.0%} {what}", file=sys.stderr))
        if not done.complete:
            sys.exit("an experiment did not run to its end: such results are not shown")
        for folder in ("results", "images"):
            (DOCS / folder).mkdir(exist_ok=True)
        report = Path(out, "report.md").read_text("utf-8")
        write("claims.md", claims_of(report))
        for picture in sorted(Path(out).glob("*.png")):
            shrink(picture, DOCS / "images" / picture.name)
        shutil.copyfile(Path(out, "strike.gif"), DOCS / "images" / "strike.gif")


def claims_of(report: str) -> str:
    """The report without its title, which the page has, and its figures, which it shows itself."""
    _, _, body = report.partition("\n\n")
    text, figures, _ = body.partition("## Figures")
    if not (text and figures):
        sys.exit("report.md has no title or no figures: adapt make_results.py to it")
    return text.strip() + "\n"


def shrink(picture: Path, to: Path) -> None:
    """Copy a picture with a palette instead of full colours."""
    with Image.open(picture) as full, whole_file(to) as file:
        flat = Image.new("RGB", full.size, "white")
        flat.paste(full, mask=full.getchannel("A") if "A" in full.getbands() else None)
        flat.quantize(COLOURS, dither=Image.Dither.NONE).save(file, "png", optimize=True)


if __name__ == "__main__":
    main()
