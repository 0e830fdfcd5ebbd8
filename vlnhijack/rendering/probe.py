"""Does a Mitsuba variant work here? `python -m vlnhijack.rendering.probe llvm_ad_rgb`

Run as a process of its own, because a variant that does not work may abort its process.
"""

import sys

from vlnhijack.llvm import require_llvm


def probe(variant: str) -> None:
    """Renders four pixels of a lit scene with a path tracer; any failure is an exception."""
    if variant.startswith("llvm"):
        require_llvm()
    import mitsuba as mi

    mi.set_variant(variant)
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 2},
            "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 2, "height": 2}},
            "floor": {"type": "rectangle", "bsdf": {"type": "diffuse"}},
            "sky": {"type": "constant"},
        }
    )
    mi.render(scene, spp=1).numpy()


if __name__ == "__main__":
    probe(sys.argv[1])
