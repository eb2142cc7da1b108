"""Linkages with clearance as models of Exudyn, an independent multibody program."""
