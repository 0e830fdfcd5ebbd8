"""vlnhijack: hijack vision-and-language navigation agents by the texture of one object."""

__version__ = "0.1.0"
