"""Vibration of linkages with joint clearance: rattling on paths, and natural frequencies on the contacts."""
