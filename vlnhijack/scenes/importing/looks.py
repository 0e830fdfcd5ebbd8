"""Materials of mesh files: images, colours and wrap modes, each file type in its own way."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from vlnhijack import display
from vlnhijack.errors import InputError
from vlnhijack.scenes.importing.gltf_header import GltfHeader
from vlnhijack.scenes.importing.memory import BYTES_PER_PIXEL, require_memory
from vlnhijack.scenes.importing.mtl import MtlMaterial
from vlnhijack.scenes.importing.source_mesh import Material
from vlnhijack.scenes.surface import Wrap

PLAIN = Material("plain")
_GREY = (0.5, 0.5, 0.5)

Transform = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True)
class Look:
    """A material, and the offset and scale of its texture coordinates."""

    material: Material
    transform: Transform = ((0.0, 0.0), (1.0, 1.0))


@dataclass
class Images:
    """The images of a file, each decoded once.

    flat: a missing or broken image is replaced by a flat colour instead of refused; notes: what a
    user should know; see `pixels`.
    """

    file: Path
    flat: bool
    notes: list[str] = field(default_factory=list)
    _decoded: dict[int, NDArray[np.uint8]] = field(default_factory=dict)
    _open: list[Image.Image] = field(default_factory=list)
    _files: dict[Path, Image.Image | None] = field(default_factory=dict)
    _pixels: int = 0

    def pixels_of_file(self, path: Path) -> NDArray[np.uint8] | None:
        """`pixels` of an image file."""
        if path not in self._files:
            try:
                self._files[path] = Image.open(path)
            except (OSError, ValueError, Image.DecompressionBombError):
                self._files[path] = None
        return self.pixels(self._files[path], path.name)

    def pixels(self, image: Image.Image | None, name: str) -> NDArray[np.uint8] | None:
        """Display values (H,W,3) of an image of this name, None where it is flat.

        Raises InputError where it is missing or broken, or larger than the memory.
        """
        if image is not None and id(image) in self._decoded:
            return self._decoded[id(image)]
        try:
            if image is None:
                raise FileNotFoundError("no such image, or not one")
            self._pixels += image.width * image.height
            require_memory(self.file, self._pixels * BYTES_PER_PIXEL)
            found = np.asarray(image.convert("RGB"))
        except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
            if not self.flat:
                raise InputError(
                    file=self.file,
                    field=f"texture {name}",
                    expected="a readable image (or --allow-missing for a flat colour)",
                    received=error,
                ) from None
            self.notes.append(f"texture {name} is missing or broken: a flat colour instead")
            return None
        if image.has_transparency_data:
            self.notes.append(f"alpha of texture {name} is ignored")
        self._open.append(image)  # an id is unique only while its object lives
        self._decoded[id(image)] = found
        return found


def gltf_look(header: GltfHeader, images: Images, material: Any) -> Look:
    """The look of a material that trimesh made of material number int(name) of a glTF.

    The base-colour factor is linear: it multiplies the decoded image.
    """
    index = int(material.name)
    entry = header.materials[index]
    pbr = entry.pbrMetallicRoughness
    *factor, alpha = pbr.baseColorFactor
    if alpha < 1 or entry.alphaMode != "OPAQUE":
        images.notes.append(f"alpha of material {entry.name} is ignored")
    flat = _triple(display.encode(factor))
    if pbr.baseColorTexture is None:
        return Look(Material(entry.name, colour=flat))
    name = header.image_uri(entry) or f"of material {entry.name}"
    image = images.pixels(material.baseColorTexture, name)
    wrap, same = header.wrap(entry)
    if not same:
        images.notes.append(f"material {entry.name} wraps as {wrap} along v too")
    if image is not None and factor != [1.0, 1.0, 1.0]:
        linear = display.decode(image / 255) * np.array(factor, np.float32)
        image = display.to_8bit(display.encode(linear))
    transform = pbr.baseColorTexture.extensions.transform
    return Look(Material(entry.name, image, flat, wrap), (transform.offset, transform.scale))


def obj_look(library: dict[str, MtlMaterial], images: Images, material: Any) -> Look:
    """The look of a material that trimesh made of one of an OBJ's library.

    An image is shown as it is: exporters write any Kd beside a map.
    """
    entry = library.get(material.name, MtlMaterial(_GREY))
    wrap: Wrap = "clamp" if entry.clamped else "repeat"
    if entry.image is None:
        return Look(Material(material.name, colour=entry.colour))
    pixels = images.pixels_of_file(entry.image)
    return Look(Material(material.name, pixels, entry.colour, wrap))


def plain_look(images: Images, material: Any) -> Look:
    """The look of a material of any other file: its image, or white."""
    image = getattr(material, "image", None)
    if image is None:
        return Look(PLAIN)
    return Look(Material("texture", images.pixels(image, "of the mesh")))


def without_image(look: Look, images: Images) -> Look:
    """The look on a mesh without texture coordinates: the mean colour of its image."""
    material = look.material
    if material.image is None:
        return look
    images.notes.append(f"{material.name} lacks texture coordinates: its mean colour instead")
    return Look(Material(material.name, colour=_triple(material.image.mean((0, 1)) / 255)))


def each_once(make: Callable[[Any], Look]) -> Callable[[Any], Look]:
    """`make`, called once for each material by name."""
    made: dict[str | None, Look] = {}

    def look(material: Any) -> Look:
        name = getattr(material, "name", None)
        if name not in made:
            made[name] = make(material)
        return made[name]

    return look


def _triple(values: NDArray[np.floating]) -> tuple[float, float, float]:
    red, green, blue = map(float, values)
    return red, green, blue
