"""A photo as the other drawings are: SVG with a name."""

import base64
import io
from xml.etree import ElementTree as Xml


def photo_svg(jpeg: bytes, name: str) -> str:
    """Return a JPEG as an SVG picture that holds it, as wide as most drawings are; `name` is for who cannot see it."""
    from PIL import Image

    with Image.open(io.BytesIO(jpeg), formats=("JPEG",)) as image:
        scale = 600.0 / max(image.size)
        width, height = f"{image.width * scale:g}", f"{image.height * scale:g}"
    root = Xml.Element(
        "svg",
        {
            "xmlns": "http://www.w3.org/2000/svg",
            "viewBox": f"0 0 {width} {height}",
            "role": "img",
            "aria-label": name,
        },
    )
    Xml.SubElement(root, "title").text = name
    data = "data:image/jpeg;base64," + base64.b64encode(jpeg).decode("ascii")
    Xml.SubElement(root, "image", {"href": data, "width": width, "height": height})
    return Xml.tostring(root, encoding="unicode")
