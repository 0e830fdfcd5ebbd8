"""The JSON of a glTF file: what trimesh does not tell about materials, and what it cannot read."""

import json
import struct
from pathlib import Path
from typing import Annotated, Any, Literal
from urllib.parse import unquote

from pydantic import BaseModel, ConfigDict, Field, NonNegativeInt, TypeAdapter

from vlnhijack.artifacts import parse_json, validated
from vlnhijack.errors import InputError
from vlnhijack.scenes.gltf import WRAP_CODES
from vlnhijack.scenes.surface import Wrap

_MAGIC, _JSON = b"glTF", b"JSON"
_READ = ("KHR_materials_", "KHR_lights_", "KHR_texture_transform", "EXT_texture_webp")
_SPECULAR = "KHR_materials_pbrSpecularGlossiness"
_WRAPS: dict[int, Wrap] = {code: wrap for wrap, code in WRAP_CODES.items()}
_Unit = Annotated[float, Field(ge=0, le=1)]


class _Form(BaseModel):
    model_config = ConfigDict(allow_inf_nan=False)


class _Transform(_Form):
    offset: tuple[float, float] = (0.0, 0.0)
    scale: tuple[float, float] = (1.0, 1.0)
    rotation: Literal[0] = 0


class _TextureExtensions(_Form):
    transform: _Transform = Field(default=_Transform(), alias="KHR_texture_transform")


class _TextureInfo(_Form):
    index: NonNegativeInt
    texCoord: NonNegativeInt = 0
    extensions: _TextureExtensions = _TextureExtensions()


class _Pbr(_Form):
    baseColorFactor: tuple[_Unit, _Unit, _Unit, _Unit] = (1.0, 1.0, 1.0, 1.0)
    baseColorTexture: _TextureInfo | None = None


class _Material(_Form):
    name: str = "material"
    alphaMode: str = "OPAQUE"
    pbrMetallicRoughness: _Pbr = _Pbr()
    extensions: dict[str, Any] = {}


class _Texture(_Form):
    sampler: NonNegativeInt | None = None
    source: NonNegativeInt | None = None


class _Sampler(_Form):
    wrapS: int = WRAP_CODES["repeat"]
    wrapT: int = WRAP_CODES["repeat"]


class _Image(_Form):
    uri: str | None = None


class _Buffer(_Form):
    byteLength: NonNegativeInt


class _Primitive(_Form):
    material: NonNegativeInt | None = None


class _Mesh(_Form):
    primitives: tuple[_Primitive, ...] = ()


class _Node(_Form):
    children: tuple[NonNegativeInt, ...] = ()
    mesh: NonNegativeInt | None = None
    matrix: Annotated[tuple[float, ...], Field(min_length=16, max_length=16)] | None = None
    translation: tuple[float, float, float] | None = None
    rotation: tuple[float, float, float, float] | None = None
    scale: tuple[float, float, float] | None = None


class _Scene(_Form):
    nodes: tuple[NonNegativeInt, ...] = ()


class GltfHeader(_Form):
    """The parts of the JSON that are needed here."""

    extensionsRequired: tuple[str, ...] = ()
    materials: tuple[_Material, ...] = ()
    textures: tuple[_Texture, ...] = ()
    samplers: tuple[_Sampler, ...] = ()
    images: tuple[_Image, ...] = ()
    buffers: tuple[_Buffer, ...] = ()
    meshes: tuple[_Mesh, ...] = ()
    nodes: tuple[_Node, ...] = ()
    scenes: tuple[_Scene, ...] = ()
    scene: NonNegativeInt | None = None

    def texture(self, material: _Material) -> _Texture | None:
        """The base-colour texture of a material."""
        info = material.pbrMetallicRoughness.baseColorTexture
        return None if info is None else self.textures[info.index]

    def wrap(self, material: _Material) -> tuple[Wrap, bool]:
        """Wrap mode of the base-colour texture along u, and whether that along v is the same."""
        texture = self.texture(material)
        sampler = _Sampler()
        if texture is not None and texture.sampler is not None:
            sampler = self.samplers[texture.sampler]
        wrap = _WRAPS.get(sampler.wrapS, "repeat")
        return wrap, wrap == _WRAPS.get(sampler.wrapT, "repeat")

    def image_uri(self, material: _Material) -> str | None:
        """The file of the base-colour image, relative to the glTF's, where it is one."""
        texture = self.texture(material)
        if texture is None or texture.source is None:
            return None
        uri = self.images[texture.source].uri
        return None if uri is None or uri.startswith("data:") else unquote(uri)


