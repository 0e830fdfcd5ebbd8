"""The operator and background of a baked house in one safetensors file, keyed by their causes."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import astuple
from pathlib import Path

from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor

from vlnhijack.artifacts import write_bytes
from vlnhijack.errors import InputError
from vlnhijack.frames import Camera
from vlnhijack.rendering.filters import Filters
from vlnhijack.rendering.samples import RAYS_AT_ONCE, SAMPLER
from vlnhijack.rendering.transport import Transport, csr, with_adjoint
from vlnhijack.rendering.variant import chosen, torch_device
from vlnhijack.scenes.house import House

_FORMAT = "vlnhijack transport 2"
_TENSORS = ("starts", "columns", "values", "background")


def fingerprint(
    house: House,
    object_id: str,
    cameras: Sequence[Camera],
    spp: int,
    seed: int,
    filters: Filters,
) -> str:
    """SHA-256 of variant, geometry, cameras, samples, filters and textures but the object's."""
    digest = hashlib.sha256()
    views = [astuple(camera) for camera in cameras]
    settings = (chosen(), object_id, views, SAMPLER, RAYS_AT_ONCE, spp, seed, astuple(filters))
    digest.update(json.dumps(settings).encode())
    for surface in house.surfaces:
        arrays = [surface.vertices, surface.faces, surface.uv]
        is_object = surface.object_id == object_id
        arrays += [] if is_object else [surface.texture]
        digest.update(json.dumps([surface.texture.shape, surface.wrap, is_object]).encode())
        for array in arrays:
            digest.update(json.dumps([array.shape, str(array.dtype)]).encode())
            digest.update(array.tobytes())
    return digest.hexdigest()


def save_transport(path: Path, key: str, transport: Transport, background: Tensor) -> None:
    """Write both, with the key."""
    forward = transport.forward
    arrays = (forward.crow_indices(), forward.col_indices(), forward.values(), background)
    tensors = dict(zip(_TENSORS, arrays, strict=True))
    header = {"format": _FORMAT, "key": key, "texture": json.dumps(transport.texture_shape)}
    write_bytes(path, save({name: x.cpu().contiguous() for name, x in tensors.items()}, header))


def load_transport(path: Path, key: str) -> tuple[Transport, Tensor]:
    """What `save_transport` wrote; InputError where its format or key is another."""
    try:
        with safe_open(path, "pt", torch_device()) as file:
            header = file.metadata() or {}
            _require(path, header, key)
            starts, columns, values, rest = map(file.get_tensor, _TENSORS)
    except SafetensorError as error:
        raise InputError(f"not a safetensors file ({error})", file=path) from None
    height, width, colours = json.loads(header["texture"])
    forward = csr(starts, columns, values, (len(rest), height * width))
    return with_adjoint(forward, (height, width, colours)), rest


def _require(path: Path, header: dict[str, str], key: str) -> None:
    for field, expected in (("format", _FORMAT), ("key", key)):
        if header.get(field) != expected:
            raise InputError(
                "stale operator, delete the file to build it anew",
                file=path,
                field=field,
                expected=expected,
                received=header.get(field),
            )
