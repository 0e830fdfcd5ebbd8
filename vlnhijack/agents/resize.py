"""An agent's resizing of images: as a function, as matrices, and against PIL's 8-bit one."""

import numpy as np
import torch
import torch.nn.functional as F
from PIL import Image
from torch import Tensor

from vlnhijack import display

TIMM_CROP = 0.9

Size = tuple[int, int]


def resize_and_crop(images: Tensor, size: Size, crop: float = TIMM_CROP) -> Tensor:
    """(V,3,h,w) to (V,3,*size); images of that size already are left as they are.

    timm's evaluation transform (antialiased bicubic, central 90 %: for 224, the shorter side to 248
    and a centre crop) without its 8-bit rounding, so linear in the images and free to overshoot.
    `crop` is the share of the shorter side that is kept; CLIP's transform keeps all of it.
    """
    if images.shape[-2:] == size:
        return images
    scaled, (top, left) = _plan((images.shape[-2], images.shape[-1]), size, crop)
    images = F.interpolate(images, scaled, mode="bicubic", antialias=True)
    return images[..., top : top + size[0], left : left + size[1]]


def resize_matrices(shape: Size, size: Size, crop: float = TIMM_CROP) -> tuple[Tensor, Tensor]:
    """Vertical (h',h) and horizontal (w',w): resize_and_crop(x) = vertical · x · horizontalᵀ."""
    if shape == size:
        return torch.eye(shape[0]), torch.eye(shape[1])
    scaled, corner = _plan(shape, size, crop)
    vertical, horizontal = (
        _interpolation(before, after)[start : start + length]
        for before, after, start, length in zip(shape, scaled, corner, size, strict=True)
    )
    return vertical, horizontal


def pil_gap(images: Tensor, size: Size) -> tuple[float, float]:
    """Mean and largest difference, in display values, from what timm computes with PIL.

    PIL resizes 8-bit images and rounds and clips the result to 8 bits.
    """
    scaled, (top, left) = _plan((images.shape[-2], images.shape[-1]), size, TIMM_CROP)
    ours = resize_and_crop(images, size).permute(0, 2, 3, 1).numpy()
    levels = display.to_8bit(images.permute(0, 2, 3, 1).numpy())
    resized = [
        np.asarray(Image.fromarray(image).resize(scaled[::-1], Image.Resampling.BICUBIC))
        for image in levels
    ]
    theirs = np.stack(resized)[:, top : top + size[0], left : left + size[1]]
    gap = np.abs(ours - display.from_8bit(theirs))
    return float(gap.mean()), float(gap.max())


def _plan(shape: Size, size: Size, crop: float) -> tuple[Size, Size]:
    """The size (h,w) to scale to, and the top left corner of the crop."""
    height, width = shape
    scale = max(int(size[0] / crop) / height, int(size[1] / crop) / width)
    scaled = (int(height * scale + 1e-6), int(width * scale + 1e-6))
    return scaled, (round((scaled[0] - size[0]) / 2), round((scaled[1] - size[1]) / 2))


def _interpolation(before: int, after: int) -> Tensor:
    """The matrix (after, before) of antialiased bicubic resizing along one axis."""
    pixels = torch.eye(before)[None, None]
    return F.interpolate(pixels, (after, before), mode="bicubic", antialias=True)[0, 0]
