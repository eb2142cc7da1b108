"""Rotations and poses, as arrays: ``X_AB`` is the pose of frame B seen from frame A, (..., 4, 4)."""
