"""Matterport3D's layout of a scan: read, matched to objects, and written.

Formats: `data_organization.md` and `mpview` of github.com/niessner/Matterport.
"""
