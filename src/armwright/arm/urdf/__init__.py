"""URDF, the format of ROS: elements, the tree of links and joints, the chain in it, its axes as frames, and back."""