_HEADER = TypeAdapter(GltfHeader)


def read_header(file: Path) -> tuple[GltfHeader, bytes]:
    """The header, and the file's content in which material i is named str(i).

    The names let the materials that trimesh makes be told apart. Raises InputError where the file
    is truncated, not glTF 2, has specular-glossiness materials, or needs an extension that is not
    read here (such as compression).
    """
    content = file.read_bytes()
    if file.suffix.lower() == ".glb":
        tree, rest = _glb_chunks(file, content)
    else:
        tree, rest = parse_json(content, file), None
    header = validated(_HEADER, tree, file)
    unread = [name for name in header.extensionsRequired if not name.startswith(_READ)]
    if unread:
        raise InputError(
            file=file,
            field="extensionsRequired",
            expected="a glTF that needs no compression or other extension",
            received=", ".join(unread),
        )
    if any(_SPECULAR in material.extensions for material in header.materials):
        expected = "metallic-roughness materials"
        raise InputError(file=file, field="materials", expected=expected, received=_SPECULAR)
    _check_references(file, header)
    _check_trees(file, header)
    for number, material in enumerate(tree.get("materials", [])):
        material["name"] = str(number)
    return header, _packed(tree, rest)


def _glb_chunks(file: Path, content: bytes) -> tuple[Any, bytes]:
    """The parsed JSON chunk and all that follows it."""
    if len(content) < 20 or content[:4] != _MAGIC or content[16:20] != _JSON:
        raise InputError(file=file, expected="a binary glTF 2 file", received=repr(content[:8]))
    version, length, json_length = struct.unpack("<4xIII", content[:16])
    if version != 2 or length != len(content) or 20 + json_length > length:
        raise InputError(
            file=file,
            field="header",
            expected=f"glTF 2 of {length} bytes",
            received=f"glTF {version} of {len(content)} bytes",
        )
    return parse_json(content[20 : 20 + json_length], file), content[20 + json_length :]


def _packed(tree: Any, rest: bytes | None) -> bytes:
    text = json.dumps(tree).encode()
    if rest is None:
        return text
    text += b" " * (-len(text) % 4)
    length = 20 + len(text) + len(rest)
    return struct.pack("<4sIII4s", _MAGIC, 2, length, len(text), _JSON) + text + rest


def _check_references(file: Path, header: GltfHeader) -> None:
    """InputError where something points to what is not there."""
    infos = [m.pbrMetallicRoughness.baseColorTexture for m in header.materials]
    primitives = [primitive for mesh in header.meshes for primitive in mesh.primitives]
    children = [child for node in header.nodes for child in node.children]
    roots = [root for scene in header.scenes for root in scene.nodes]
    references: list[tuple[str, int, list[int | None]]] = [
        ("textures", len(header.textures), [i.index for i in infos if i is not None]),
        ("images", len(header.images), [t.source for t in header.textures]),
        ("samplers", len(header.samplers), [t.sampler for t in header.textures]),
        ("materials", len(header.materials), [p.material for p in primitives]),
        ("meshes", len(header.meshes), [node.mesh for node in header.nodes]),
        ("nodes", len(header.nodes), [*children, *roots]),
        ("scenes", len(header.scenes), [header.scene]),
    ]
    for field, count, indices in references:
        wrong = [index for index in indices if index is not None and index >= count]
        if wrong:
            raise InputError(
                file=file, field=field, expected=f"indices below {count}", received=wrong
            )
    if any(info is not None and info.texCoord for info in infos):
        raise InputError(
            file=file, field="texCoord", expected="base colours on TEXCOORD_0", received="another"
        )


def _check_trees(file: Path, header: GltfHeader) -> None:
    """InputError where a node has two parents, or is below itself."""
    children = [child for node in header.nodes for child in node.children]
    waiting = sorted(set(range(len(header.nodes))) - set(children))
    reached, has_one_parent = 0, len(set(children)) == len(children)
    while waiting and has_one_parent:
        waiting += header.nodes[waiting.pop()].children
        reached += 1
    if reached < len(header.nodes):
        raise InputError(
            file=file,
            field="nodes",
            expected="trees, each node with one parent at most",
            received="a node with two, or below itself",
        )
