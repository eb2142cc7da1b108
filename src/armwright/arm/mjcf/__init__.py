"""MJCF, the format of MuJoCo: its elements, bounded and told where they stand, and the tree of bodies and joints."""
