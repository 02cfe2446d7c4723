"""Reads a PDF with PDFium and the PNG of the same picture: prints the size of the page in points, the number of pages, what the file says of itself, and how many of the pixels differ by more than a quarter of the range."""

import json
import sys

import numpy as np
import pypdfium2
from PIL import Image

document = pypdfium2.PdfDocument(sys.argv[1])
page = document[0]
with Image.open(sys.argv[2]) as image:
    ours = np.asarray(image.convert("RGB"), dtype=float)
drawn = page.render(scale=ours.shape[1] / page.get_width()).to_pil().convert("RGB")
if len(sys.argv) > 3:
    drawn.save(sys.argv[3])
theirs = np.asarray(drawn, dtype=float)
assert theirs.shape == ours.shape, (theirs.shape, ours.shape)
off = np.abs(theirs - ours).max(axis=2) > 64
print(json.dumps({
    "size": [page.get_width(), page.get_height()],
    "shape": list(ours.shape),
    "pages": len(document),
    "producer": document.get_metadata_value("Producer"),
    "title": document.get_metadata_value("Title"),
    "off": float(off.mean()),
    "ink": float((ours.min(axis=2) < 192).mean()),
}))
