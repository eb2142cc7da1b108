"""The world of a cell: distances between its bodies along motions, contact, gripper and camera."""
