"""Reproduce the paper, and put what came of it where the documentation shows it.

    python docs/make_results.py

Writes docs/results/claims.md, which the page of results includes, and the pictures of that page
and of README in docs/images. Run it after every change of a scenario, a law or a claim.
"""

import shutil
import sys
import tempfile
from pathlib import Path

from PIL import Image

from alight.files import whole_file
from alight.reproduction import reproduce

DOCS = Path(__file__).resolve().parent
COLOURS = 64
"""Enough for line drawings; a picture takes a third of its size."""


def main() -> None:
    with tempfile.TemporaryDirectory() as out:
        done = reproduce(out, lambda share, what: print(f"{share:4.0%} {what}", file=sys.stderr))
        if not done.complete:
            sys.exit("an experiment did not run to its end: such results are not shown")
        for folder in ("results", "images"):
            (DOCS / folder).mkdir(exist_ok=True)
        report = Path(out, "report.md").read_text("utf-8")
        with whole_file(DOCS / "results" / "claims.md") as file:
            file.write(claims_of(report).encode("utf-8"))
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
