"""Linkages without clearance as models of MuJoCo."""
